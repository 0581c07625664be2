"""Stops while clients misbehave: what an honest operator waits for, and what it costs the daemon. README.md says what
is measured.

    siege_bench.py BUILD [--seconds S] [--after S] [--only ATTACK] [--report-only]
    siege_bench.py BUILD --kill N [--only ATTACK] [--report-only]

Ends with 1 where a row does not meet one of the bounds: STOP_BOUNDS, POLLS_KEPT, MEMORY, MEMORY_LEFT, MOVES_AGAIN, ENDING.
With --kill axisd gets SIGKILL in the middle of each attack, N times, and what the service starts then stops the axes: from
the kill to the last byte of the last stop frame, by the log of the simulated drives. Ends with 1 beyond KILL_BOUND.
"""
import argparse
import bisect
import contextlib
import dataclasses
import multiprocessing
import os
import pathlib
import random
import socket
import statistics
import subprocess
import sys
import tempfile
import time

import grpc

# First: it finds the client's package.
from siege_attacks import ATTACKS, AXES, Door, besiege  # isort: skip
from axisd.v1 import (axis_service_pb2, axis_service_pb2_grpc, stop_service_pb2_grpc, system_service_pb2,
                      system_service_pb2_grpc, types_pb2)
from certificates import Certificates

from figures import cpu_seconds_by_ticks, percentile, table_text
from machine_bench import resident_mib
from rtu_cell import BITS, Line
from rtu_stops import STOP
from stop_all_bench import STOP_BYTES, Hands, entries_of

BAUD = 115200
KILL_BOUND = 0.5  # s
STOP_BOUNDS = 50, 200  # ms: 99 % of the stops, and the longest
POLLS_KEPT = 0.95  # of the readings of the drives where nobody misbehaves
MEMORY, MEMORY_LEFT = 256, 32  # MiB: at any time in an attack, and more than before it a while later
MOVES_AGAIN = 5  # s after the attack an axis moves again
ENDING = 5  # s after SIGTERM
PROCESSES = multiprocessing.get_context("spawn")  # gRPC does not survive a fork


def configuration(directory, port, certificates, line):
    path = pathlib.Path(directory) / "siege.yaml"
    os.mkfifo(path.with_name("endless.eds"))
    tls = ""
    if certificates is not None:
        tls = f", tls: {{ certificate: {certificates.path('crt', 'server')}, key: {certificates.path('key', 'server')}, " \
            f"client_ca: {certificates.path('crt')} }}"
    text = f"machine: siege\nstate_directory: {directory}/state\n" \
        f"server: {{ listen: 'localhost:{port}', reflection: true{tls} }}\nbuses:\n" \
        f"  line: {{ modbus_rtu: {{ port: {line}, baud: {BAUD}, turnaround_max: 200 ms }} }}\naxes:\n"
    for node in range(1, AXES + 1):
        text += f"  axis-{node}: {{ bus: line, node: {node}, model: ykd2405pr, unit: rev, reboot_guard: 950 ms, " \
            "scale: { microstep: 1000 pulses/rev }, limits: { velocity: 10 rev/s, acceleration_time: 150 ms } }\n"
    path.write_text(text, encoding="ascii")
    return path


def two_free_ports():
    """One for the daemon, and the next for its stop lane."""
    while True:
        with socket.socket() as first, socket.socket() as second:
            first.bind(("127.0.0.1", 0))
            port = first.getsockname()[1]
            with contextlib.suppress(OSError):
                second.bind(("127.0.0.1", port + 1))
                return port


@dataclasses.dataclass
class Asked:
    number: int
    begin: float  # of the call, s, monotonic
    took: float | None  # ms until its answer; None: it was not answered within 10 s


def honest(door, until, ask, per_second):
    """Asks `per_second` times a second, each on a connection of its own now and then."""
    asked = []
    channel = None
    while time.monotonic() < until:
        if channel is None or len(asked) % 10 == 0:
            if channel is not None:
                channel.close()
            channel = door.channel()
        begin = time.monotonic()
        try:
            ask(channel, len(asked))
            asked.append(Asked(len(asked), begin, (time.monotonic() - begin) * 1e3))
        except grpc.RpcError:
            asked.append(Asked(len(asked), begin, None))
        time.sleep(1 / per_second)
    channel.close()
    return asked


