"""Stops while clients misbehave: what an honest operator waits for, and what it costs the daemon. README.md says what
is measured.

    siege_bench.py BUILD [--seconds S] [--after S] [--only ATTACK] [--report-only]
    siege_bench.py BUILD --kill N [--only ATTACK] [--report-only]

Ends with 1 where a row does not meet one of the bounds: STOP_BOUNDS, POLLS_KEPT, MEMORY, MEMORY_LEFT, ENDING.
With --kill axisd gets SIGKILL in the middle of each attack, N times, and what the service starts then stops the axes: from
the kill to the last byte of the last stop frame, by the log of the simulated drives. Ends with 1 beyond KILL_BOUND.
"""
import argparse
import contextlib
import gzip
import itertools
import multiprocessing
import os
import pathlib
import random
import socket
import ssl
import statistics
import struct
import subprocess
import sys
import tempfile
import time

import grpc

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[1] / "e2e"))
from client import package  # noqa: E402

package.load()
from axisd.v1 import (axis_service_pb2, axis_service_pb2_grpc, bus_service_pb2, bus_service_pb2_grpc,  # noqa: E402
                      group_service_pb2, group_service_pb2_grpc, lease_service_pb2, lease_service_pb2_grpc,
                      stop_service_pb2_grpc, system_service_pb2, system_service_pb2_grpc, types_pb2)
from certificates import Certificates  # noqa: E402

from figures import percentile, table  # noqa: E402
from machine_bench import resident_mib  # noqa: E402
from rtu_cell import Line  # noqa: E402
from rtu_stops import STOP  # noqa: E402
from stop_all_bench import STOP_BYTES, Hands  # noqa: E402

AXES = 8
BAUD = 115200
KILL_BOUND = 0.5  # s
STOP_BOUNDS = 50, 200  # ms: 99 % of the stops, and the longest
POLLS_KEPT = 0.95  # of the readings of the drives where nobody misbehaves
MEMORY, MEMORY_LEFT = 256, 32  # MiB: at the end of an attack, and more than before it a while later
ENDING = 5  # s after SIGTERM
PROCESSES = multiprocessing.get_context("spawn")  # gRPC does not survive a fork
PREFACE = b"PRI * HTTP/2.0\r\n\r\nSM\r\n\r\n"


def frame(kind, flags, stream, payload=b""):
    return struct.pack(">I", len(payload))[1:] + bytes([kind, flags]) + struct.pack(">I", stream) + payload


def literal(name, value):
    """A header field of HPACK, neither indexed nor compressed."""
    return b"\x00" + bytes([len(name)]) + name + bytes([len(value)]) + value


def request_to(path):
    return b"\x83\x86" + literal(b":path", path) + literal(b":authority", b"axisd") + \
        literal(b"content-type", b"application/grpc") + literal(b"te", b"trailers")


REQUEST = request_to(b"/axisd.v1.SystemService/GetInfo")
WATCH = request_to(b"/grpc.health.v1.Health/Watch")


class Door:
    """One address of the daemon, and how clients come in there."""

    def __init__(self, port, certificates=None):
        self.port, self.certificates = port, certificates

    def connect(self):
        return socket.create_connection(("127.0.0.1", self.port), 2)

    def enter(self):
        """A connection on which HTTP/2 can be spoken."""
        peer = self.connect()
        if self.certificates is None:
            return peer
        context = ssl.create_default_context(cafile=self.certificates.path("crt"))
        context.load_cert_chain(self.certificates.path("crt", "client"), self.certificates.path("key", "client"))
        context.set_alpn_protocols(["h2"])
        return context.wrap_socket(peer, server_hostname="localhost")

    def channel(self):
        options = [("grpc.use_local_subchannel_pool", 1)]
        if self.certificates is None:
            return grpc.insecure_channel(f"127.0.0.1:{self.port}", options)
        read = self.certificates.read
        credentials = grpc.ssl_channel_credentials(read("crt"), read("key", "client"), read("crt", "client"))
        return grpc.secure_channel(f"localhost:{self.port}", credentials, options)


