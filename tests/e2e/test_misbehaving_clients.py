"""Fifty clients at once, half of them misbehaving: the limits of the configuration hold, and the others do not notice."""
import os
import pathlib
import random
import re
import socket
import struct
import threading
import unittest
import unittest.mock

import grpc

from certificates import Certificates
from harness import DONE, CallFailed, Client, Scenario, axis_pb, pb, spinner, system_pb, wait_for

CALLS, STREAMS, CONNECTIONS = 6, 5, 70
FLOODERS, STALLERS, VANISHERS, GARBAGE = 5, 5, 5, 10  # 25 that misbehave
GROUPS, MEMBERS = 5, 5  # 25 that do not: of each group one moves its axis, the others watch and ask
ROUNDS = 5
LOOK_AHEAD = [("grpc.http2.bdp_probe", 0), ("grpc.http2.lookahead_bytes", 1024)]


class Relay:
    """Between clients and the daemon: what it does to a connection the daemon sees as a client that vanished."""

    def __init__(self, port):
        self._port, self._pairs = port, []
        self._listener = socket.create_server(("127.0.0.1", 0))
        self.port = self._listener.getsockname()[1]
        self._open = True
        threading.Thread(target=self._accept, daemon=True).start()

    def _accept(self):
        while self._open:
            try:
                client = self._listener.accept()[0]
            except OSError:
                return
            pair = (client, socket.create_connection(("127.0.0.1", self._port)))
            self._pairs.append(pair)
            for source, sink in (pair, pair[::-1]):
                threading.Thread(target=self._forward, args=(source, sink), daemon=True).start()

    @staticmethod
    def _forward(source, sink):
        try:
            while data := source.recv(65536):
                sink.sendall(data)
        except OSError:
            pass

    def reset(self):
        """Both ends are reset at once: nobody says goodbye."""
        for end in (end for pair in self._pairs for end in pair):
            end.setsockopt(socket.SOL_SOCKET, socket.SO_LINGER, struct.pack("ii", 1, 0))
            end.shutdown(socket.SHUT_RD)  # whoever waits for it lets go of it
            end.close()

    def close(self):
        self._open = False
        self._listener.close()


