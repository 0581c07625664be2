"""SYNC on a real CAN interface: axisd with 16 axes, a bare loop in C, and one in python3-can, in turns, to the same
simulated nodes, which answer all three alike. Runs in the guest (tests/guest/run.sh); README.md says what is measured.

    can_bench.py BUILD [--rounds N] [--seconds S] [--nodes N]
"""
import argparse
import contextlib
import json
import math
import os
import pathlib
import select
import socket
import statistics
import struct
import subprocess
import sys
import tempfile
import time

from figures import lateness, running, spread, table

INTERFACE = "vcan0"
SERVER = "127.0.0.1:7443"
SYNC = 0x080
TPDOS = 2  # that a YSS-C sends for each SYNC
PERIOD = 10  # ms
# The guest's kernel charges CPU time by its tick, of 10 ms. A cycle of that length would meet the tick at the same
# moment each time: always charged, or never. One of 11 ms meets it at all moments alike.
PERIOD_OF_CPU = 11
SETTLE = 1.0  # s; then what asked whether axisd is ready has ended
SO_TIMESTAMPNS, SO_RCVBUFFORCE, CAN_RAW_FILTER = 35, 33, 1


class Programs:
    """What takes turns. Each is a context in which SYNC is sent; the value is the process's id."""

    def __init__(self, build, nodes, directory):
        self.build, self.nodes, self.directory = build, nodes, directory

    @contextlib.contextmanager
    def axisd(self, period):
        path = pathlib.Path(self.directory) / "bench.yaml"
        path.write_text(self.configuration(period), encoding="utf-8")
        with running(f"{self.build}/daemon/axisd", "--config", path) as process:
            self.wait_online()
            yield process.pid

    @contextlib.contextmanager
    def bare_loop(self, period):
        with running(f"{self.build}/tests/bench_bare_loop", INTERFACE, str(period)) as process:
            yield process.pid

    @contextlib.contextmanager
    def python_can(self, period):
        loop = pathlib.Path(__file__).with_name("python_can_loop.py")
        with running(sys.executable, "-B", loop, INTERFACE, str(period)) as process:
            yield process.pid

    def configuration(self, period):
        return f"""machine: bench
state_directory: {self.directory}/state
server: {{ listen: {SERVER} }}
buses:
  can0:
    canopen: {{ interface: {INTERFACE}, bitrate: 1000000, sync_period: {period}ms }}
axes:
""" + "".join(f"""  axis-{node}: {{ bus: can0, node: {node}, model: yss-c, unit: mm,
    scale: {{ microstep: 1000 pulses/rev, travel: 10 mm/rev }},
    limits: {{ position: [0, 400], velocity: 100 mm/s }} }}
""" for node in range(1, self.nodes + 1))

    def wait_online(self):
        command = [f"{self.build}/api/axisctl/axisctl", "--server", SERVER, "--json", "list"]
        end = time.monotonic() + 60
        while time.monotonic() < end:
            time.sleep(0.5)
            listed = subprocess.run(command, capture_output=True, text=True, check=False)
            axes = json.loads(listed.stdout).get("axes", []) if listed.returncode == 0 else []
            if len(axes) == self.nodes and all(axis.get("link") == "LINK_STATE_ONLINE" for axis in axes):
                return
        sys.exit("can_bench.py: not every axis came online")


def cpu_seconds(pid):
    fields = pathlib.Path(f"/proc/{pid}/stat").read_text(encoding="ascii").rsplit(")", 1)[1].split()
    return (int(fields[11]) + int(fields[12])) / os.sysconf("SC_CLK_TCK")


def frames_so_far():
    return int(pathlib.Path(f"/sys/class/net/{INTERFACE}/statistics/tx_packets").read_text(encoding="ascii"))


class Observer:
    """When each SYNC was on the bus, by the kernel's time stamps; read at the end only, so that it disturbs nobody."""

    def __init__(self):
        self._socket = socket.socket(socket.PF_CAN, socket.SOCK_RAW, socket.CAN_RAW)
        self._socket.setsockopt(socket.SOL_SOCKET, SO_RCVBUFFORCE, 1 << 24)
        self._socket.setsockopt(socket.SOL_SOCKET, SO_TIMESTAMPNS, 1)
        self._socket.setsockopt(socket.SOL_CAN_RAW, CAN_RAW_FILTER, struct.pack("=II", SYNC, socket.CAN_SFF_MASK))
        self._socket.bind((INTERFACE,))

    def wait(self):
        """For a SYNC."""
        if not select.select([self._socket], [], [], 60)[0]:
            sys.exit("can_bench.py: no SYNC is sent")

    def stamps(self):
        """Seconds. Ends the observation."""
        found = []
        with contextlib.closing(self._socket), contextlib.suppress(BlockingIOError):
            while True:
                _, ancillary, _, _ = self._socket.recvmsg(16, 64, socket.MSG_DONTWAIT)
                found += [struct.unpack("=qq", data) for _, kind, data in ancillary if kind == SO_TIMESTAMPNS]
        return [whole + part / 1e9 for whole, part in found]