def flood(door, until, opening, make):
    """Sends what `make` gives as fast as it is taken; connects anew whenever it is cut off."""
    while time.monotonic() < until:
        with contextlib.suppress(OSError), door.enter() as peer:
            peer.settimeout(0.2)
            peer.sendall(PREFACE + frame(4, 0, 0) + opening)
            stream = 1
            while time.monotonic() < until and stream < 2**31 - 2000:
                peer.sendall(b"".join(make(stream + 2 * i) for i in range(200)))
                stream += 400
                peer.settimeout(0)
                with contextlib.suppress(BlockingIOError, ssl.SSLWantReadError):
                    while peer.recv(65536):
                        pass
                peer.settimeout(0.2)


def rapid_reset(door, until):
    flood(door, until, b"", lambda stream: frame(1, 4, stream, REQUEST) + frame(3, 0, stream, b"\0\0\0\x08"))


def pings(door, until):
    flood(door, until, b"", lambda stream: frame(6, 0, 0, b"12345678"))


def settings(door, until):
    flood(door, until, b"", lambda stream: frame(4, 0, 0))


def continuation(door, until):
    flood(door, until, frame(1, 0, 1, b"\x83"), lambda stream: frame(9, 0, 1, b"\x83" * 100))


def half_open(door, until):
    flood(door, until, b"", lambda stream: frame(1, 4, stream, REQUEST))


def watchers(door, until):
    """Streams that never end, each with its empty message."""
    flood(door, until, b"", lambda stream: frame(1, 4, stream, WATCH) + frame(0, 1, stream, bytes(5)))


def garbage(door, until):
    chance = random.Random(7)
    while time.monotonic() < until:
        with contextlib.suppress(OSError), door.connect() as peer:
            peer.sendall(chance.randbytes(4096))


def silent(door, until):
    """Connections that say nothing, one after the other, as many as one process may have."""
    crowd = []
    while time.monotonic() < until:
        with contextlib.suppress(OSError):
            crowd.append(door.connect())
        if len(crowd) > 5000:
            for peer in crowd:
                peer.close()
            crowd = []
    for peer in crowd:
        peer.close()


def slow_prefaces(door, until):
    """500 connections that send a byte of the preface each second."""
    crowd, sent = [], 0
    while time.monotonic() < until:
        while len(crowd) < 500 and time.monotonic() < until:
            with contextlib.suppress(OSError):
                crowd.append(door.connect())
        for peer in list(crowd):
            try:
                peer.sendall(PREFACE[sent:sent + 1])
            except OSError:
                peer.close()
                crowd.remove(peer)
        sent = (sent + 1) % len(PREFACE)
        time.sleep(1)
    for peer in crowd:
        peer.close()


def calls(door, until, stub, method, requests):
    with door.channel() as channel:
        ask = getattr(stub(channel), method)
        waiting = []
        while time.monotonic() < until:
            waiting.append(ask.future(next(requests), timeout=10))
            if len(waiting) >= 32:
                with contextlib.suppress(grpc.RpcError, grpc.FutureTimeoutError):
                    waiting.pop(0).result(timeout=max(0.1, until - time.monotonic()))


def compressed(door, until):
    """Messages of 200 KB that unpack to 200 MB."""
    bomb = gzip.compress(bytes(200_000_000))
    headers = REQUEST + literal(b"grpc-encoding", b"gzip")
    body = b"\x01" + struct.pack(">I", len(bomb)) + bomb
    while time.monotonic() < until:
        with contextlib.suppress(OSError), door.enter() as peer:
            peer.settimeout(2)
            peer.sendall(PREFACE + frame(4, 0, 0))
            for stream in range(1, 200, 2):
                peer.sendall(frame(1, 4, stream, headers))
                for at in range(0, len(body), 16384):
                    peer.sendall(frame(0, at + 16384 >= len(body), stream, body[at:at + 16384]))
                    if at % 65536 == 0:
                        peer.recv(65536)