def node_of(number):
    return number % AXES + 1


def halt(channel, number):
    request = axis_service_pb2.HaltRequest(axis=f"axis-{node_of(number)}")
    stop_service_pb2_grpc.StopServiceStub(channel).Halt(request, timeout=10)


def get_info(channel, _number):
    system_service_pb2_grpc.SystemServiceStub(channel).GetInfo(system_service_pb2.GetInfoRequest(), timeout=10)


def reader(door, until, results):
    results.put(honest(door, until, get_info, 5))


def start_axis(axes, node):
    """Enables it, and lets it turn. False: it is not done."""
    options = {"request_id": f"{time.monotonic_ns()}", "wait_until": types_pb2.WAIT_UNTIL_DONE}
    with contextlib.suppress(grpc.RpcError):
        axes.Enable(axis_service_pb2.EnableRequest(axis=f"axis-{node}", options=options), timeout=20)
        options = {"request_id": f"{time.monotonic_ns()}"}
        axes.MoveVelocity(axis_service_pb2.MoveVelocityRequest(axis=f"axis-{node}", velocity=2.0, options=options),
                          timeout=20)
        return True
    return False


def start_axes(door):
    with door.channel() as channel:
        axes = axis_service_pb2_grpc.AxisServiceStub(channel)
        end = time.monotonic() + 60
        for node in range(1, AXES + 1):
            while not start_axis(axes, node):
                if time.monotonic() > end:
                    sys.exit("siege_bench.py: the axes did not start")
                time.sleep(0.1)


def moves_again(door):
    """s until an axis turns again; infinite: it does not within MOVES_AGAIN."""
    begin = time.monotonic()
    while (passed := time.monotonic() - begin) < MOVES_AGAIN:
        with door.channel() as channel:
            if start_axis(axis_service_pb2_grpc.AxisServiceStub(channel), 1):
                return passed
        time.sleep(0.1)
    return float("inf")


def requests_a_second(wire, begin, end):
    """Of all requests on the line, by the daemon's wire log."""
    return sum(is_request and begin <= at <= end for at, is_request, _ in wire) / (end - begin)


def on_the_wire(asked, wire):
    """ms from each call to the last byte of the stop frame of its axis, by the daemon's wire log; None: there was none."""
    stops = {}
    for at, is_request, text in wire:
        if is_request and text[2:12] == STOP:
            stops.setdefault(int(text[:2], 16), []).append(at)
    took = []
    for each in asked:
        times = stops.get(node_of(each.number), [])
        index = bisect.bisect_left(times, each.begin)
        found = index < len(times) and times[index] - each.begin < 10
        took.append((times[index] - each.begin + STOP_BYTES * BITS / BAUD) * 1e3 if found else None)
    return took


def times(took):
    """Lost, 99 %, longest."""
    answered = [each for each in took if each is not None] or [float("nan")]
    return [str(took.count(None)), f"{percentile(answered, 0.99):.1f}", f"{max(answered):.1f}"]


def within(took):
    answered = [each for each in took if each is not None]
    soon, latest = STOP_BOUNDS
    return len(answered) == len(took) > 0 and percentile(answered, 0.99) <= soon and max(answered) <= latest


@dataclasses.dataclass
class Row:
    """What was seen in one siege."""
    sent: int
    stops: list  # ms, from the call to the answer
    frames: list  # ms, from the call to the stop frame; None: the attackers stop these axes, too
    reads: list  # ms
    polls: float  # a second
    cpu: float  # of axisd, % of a core
    busy: float  # the whole computer, %
    memory: tuple  # MiB: before, most at any time until the end of the siege, a while later
    moves: float  # s until an axis moves again
    ending: float  # s after SIGTERM
    alarms: int = 0

    def beyond(self, quiet):
        """Which bounds are not met; `quiet`: polls where nobody misbehaves, if known."""
        before, under, after = self.memory
        met = {"stops": within(self.frames or self.stops) and None not in self.stops,
               "polls": quiet is None or self.polls >= POLLS_KEPT * quiet,
               "memory": under <= MEMORY and after <= before + MEMORY_LEFT, "motion": self.moves <= MOVES_AGAIN,
               "SIGTERM": self.ending <= ENDING}
        return " ".join(name for name, is_met in met.items() if not is_met) or "-"

    HEAD = ["sent", "stops lost", "99 %, ms", "longest", "frames 99 %", "longest", "reads lost", "99 %", "longest",
            "polls/s", "axisd, % CPU", "computer", "MiB before", "most", "after", "moves, s", "SIGTERM, s", "alarms",
            "beyond", "verdict"]

    def cells(self, quiet):
        beyond = self.beyond(quiet)
        return [str(self.sent), *times(self.stops), *(times(self.frames)[1:] if self.frames else ["", ""]),
                *times(self.reads), f"{self.polls:.0f}", f"{self.cpu:.0f}", f"{self.busy:.0f}",
                *(f"{each:.0f}" for each in self.memory), f"{self.moves:.1f}", f"{self.ending:.1f}", str(self.alarms),
                beyond, "met" if beyond == "-" else "NOT MET"]