def measure(program, nodes, period, seconds):
    with program(period) as pid:
        Observer().wait()
        time.sleep(SETTLE)
        observer, frames, cpu = Observer(), frames_so_far(), cpu_seconds(pid)
        time.sleep(seconds)
        cpu, frames, stamps = cpu_seconds(pid) - cpu, frames_so_far() - frames, observer.stamps()
    if len(stamps) < 2 or frames < len(stamps) * TPDOS * nodes / 2:
        sys.exit(f"can_bench.py: {frames} frames with {len(stamps)} SYNC: the nodes do not answer")
    late = [each * 1e6 for each in lateness(stamps, period / 1000)]
    return {"sent": len(stamps), "missed": round((stamps[-1] - stamps[0]) * 1000 / period) + 1 - len(stamps),
            "frames": frames / len(stamps), "late": statistics.median(late), "late 99%": late[len(late) * 99 // 100],
            "latest": late[-1], "cpu": cpu / frames * 1e6}


def report(rounds, wire, cpu):
    print(f"\nSYNC every {PERIOD} ms, min / median / max of {rounds} rounds; late in us, behind the schedule")
    table([["", "sent", "missed", "frames per SYNC", "late, median", "late, 99%", "latest"]] + [
        [name, str(sum(each["sent"] for each in found)), spread([each["missed"] for each in found]),
         spread([each["frames"] for each in found], 1), spread([each["late"] for each in found]),
         spread([each["late 99%"] for each in found]), spread([each["latest"] for each in found])]
        for name, found in wire.items()])
    print(f"\nCPU time per frame on the bus in us, SYNC every {PERIOD_OF_CPU} ms; ratio to the bare loop's of the same "
          "round")
    bare = [each["cpu"] for each in cpu["bare loop"]]
    table([["", "CPU per frame", "ratio"]] + [
        [name, spread([each["cpu"] for each in found], 1),
         # A short round may take less than the resolution of the guest's accounting.
         spread([each["cpu"] / one for each, one in zip(found, bare) if one > 0] or [math.nan], 2)]
        for name, found in cpu.items()])


def call_time():
    """us of one system call, which is what most of the work is made of here."""
    calls, begun = 20_000, time.perf_counter()
    for _ in range(calls):
        os.getppid()
    return (time.perf_counter() - begun) / calls * 1e6


def main():
    parser = argparse.ArgumentParser()
    parser.add_argument("build")
    parser.add_argument("--rounds", type=int, default=4)
    parser.add_argument("--seconds", type=float, default=8, help="of each measurement")
    parser.add_argument("--nodes", type=int, default=16, help="1 to 127")
    given = parser.parse_args()
    build = os.path.abspath(given.build)
    print(f"{given.nodes} nodes on {INTERFACE}; the clock's resolution is "
          f"{time.get_clock_info('monotonic').resolution * 1e9:.0f} ns, a system call takes {call_time():.1f} us")
    drives = [word for node in range(1, given.nodes + 1) for word in ("--drive", f"node={node},model=yss-c")]
    with tempfile.TemporaryDirectory() as directory, \
            running(f"{build}/daemon/axisd-sim", "--can", INTERFACE, *drives, stdout=subprocess.PIPE,
                    text=True) as simulator:
        if not simulator.stdout.readline().startswith("ready"):
            sys.exit("can_bench.py: axisd-sim did not start")
        programs = Programs(build, given.nodes, directory)
        # axisd first: it sets the nodes up, and they stay so.
        turns = {"axisd": programs.axisd, "bare loop": programs.bare_loop, "python3-can": programs.python_can}
        wire, cpu = ({name: [] for name in turns} for _ in range(2))
        for _ in range(given.rounds):
            for found, period in ((wire, PERIOD), (cpu, PERIOD_OF_CPU)):
                for name, program in turns.items():
                    found[name].append(measure(program, given.nodes, period, given.seconds))
        report(given.rounds, wire, cpu)


if __name__ == "__main__":
    main()