def leases(door, until):
    """Who comes and takes a lease, and comes again."""
    axes = itertools.cycle(f"axis-{n + 1}" for n in range(AXES))
    requests = (lease_service_pb2.AcquireLeaseRequest(axes=[axis], ttl={"seconds": 1}) for axis in axes)
    calls(door, until, lease_service_pb2_grpc.LeaseServiceStub, "AcquireLease", requests)


def unknown_names(door, until):
    request = group_service_pb2.GroupStopRequest(axes=[f"x{n}" for n in range(30_000)])
    calls(door, until, group_service_pb2_grpc.GroupServiceStub, "GroupStop", itertools.repeat(request))


def group_stops(door, until):
    """Stops of all axes by others who are the same client: on one computer, without TLS."""
    stop = group_service_pb2.GroupStopRequest(axes=[f"axis-{n + 1}" for n in range(AXES)])
    calls(door, until, stop_service_pb2_grpc.StopServiceStub, "GroupStop", itertools.repeat(stop))


def configurations(door, until):
    request = system_service_pb2.CheckConfigRequest(yaml="a: [" + "1, " * 60_000 + "1]")
    calls(door, until, system_service_pb2_grpc.SystemServiceStub, "CheckConfig", itertools.repeat(request))


class Attack:
    """What two processes do at the main address, and, if they can there, at the stop lane; over TLS or without."""

    def __init__(self, do, at_lane=True, tls=False, at_main=True):
        self.do, self.at_lane, self.tls, self.at_main = do, at_lane, tls, at_main

    def places(self):
        """False: the main address; True: the stop lane."""
        return [lane for lane in (False, True) if (self.at_lane if lane else self.at_main)]


ATTACKS = {
    "nobody": Attack(None, at_lane=False), "nobody, TLS": Attack(None, at_lane=False, tls=True),
    "silent connections": Attack(silent), "silent connections, TLS": Attack(silent, tls=True),
    "slow prefaces": Attack(slow_prefaces),
    "garbage": Attack(garbage), "garbage, TLS": Attack(garbage, tls=True), "PING flood": Attack(pings),
    "SETTINGS flood": Attack(settings), "CONTINUATION flood": Attack(continuation), "half-open streams": Attack(half_open),
    "rapid reset": Attack(rapid_reset), "rapid reset, TLS": Attack(rapid_reset, tls=True),
    "health watchers": Attack(watchers, at_lane=False), "group stops": Attack(group_stops, at_main=False),
    "compressed messages": Attack(compressed), "leases": Attack(leases, at_lane=False),
    "30,000 unknown names": Attack(unknown_names, at_lane=False),
    "CheckConfig of 180 KB": Attack(configurations, at_lane=False)}


def configuration(directory, port, certificates, line):
    path = pathlib.Path(directory) / "siege.yaml"
    tls = ""
    if certificates is not None:
        tls = f", tls: {{ certificate: {certificates.path('crt', 'server')}, key: {certificates.path('key', 'server')}, " \
            f"client_ca: {certificates.path('crt')} }}"
    text = f"machine: siege\nstate_directory: {directory}/state\nserver: {{ listen: 'localhost:{port}'{tls} }}\nbuses:\n" \
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


def honest(door, until, ask, per_second):
    """Asks `per_second` times a second, each on a connection of its own now and then. ms of each call; None: it was not
    answered within 10 s."""
    took = []
    channel = None
    while time.monotonic() < until:
        if channel is None or len(took) % 10 == 0:
            if channel is not None:
                channel.close()
            channel = door.channel()
        begin = time.monotonic()
        try:
            ask(channel, len(took))
            took.append((time.monotonic() - begin) * 1e3)
        except grpc.RpcError:
            took.append(None)
        time.sleep(1 / per_second)
    channel.close()
    return took


def halt(channel, number):
    request = axis_service_pb2.HaltRequest(axis=f"axis-{number % AXES + 1}")
    stop_service_pb2_grpc.StopServiceStub(channel).Halt(request, timeout=10)


def get_info(channel, _number):
    system_service_pb2_grpc.SystemServiceStub(channel).GetInfo(system_service_pb2.GetInfoRequest(), timeout=10)


def reader(door, until, results):
    results.put(honest(door, until, get_info, 5))