def computer():
    """(busy, all) of the time of all processors, in ticks."""
    words = pathlib.Path("/proc/stat").read_text(encoding="ascii").split("\n", 1)[0].split()[1:]
    spent = [int(word) for word in words]
    return sum(spent) - spent[3] - spent[4], sum(spent)


def siege(given, process, name, main, stops, lane, log):
    """From the start of the axes to the end of the daemon."""
    attack = ATTACKS[name]
    start_axes(main)
    before = resident_mib(process.pid)
    cpu, spent, begin = cpu_seconds_by_ticks(process.pid), computer(), time.monotonic()
    until, sent = begin + given.seconds, PROCESSES.Value("q", 0)
    besiegers = [PROCESSES.Process(target=besiege, args=(name, stops if lane else main, until, sent), daemon=True)
                 for _ in range(2 if attack.do else 0)]
    results = PROCESSES.Queue()
    besiegers.append(PROCESSES.Process(target=reader, args=(main, until, results), daemon=True))
    for each in besiegers:
        each.start()
    asked = honest(stops, until, halt, 20)
    end, used, now, under = time.monotonic(), cpu_seconds_by_ticks(process.pid) - cpu, computer(), resident_mib(process.pid, "VmHWM:")
    read = results.get(timeout=60)
    for each in besiegers:
        each.join(15)
        each.kill()
    moves = moves_again(main)
    time.sleep(given.after)
    after = resident_mib(process.pid)
    told = time.monotonic()
    process.terminate()
    process.wait(60)
    ending, wire = time.monotonic() - told, entries_of(log)
    return Row(sent=sent.value, stops=[each.took for each in asked],
               frames=[] if attack.stops else on_the_wire(asked, wire), reads=[each.took for each in read],
               polls=requests_a_second(wire, begin, end), cpu=used / (end - begin) * 100,
               busy=(now[0] - spent[0]) / (now[1] - spent[1]) * 100, memory=(before, under, after), moves=moves,
               ending=ending)


@contextlib.contextmanager
def daemon(given, attack, directory, line):
    """axisd on this line: its process, its configuration, the main address and the stop lane."""
    certificates = None
    if attack.tls:
        certificates = Certificates(directory, "authority")
        for each in ("server", "client", "attacker"):
            certificates.issue(each)
    port = two_free_ports()
    config = configuration(directory, port, certificates, line)
    words = [f"{given.build}/daemon/axisd", "--config", str(config), "--wire-log", f"{directory}/wire"]
    with open(f"{directory}/log", "wb") as err, subprocess.Popen(words, stdout=subprocess.DEVNULL, stderr=err) as process:
        try:
            yield process, config, Door(port, certificates), Door(port + 1, certificates)
        finally:
            process.kill()


def besieged(given, name, lane):
    with tempfile.TemporaryDirectory() as directory:
        with daemon(given, ATTACKS[name], directory, "sim") as (process, _, main, stops):
            row = siege(given, process, name, main, stops, lane, pathlib.Path(directory, "wire"))
        log = pathlib.Path(directory, "log").read_text(encoding="utf-8", errors="replace")
        row.alarms = log.count("no answer for clients")
        return row


def report(given, name, rows, title):
    """Prints the table, and leaves it below the build directory. The exit status."""
    missed = [row[0] for row in rows[1:] if row[-1] != "met"]
    text = f"{title}\n{table_text(rows)}\n{len(rows) - 1} rows, {len(missed)} beyond a bound{': ' if missed else ''}" \
        f"{'; '.join(missed)}\n"
    print(f"\n{text}", end="")
    kept = pathlib.Path(given.build, "bench", f"{name}.txt")
    kept.parent.mkdir(exist_ok=True)
    kept.write_text(text, encoding="utf-8")
    return 1 if missed and not given.report_only else 0


