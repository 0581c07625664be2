"""Stops while clients misbehave: what an honest operator waits for, and what it costs the daemon. README.md says what
is measured.

    siege_bench.py BUILD [--seconds S]
"""
import argparse
import contextlib
import multiprocessing
import pathlib
import random
import socket
import struct
import subprocess
import sys
import tempfile
import time

import grpc

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[1] / "e2e"))
from client import package  # noqa: E402

package.load()
from axisd.v1 import (axis_service_pb2, axis_service_pb2_grpc, group_service_pb2, group_service_pb2_grpc,  # noqa: E402
                      stop_service_pb2_grpc, system_service_pb2, system_service_pb2_grpc, types_pb2)

from figures import percentile, table  # noqa: E402
from machine_bench import resident_mib  # noqa: E402

AXES = 8
PREFACE = b"PRI * HTTP/2.0\r\n\r\nSM\r\n\r\n"


def frame(kind, flags, stream, payload=b""):
    return struct.pack(">I", len(payload))[1:] + bytes([kind, flags]) + struct.pack(">I", stream) + payload


def literal(name, value):
    """A header field of HPACK, neither indexed nor compressed."""
    return b"\x00" + bytes([len(name)]) + name + bytes([len(value)]) + value


REQUEST = b"\x83\x86" + literal(b":path", b"/axisd.v1.SystemService/GetInfo") + literal(b":authority", b"axisd") + \
    literal(b"content-type", b"application/grpc") + literal(b"te", b"trailers")


def connect(port):
    return socket.create_connection(("127.0.0.1", port), 2)


def flood(port, until, opening, make):
    """Sends what `make` gives as fast as it is taken; connects anew whenever it is cut off."""
    while time.monotonic() < until:
        with contextlib.suppress(OSError), connect(port) as peer:
            peer.settimeout(0.2)
            peer.sendall(PREFACE + frame(4, 0, 0) + opening)
            stream = 1
            while time.monotonic() < until and stream < 2**31 - 2000:
                peer.sendall(b"".join(make(stream + 2 * i) for i in range(200)))
                stream += 400
                with contextlib.suppress(BlockingIOError):
                    while peer.recv(65536, socket.MSG_DONTWAIT):
                        pass


def rapid_reset(port, until):
    flood(port, until, b"", lambda stream: frame(1, 4, stream, REQUEST) + frame(3, 0, stream, b"\0\0\0\x08"))


def pings(port, until):
    flood(port, until, b"", lambda stream: frame(6, 0, 0, b"12345678"))


def settings(port, until):
    flood(port, until, b"", lambda stream: frame(4, 0, 0))


def continuation(port, until):
    flood(port, until, frame(1, 0, 1, b"\x83"), lambda stream: frame(9, 0, 1, b"\x83" * 100))


def half_open(port, until):
    flood(port, until, b"", lambda stream: frame(1, 4, stream, REQUEST))


def garbage(port, until):
    chance = random.Random(7)
    while time.monotonic() < until:
        with contextlib.suppress(OSError), connect(port) as peer:
            peer.sendall(chance.randbytes(4096))


def silent(port, until):
    """Up to 2000 connections at a time that say nothing."""
    crowd = []
    while time.monotonic() < until:
        with contextlib.suppress(OSError):
            crowd.append(connect(port))
        if len(crowd) > 2000:
            for peer in crowd:
                peer.close()
            crowd = []
    for peer in crowd:
        peer.close()


def calls(port, until, stub, method, request):
    with grpc.insecure_channel(f"127.0.0.1:{port}", [("grpc.use_local_subchannel_pool", 1)]) as channel:
        ask = getattr(stub(channel), method)
        waiting = []
        while time.monotonic() < until:
            waiting.append(ask.future(request, timeout=10))
            if len(waiting) >= 32:
                with contextlib.suppress(grpc.RpcError, grpc.FutureTimeoutError):
                    waiting.pop(0).result(timeout=max(0.1, until - time.monotonic()))


def unknown_names(port, until):
    request = group_service_pb2.GroupStopRequest(axes=[f"x{n}" for n in range(30_000)])
    calls(port, until, group_service_pb2_grpc.GroupServiceStub, "GroupStop", request)