def start_axes(door):
    with door.channel() as channel:
        axes = axis_service_pb2_grpc.AxisServiceStub(channel)
        for node in range(1, AXES + 1):
            for attempt in range(100):
                options = {"request_id": f"{time.monotonic_ns()}", "wait_until": types_pb2.WAIT_UNTIL_DONE}
                with contextlib.suppress(grpc.RpcError):
                    axes.Enable(axis_service_pb2.EnableRequest(axis=f"axis-{node}", options=options), timeout=20)
                    options = {"request_id": f"{time.monotonic_ns()}"}
                    axes.MoveVelocity(axis_service_pb2.MoveVelocityRequest(axis=f"axis-{node}", velocity=2.0,
                                                                           options=options), timeout=20)
                    break
                time.sleep(0.1)
            else:
                sys.exit("siege_bench.py: the axes did not start")


def transactions(door):
    """On the line since the start; None: nobody answers."""
    with door.channel() as channel, contextlib.suppress(grpc.RpcError):
        buses = bus_service_pb2_grpc.BusServiceStub(channel).ListBuses(bus_service_pb2.ListBusesRequest(), timeout=10)
        return time.monotonic(), buses.buses[0].transactions
    return None


def rate(first, last):
    return (last[1] - first[1]) / (last[0] - first[0]) if first and last else float("nan")


def times(took):
    """Lost, 99 %, longest."""
    answered = [each for each in took if each is not None] or [float("nan")]
    return [str(took.count(None)), f"{percentile(answered, 0.99):.1f}", f"{max(answered):.1f}"]


def beyond(took, polls, quiet, before, under, after, ending):
    """Which bounds are not met; `quiet`: polls where nobody misbehaves, if known."""
    answered = [each for each in took if each is not None]
    soon, latest = STOP_BOUNDS
    stopped = len(answered) == len(took) > 0 and percentile(answered, 0.99) <= soon and max(answered) <= latest
    met = {"stops": stopped, "polls": quiet is None or polls >= POLLS_KEPT * quiet,
           "memory": under <= MEMORY and after <= before + MEMORY_LEFT, "SIGTERM": ending <= ENDING}
    return " ".join(name for name, is_met in met.items() if not is_met) or "-"


def siege(given, process, attack, main, stops, lane, quiet):
    """From the start of the axes to the end of the daemon: one row's figures, and the polls alone."""
    start_axes(main)
    before = resident_mib(process.pid)
    begun = transactions(main)
    until = time.monotonic() + given.seconds
    besiegers = [PROCESSES.Process(target=attack.do, args=(stops if lane else main, until), daemon=True)
                 for _ in range(2 if attack.do else 0)]
    results = PROCESSES.Queue()
    besiegers.append(PROCESSES.Process(target=reader, args=(main, until, results), daemon=True))
    for each in besiegers:
        each.start()
    took = honest(stops, until, halt, 20)
    under = resident_mib(process.pid)
    read = results.get(timeout=60)
    for each in besiegers:
        each.join(15)
        each.kill()
    ended = transactions(main)
    time.sleep(given.after)
    after = resident_mib(process.pid)
    begin = time.monotonic()
    process.terminate()
    process.wait(60)
    ending = time.monotonic() - begin
    polls = rate(begun, ended)
    return [*times(took), *times(read), f"{polls:.0f}", f"{before:.0f}", f"{under:.0f}", f"{after:.0f}", f"{ending:.1f}",
            beyond(took, polls, quiet, before, under, after, ending)], polls


@contextlib.contextmanager
def daemon(given, attack, directory, line):
    """axisd on this line: its process, its configuration, the main address and the stop lane."""
    certificates = None
    if attack.tls:
        certificates = Certificates(directory, "authority")
        for each in ("server", "client"):
            certificates.issue(each)
    port = two_free_ports()
    config = configuration(directory, port, certificates, line)
    words = [f"{given.build}/daemon/axisd", "--config", str(config)]
    with open(f"{directory}/log", "wb") as err, subprocess.Popen(words, stdout=subprocess.DEVNULL, stderr=err) as process:
        try:
            yield process, config, Door(port, certificates), Door(port + 1, certificates)
        finally:
            process.kill()


