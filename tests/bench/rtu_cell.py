"""Simulated drives on RS-485 lines, each line a process of its own, and axisd on them; for the benchmarks."""
import contextlib
import json
import pathlib
import subprocess
import sys
import time

from figures import running

SERVER = "127.0.0.1:7444"
METRICS = "127.0.0.1:9464"
REQUEST, REPLY = 8, 25  # bytes of a status read
BITS = 10  # of a character, 8N1


def silence(baud):
    """Before each request, in s (Modbus over serial line 2.5.1.1)."""
    return 1.75e-3 if baud > 19200 else 3.5 * BITS / baud


class Line:
    """Simulated drives on a terminal, as a process of its own, and what it saw on the wire."""

    def __init__(self, build, directory, baud, nodes, silent=(), name="line", untimed=False):
        """`untimed`: bytes take no time, and drives answer at once."""
        self.build, self.directory, self.baud, self.nodes = build, pathlib.Path(directory), baud, nodes
        self.silent, self.untimed = silent, untimed
        self.port, self.log = self.directory / name, self.directory / f"{name}.log"
        self.hands = self.directory / f"{name}.ctl"  # control socket of axisd-sim
        # A slave keeps 3.5 characters of silence before it answers: no drive is faster.
        self.turnaround = 0 if untimed else silence(baud)

    def _command(self):
        if self.untimed:
            return [f"{self.build}/tests/bench_untimed_line", self.port, self.log, str(self.nodes)]
        drives = [word for node in range(1, self.nodes + 1) for word in (
            "--drive", f"node={node},model=ykd2405pr" + (",powered=off" if node in self.silent else ""))]
        return [f"{self.build}/daemon/axisd-sim", "--link", self.port, "--baud", str(self.baud), "--turnaround-us",
                str(round(self.turnaround * 1e6)), "--log", self.log, "--control", self.hands, *drives]

    @contextlib.contextmanager
    def open(self):
        with running(*self._command(), stdout=subprocess.PIPE, text=True) as process:
            if not process.stdout.readline().startswith("ready"):
                sys.exit(f"{sys.argv[0]}: the drives did not start")
            yield self

    def frames(self, begin, end):
        """(time of the first byte in s, is a request, frame in hexadecimal) from `begin` to `end`."""
        found = []
        with self.log.open(encoding="ascii") as log:
            for line in log:
                if not line.endswith("\n"):
                    break
                stamp, direction, frame = line.split()
                if begin <= int(stamp) / 1e9 <= end:
                    found.append((int(stamp) / 1e9, direction == "rx", frame))
        return found

    def wire(self, size):
        return 0 if self.untimed else size * BITS / self.baud

    def ideal(self):
        """Of one status read, from its first byte to the first of the next request."""
        return self.wire(REQUEST) + self.turnaround + self.wire(REPLY) + silence(self.baud)


class Client:
    """The calls of bench_rpc_client to a server."""

    def __init__(self, build, target):
        self.program, self.target = f"{build}/tests/bench_rpc_client", target

    def start(self, *words):
        return subprocess.Popen([self.program, self.target, *map(str, words)], stdout=subprocess.PIPE, text=True)

    def run(self, *words):
        """The lines that it prints, split into words."""
        with self.start(*words) as process:
            lines = [line.split() for line in process.stdout]
        if process.returncode != 0:
            sys.exit(f"{sys.argv[0]}: bench_rpc_client {words[0]} ended with {process.returncode}")
        return lines


class Cell:
    """axisd with an axis for each drive of some lines."""

    def __init__(self, build, lines, poll, calls=256, metrics=False, drive=""):
        """`poll`: the refresh period of each axis, None: the default; `calls`: that one client may have waiting;
        `metrics`: serves them at METRICS; `drive`: keys of each axis's drive."""
        self.build, self.lines, self.poll, self.calls, self.metrics, self.drive = build, lines, poll, calls, metrics, drive

    def configuration(self):
        metrics = f", metrics: {{ listen: {METRICS} }}" if self.metrics else ""
        text = f"""machine: bench
state_directory: {self.lines[0].directory}/state
server: {{ listen: {SERVER}, limits: {{ calls: {self.calls} }}{metrics} }}
buses:
"""
        for index, line in enumerate(self.lines):
            text += f"  line-{index}: {{ modbus_rtu: {{ port: {line.port}, baud: {line.baud} }} }}\n"
        text += "axes:\n"
        poll = f", poll: {{ idle: {self.poll}, moving: {self.poll} }}" if self.poll else ""
        drive = f", drive: {{ {self.drive} }}" if self.drive else ""
        for index, line in enumerate(self.lines):
            for node in range(1, line.nodes + 1):
                text += f"""  axis-{index}-{node}: {{ bus: line-{index}, node: {node}, model: ykd2405pr, unit: mm,
    scale: {{ microstep: 10000 pulses/rev, travel: 5 mm/rev }},
    limits: {{ position: [0, 400], velocity: 90 mm/s }}{poll}{drive} }}
"""
        return text

    @contextlib.contextmanager
    def run(self, *words, **options):
        """The process; it was just started, with these words, too."""
        path = self.lines[0].directory / "bench.yaml"
        path.write_text(self.configuration(), encoding="utf-8")
        with running(f"{self.build}/daemon/axisd", "--config", path, *words, **options) as process:
            yield process

    @contextlib.contextmanager
    def online(self, *words, **options):
        """Its id, when each drive that has power is online."""
        with self.run(*words, **options) as process:
            self.wait_online(process)
            yield process.pid

    def ask(self, *words):
        """What axisctl prints; empty if the call fails."""
        command = [f"{self.build}/api/axisctl/axisctl", "--server", SERVER, "--json", *words]
        asked = subprocess.run(command, capture_output=True, text=True, check=False)
        return json.loads(asked.stdout) if asked.returncode == 0 else {}

    def wait_online(self, process):
        expected = sum(line.nodes - len(line.silent) for line in self.lines)
        end = time.monotonic() + 120
        while time.monotonic() < end and process.poll() is None:
            time.sleep(0.5)
            axes = self.ask("list").get("axes", [])
            if sum(axis.get("link") == "LINK_STATE_ONLINE" for axis in axes) == expected:
                return
        sys.exit(f"{sys.argv[0]}: not every axis came online")