def sieges(given):
    rows = [["attack", *Row.HEAD]]
    quiet = None
    for name, attack in ATTACKS.items():
        if given.only and name not in given.only:
            continue
        for lane in attack.places():
            row = besieged(given, name, lane)
            quiet = quiet if attack.do else max(quiet or 0, row.polls)
            rows.append([f"{name}, at the stop lane" if lane else name, *row.cells(quiet)])
            print("  ".join(rows[-1]), flush=True)
    return report(given, "siege", rows, "Halt at the stop lane and GetInfo at the main address by honest clients while two "
                  f"others misbehave for {given.seconds:g} s; {AXES} axes turn")


def stop_ends(line, killed):
    """Of each drive: when the last byte of its first stop frame since then had gone out, in s after that."""
    ends = {}
    for at, asked, frame in line.frames(killed, time.monotonic()):
        if asked and frame[2:12] == STOP:
            ends.setdefault(int(frame[:2], 16), at + line.wire(STOP_BYTES) - killed)
    return ends


def kill(given, name, chance):
    """Kills axisd in the middle of the attack, and stops the axes as the service does: s until the last of them was told."""
    attack = ATTACKS[name]
    with tempfile.TemporaryDirectory() as directory, Line(given.build, directory, BAUD, AXES).open() as line, \
            daemon(given, attack, directory, line.port) as (process, config, main, stops):
        start_axes(main)
        until, sent = time.monotonic() + 60, PROCESSES.Value("q", 0)
        doors = (main, stops if attack.at_lane else main) if attack.do else ()
        besiegers = [PROCESSES.Process(target=besiege, args=(name, door, until, sent), daemon=True) for door in doors]
        for each in besiegers:
            each.start()
        time.sleep(1 + chance.uniform(0, 2))
        hands = Hands(line.hands)
        still = [node for node in range(1, AXES + 1) if "moving=1" not in hands.do(f"shaft {node}")]
        killed = time.monotonic()
        process.kill()
        process.wait()
        done = subprocess.run([f"{given.build}/daemon/axisd", "--quiesce", str(config)], stdin=subprocess.DEVNULL,
                              capture_output=True, text=True, timeout=60, check=False)
        for each in besiegers:
            each.kill()
            each.join()
        ends = stop_ends(line, killed)
        if still or done.returncode != 0 or len(ends) != AXES:
            sys.exit(f"siege_bench.py: rested before: {still}; told to stop: {sorted(ends)}; axisd --quiesce ended with "
                     f"{done.returncode}:\n{done.stdout}{done.stderr}")
        return max(ends.values())


def kills(given):
    rows = [["attack", "kills", "median, ms", "longest", "bound", "verdict"]]
    chance = random.Random(23)
    for name, attack in ATTACKS.items():
        # Who stops axes stops those which are to turn here.
        if attack.stops or given.only and name not in given.only:
            continue
        took = [kill(given, name, chance) for _ in range(given.kill)]
        rows.append([name, str(len(took)), f"{statistics.median(took) * 1e3:.1f}", f"{max(took) * 1e3:.1f}",
                     f"{KILL_BOUND * 1e3:.0f}", "met" if max(took) <= KILL_BOUND else "NOT MET"])
        print("  ".join(rows[-1]), flush=True)
    return report(given, "siege-kill", rows, f"SIGKILL of axisd while {AXES} axes turn and two clients misbehave, then axisd "
                  "--quiesce: from the kill to the last byte of the last drive's stop frame")


def main():
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("build")
    parser.add_argument("--seconds", type=float, default=60)
    parser.add_argument("--after", type=float, default=60, help="until memory is looked at once more")
    parser.add_argument("--only", choices=ATTACKS, action="append", help="may be given several times")
    parser.add_argument("--kill", type=int, metavar="N", help="so many times in each attack")
    parser.add_argument("--report-only", action="store_true", help="ends with 0 whatever was seen")
    given = parser.parse_args()
    return kills(given) if given.kill else sieges(given)


if __name__ == "__main__":
    sys.exit(main())