def besiege(given, name, attack, lane, quiet):
    with tempfile.TemporaryDirectory() as directory:
        with daemon(given, attack, directory, "sim") as (process, _, at_main, stops):
            row, polls = siege(given, process, attack, at_main, stops, lane, quiet)
        log = pathlib.Path(directory, "log").read_text(encoding="utf-8", errors="replace")
        return [name, *row, str(log.count("no answer for clients"))], polls


def from_elsewhere(do, door, until):
    """An attack that leaves this computer's processors to the others, as from another one."""
    os.nice(10)
    do(door, until)


def stop_ends(line, killed):
    """Of each drive: when the last byte of its first stop frame since then had gone out, in s after that."""
    ends = {}
    for at, asked, frame in line.frames(killed, time.monotonic()):
        if asked and frame[2:12] == STOP:
            ends.setdefault(int(frame[:2], 16), at + line.wire(STOP_BYTES) - killed)
    return ends


def kill(given, attack, chance):
    """Kills axisd in the middle of the attack, and stops the axes as the service does: s until the last of them was told."""
    with tempfile.TemporaryDirectory() as directory, Line(given.build, directory, BAUD, AXES).open() as line, \
            daemon(given, attack, directory, line.port) as (process, config, at_main, stops):
        start_axes(at_main)
        until = time.monotonic() + 60
        doors = (at_main, stops if attack.at_lane else at_main) if attack.do else ()
        besiegers = [PROCESSES.Process(target=from_elsewhere, args=(attack.do, door, until), daemon=True) for door in doors]
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
    rows = [["attack", "kills", "median, ms", "longest", "bound", "met"]]
    within, chance = True, random.Random(23)
    for name, attack in ATTACKS.items():
        # Leases that end halt the axes, which are to turn here.
        if attack.do in (leases, group_stops) or given.only and name not in given.only:
            continue
        took = [kill(given, attack, chance) for _ in range(given.kill)]
        met = max(took) <= KILL_BOUND
        within = within and met
        rows.append([name, str(len(took)), f"{statistics.median(took) * 1e3:.1f}", f"{max(took) * 1e3:.1f}",
                     f"{KILL_BOUND * 1e3:.0f}", "yes" if met else "NO"])
        print("  ".join(rows[-1]), flush=True)
    print(f"\nSIGKILL of axisd while {AXES} axes turn and two clients misbehave, then axisd --quiesce: from the kill to the "
          "last byte of the last drive's stop frame")
    table(rows)
    return 0 if within or given.report_only else 1


def main():
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("build")
    parser.add_argument("--seconds", type=float, default=60)
    parser.add_argument("--after", type=float, default=60, help="until memory is looked at once more")
    parser.add_argument("--only", choices=ATTACKS, action="append", help="may be given several times")
    parser.add_argument("--kill", type=int, metavar="N", help="so many times in each attack")
    parser.add_argument("--report-only", action="store_true", help="ends with 0 whatever was seen")
    given = parser.parse_args()
    if given.kill:
        return kills(given)
    rows = [["attack", "stops lost", "99 %, ms", "longest", "reads lost", "99 %", "longest", "polls/s", "MiB before",
             "under siege", "after", "SIGTERM, s", "beyond", "alarms"]]
    quiet = None
    for name, attack in ATTACKS.items():
        if given.only and name not in given.only:
            continue
        for lane in attack.places():
            row, polls = besiege(given, f"{name}, at the stop lane" if lane else name, attack, lane, quiet)
            quiet = quiet if attack.do else max(quiet or 0, polls)
            rows.append(row)
            print("  ".join(row), flush=True)
    print(f"\nHalt at the stop lane and GetInfo at the main address by honest clients while two others misbehave for "
          f"{given.seconds:g} s; {AXES} axes turn")
    table(rows)
    met = all(row[rows[0].index("beyond")] == "-" for row in rows[1:])
    return 0 if met or given.report_only else 1


if __name__ == "__main__":
    sys.exit(main())