class Misbehaving(Scenario):
    def setUp(self):
        super().setUp()
        # AddressSanitizer keeps 256 MB of what was freed; a daemon without it ignores the option.
        options = f"{os.environ.get('ASAN_OPTIONS', '')}:quarantine_size_mb=8"
        environment = unittest.mock.patch.dict(os.environ, ASAN_OPTIONS=options)
        environment.start()
        self.addCleanup(environment.stop)
        self.failures, self.vanished = [], []
        axes = {f"axis{i}": spinner(node=i + 1) for i in range(GROUPS + FLOODERS)}
        self.subject = self.machine(axes)
        self.authority = Certificates(self.subject.directory, "authority")
        for name in ("server", "staller", "vanisher", *(f"good{i}" for i in range(GROUPS)),
                     *(f"flooder{i}" for i in range(FLOODERS))):
            self.authority.issue(name)
        tls = (f"{{ certificate: {self.authority.path('crt', 'server')}, key: {self.authority.path('key', 'server')}, "
               f"client_ca: {self.authority.path('crt')} }}")
        self.subject.server = (f"{{ listen: 127.0.0.1:0, tls: {tls}, limits: {{ calls: {CALLS}, streams: {STREAMS}, "
                               f"connections: {CONNECTIONS}, stalled_reader: 500 ms }} }}")
        self.subject.write_config()
        self.subject.start_lines()
        self.daemon = self.subject.start_daemon()
        self.port = int(wait_for(lambda: re.search(r"serves 'e2e' on port (\d+)", self.daemon.log()), "its port")[1])

    def connect(self, name, port=None, options=()):
        credentials = grpc.ssl_channel_credentials(self.authority.read("crt"), self.authority.read("key", name),
                                                   self.authority.read("crt", name))
        client = Client(f"127.0.0.1:{port or self.port}", credentials, options)
        self.addCleanup(client.close)
        return client

    def thread(self, function, *arguments):
        """Runs it beside the test; what it raises fails the test in join()."""
        def guarded():
            try:
                function(*arguments)
            except BaseException as error:
                self.failures.append(f"{function.__name__}{arguments[1:]}: {type(error).__name__}: {error}")
        thread = threading.Thread(target=guarded, daemon=True)
        thread.start()
        return thread

    def join(self, threads):
        for thread in threads:
            thread.join(120)
            self.assertFalse(thread.is_alive(), "hangs")
        self.assertEqual(self.failures, [])

    def descriptors(self):
        return len(os.listdir(f"/proc/{self.daemon.process.pid}/fd"))

    def resident(self):
        """KiB."""
        return int(re.search(r"VmRSS:\s+(\d+)",
                             pathlib.Path(f"/proc/{self.daemon.process.pid}/status").read_text())[1])

    # Those that behave

    def moves(self, client, axis):
        for _ in range(ROUNDS):
            client.to_done("MoveRelative", axis, distance=0.25)

    def watches(self, client, axis, enough):
        """Batches without a gap, and answers, for as long as the others misbehave."""
        last = 0
        for batch in client.axis.WatchAxes(axis_pb.WatchAxesRequest(axes=[axis], period={"nanos": 50_000_000},
                                                                    fields={"paths": ["position", "link"]})):
            if batch.tick != last + 1:
                raise AssertionError(f"tick {batch.tick} after {last}")
            last = batch.tick
            if last % 4 == 0:
                client.state(axis)
                client.call(client.system.Explain, system_pb.ExplainRequest(axis=axis))
            if enough.is_set() and last >= 2 * ROUNDS:
                return

    # Those that do not

    def exhausted(self, error, key):
        failure = CallFailed(error)
        if (failure.code, failure.reason) != (grpc.StatusCode.RESOURCE_EXHAUSTED, "REASON_BUSY"):
            raise AssertionError(f"not refused as too many: {failure}")
        if f"server.limits.{key}" not in failure.detail.remedy:
            raise AssertionError(f"does not name {key}: {failure.detail}")

    def floods(self, client, axis):
        """Calls that wait for one motion, and streams, three times as many as are permitted; then its Stop."""
        client.motion("MoveVelocity", axis, velocity=1.0, request_id="endless")
        request = axis_pb.MoveVelocityRequest(axis=axis, velocity=1.0,
                                              options={"request_id": "endless", "wait_until": DONE})
        calls = [client.axis.MoveVelocity.future(request, timeout=60) for _ in range(3 * CALLS)]
        refused = wait_for(lambda: len(done := [c for c in calls if c.done()]) >= 2 * CALLS and done, "the surplus ends")
        for call in refused:
            self.exhausted(call.exception(), "calls")
        if len(refused) != 2 * CALLS:
            raise AssertionError(f"{len(refused)} refused")
        streams = [client.axis.WatchAxes(axis_pb.WatchAxesRequest(axes=[axis], period={"seconds": 60}), timeout=60)
                   for _ in range(3 * STREAMS)]
        kept = 0
        for stream in streams:
            try:
                next(stream)
                kept += 1
            except grpc.RpcError as error:
                self.exhausted(error, "streams")
        if kept != STREAMS:
            raise AssertionError(f"{kept} streams at once")
        # All its places are taken: its stop gets through all the same, on the same connection, and ends what waits.
        client.to_done("Stop", axis)
        for call in calls:
            if call not in refused and call.result().command.state != pb.COMMAND_STATE_ABORTED:
                raise AssertionError(call.result())
        for stream in streams:
            stream.cancel()

    def stalls(self, client):
        """Asks for more than it reads."""
        stream = client.axis.WatchAxes(axis_pb.WatchAxesRequest(period={"nanos": 10_000_000}), timeout=60)
        wait_for(lambda: self.daemon.log().count("stopped reading its axis stream") == STALLERS, "all are noticed")
        try:
            for _ in stream:
                pass
        except grpc.RpcError as error:
            if error.code() != grpc.StatusCode.CANCELLED:
                raise
            return
        raise AssertionError("the stream went on to its end")

    def vanishes(self, client):
        stream = client.axis.WatchAxes(axis_pb.WatchAxesRequest(period={"nanos": 10_000_000}), timeout=60)
        next(stream)
        self.vanished.append(stream)

    def sends_garbage(self, seed):
        noise = random.Random(seed)
        words = (noise.randbytes(4096), b"GET / HTTP/1.1\r\nHost: axisd\r\n\r\n", b"PRI * HTTP/2.0\r\n\r\nSM\r\n\r\n",
                 b"\x16\x03\x01\x02\x00\x01\x00\x01\xfc\x03\x03" + noise.randbytes(32), b"")[seed % 5]
        with socket.create_connection(("127.0.0.1", self.port), timeout=60) as connection:
            try:
                connection.sendall(words)
                connection.shutdown(socket.SHUT_WR)
                while connection.recv(65536):
                    pass
            except ConnectionError:
                pass

    def test_the_others_do_not_notice(self):
        good = [[self.connect(f"good{i}") for _ in range(MEMBERS)] for i in range(GROUPS)]
        flooders = [self.connect(f"flooder{i}") for i in range(FLOODERS)]
        for i, client in enumerate([*(members[0] for members in good), *flooders]):
            client.wait_online(f"axis{i}")
            client.to_done("Enable", f"axis{i}")
        for client in (client for members in good for client in members):
            client.info()
        descriptors, resident = self.descriptors(), self.resident()

        enough = threading.Event()
        watchers = [self.thread(self.watches, client, f"axis{i}", enough)
                    for i, members in enumerate(good) for client in members[1:]]
        movers = [self.thread(self.moves, members[0], f"axis{i}") for i, members in enumerate(good)]
        relay = Relay(self.port)
        self.addCleanup(relay.close)
        vanishers = [self.connect("vanisher", relay.port) for _ in range(VANISHERS)]
        stallers = [self.connect("staller", options=LOOK_AHEAD) for _ in range(STALLERS)]
        bad = [self.thread(self.floods, client, f"axis{GROUPS + i}") for i, client in enumerate(flooders)]
        bad += [self.thread(self.stalls, client) for client in stallers]
        bad += [self.thread(self.sends_garbage, seed) for seed in range(GARBAGE)]
        self.join([self.thread(self.vanishes, client) for client in vanishers])
        relay.reset()
        self.join(movers)
        self.join(bad)
        enough.set()
        self.join(watchers)
        for i in range(GROUPS):
            self.assertEqual(self.subject.sim.shaft(i + 1).position, round(1000 * 0.25 * ROUNDS), f"axis{i}")

        for client in (*stallers, *vanishers):
            client.close()
        wait_for(lambda: self.descriptors() <= descriptors, "all their connections are gone")
        self.assertLess(self.resident(), resident + 64 * 1024)
        good[0][0].to_done("MoveRelative", "axis0", distance=1.0)

    def test_silent_connections_beyond_the_limit_make_room(self):
        client = self.connect("good0")
        client.info()
        descriptors = self.descriptors()
        many = [socket.create_connection(("127.0.0.1", self.port), timeout=60) for _ in range(3 * CONNECTIONS)]
        wait_for(lambda: "gives way to a new one" in self.daemon.log(), "the first of them make room")
        self.assertEqual(many[0].recv(1), b"")
        # gRPC closes its own descriptor of each in its own time.
        wait_for(lambda: self.descriptors() <= descriptors + CONNECTIONS + 64, "no more are kept than there is room for")
        client.wait_online("axis0")  # whoever is connected does not notice
        other = self.connect("good2")  # nor does whoever comes behind them
        other.info()
        other.close()
        for connection in many:
            connection.close()
        wait_for(lambda: self.descriptors() <= descriptors, "all of them are gone")
        self.connect("good1").info()


if __name__ == "__main__":
    unittest.main()