def configurations(port, until):
    request = system_service_pb2.CheckConfigRequest(yaml="a: [" + "1, " * 60_000 + "1]")
    calls(port, until, system_service_pb2_grpc.SystemServiceStub, "CheckConfig", request)


ATTACKS = {"nobody": [], "silent connections": [silent], "garbage": [garbage], "PING flood": [pings],
           "SETTINGS flood": [settings], "CONTINUATION flood": [continuation], "half-open streams": [half_open],
           "rapid reset": [rapid_reset], "30,000 unknown names": [unknown_names], "CheckConfig of 180 KB": [configurations]}


def configuration(directory, port):
    path = pathlib.Path(directory) / "siege.yaml"
    text = f"machine: siege\nstate_directory: {directory}/state\nserver: {{ listen: 'localhost:{port}' }}\nbuses:\n" \
        "  line: { modbus_rtu: { port: sim, baud: 115200, turnaround_max: 200 ms } }\naxes:\n"
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


def honest(port, until):
    """Stops one axis after the other, 20 times a second, each on a connection of its own now and then. ms of each call;
    None: it was not answered within 10 s."""
    took = []
    channel = None
    while time.monotonic() < until:
        if channel is None or len(took) % 10 == 0:
            if channel is not None:
                channel.close()
            channel = grpc.insecure_channel(f"127.0.0.1:{port}", [("grpc.use_local_subchannel_pool", 1)])
            stub = stop_service_pb2_grpc.StopServiceStub(channel)
        begin = time.monotonic()
        try:
            stub.Halt(axis_service_pb2.HaltRequest(axis=f"axis-{len(took) % AXES + 1}"), timeout=10)
            took.append((time.monotonic() - begin) * 1e3)
        except grpc.RpcError:
            took.append(None)
        time.sleep(0.05)
    channel.close()
    return took


def start_axes(port):
    with grpc.insecure_channel(f"127.0.0.1:{port}", [("grpc.use_local_subchannel_pool", 1)]) as channel:
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


def besiege(build, name, attacks, lane, seconds):
    with tempfile.TemporaryDirectory() as directory:
        port = two_free_ports()
        with subprocess.Popen([f"{build}/daemon/axisd", "--config", str(configuration(directory, port))],
                              stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL) as process:
            start_axes(port)
            before = resident_mib(process.pid)
            until = time.monotonic() + seconds
            besiegers = [multiprocessing.Process(target=attack, args=(port + lane, until), daemon=True)
                         for attack in attacks for _ in range(2)]
            for each in besiegers:
                each.start()
            took = honest(port + 1, until)
            after = resident_mib(process.pid)
            for each in besiegers:
                each.join(15)
                each.kill()
            begin = time.monotonic()
            process.terminate()
            process.wait(60)
            ended = time.monotonic() - begin
        answered = [each for each in took if each is not None]
        return [name, str(len(took)), str(len(took) - len(answered)), f"{percentile(answered, 0.5):.1f}",
                f"{percentile(answered, 0.99):.1f}", f"{max(answered):.1f}", f"{before:.0f}", f"{after:.0f}",
                f"{ended:.1f}"]


def main():
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("build")
    parser.add_argument("--seconds", type=float, default=20)
    parser.add_argument("--only", choices=ATTACKS, action="append", help="may be given several times")
    given = parser.parse_args()
    rows = [["attack", "stops", "lost", "median, ms", "99 %, ms", "longest, ms", "MiB before", "under siege",
             "SIGTERM, s"]]
    for name, attacks in ATTACKS.items():
        if given.only and name not in given.only:
            continue
        for lane in (0, 1) if attacks and attacks[0] not in (unknown_names, configurations) else (0,):
            at = f"{name}, at the stop lane" if lane else name
            rows.append(besiege(given.build, at, attacks, lane, given.seconds))
    print(f"\nHalt at the stop lane by an honest client while two others misbehave for {given.seconds:g} s; {AXES} axes turn")
    table(rows)


if __name__ == "__main__":
    main()
