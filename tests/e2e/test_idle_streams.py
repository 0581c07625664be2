"""Clients that open a few streams on each of many connections and leave them: who keeps most loses its connections, and a
client that is busy at the same address keeps its own."""
import contextlib
import itertools
import re
import socket
import struct
import threading
import unittest

import grpc

from harness import Client, Scenario, axis_pb, spinner, wait_for

CONNECTIONS, STREAMS = 185, 18  # together more than the 3072 that may be idle
AT_ONCE = 100
PREFACE = b"PRI * HTTP/2.0\r\n\r\nSM\r\n\r\n"
#: Only a few bytes for each further one: both ends keep the fields.
HEADERS = b"\x83\x86" + b"".join(b"\x40" + bytes([len(name)]) + name + bytes([len(value)]) + value for name, value in (
    (b":path", b"/axisd.v1.SystemService/GetInfo"), (b":authority", b"axisd"), (b"content-type", b"application/grpc"),
    (b"te", b"trailers")))
AGAIN = b"\x83\x86\xc1\xc0\xbf\xbe"


def frame(kind, flags, stream, payload=b""):
    return struct.pack(">I", len(payload))[1:] + bytes([kind, flags]) + struct.pack(">I", stream) + payload


def leaver(port):
    """A connection with that many streams, each without its message."""
    peer = socket.create_connection(("127.0.0.1", port), 10)
    peer.sendall(PREFACE + frame(4, 0, 0) + frame(1, 4, 1, HEADERS) +
                 b"".join(frame(1, 4, 1 + 2 * n, AGAIN) for n in range(1, STREAMS)))
    peer.setblocking(False)
    return peer


def is_cut_off(peer):
    """By a reset."""
    try:
        while peer.recv(65536):
            pass
    except BlockingIOError:
        return False
    except ConnectionResetError:
        return True
    return False


class Busy(threading.Thread):
    """A client that always waits for so many answers, all on one connection; until close()."""

    def __init__(self, client, axis):
        super().__init__(daemon=True)
        self._client, self._axis, self._open = client, axis, True
        self.answers, self.failures = 0, []
        self.start()

    def run(self):
        waiting = [self._ask() for _ in range(AT_ONCE)]
        for number in itertools.count():
            try:
                waiting[number % AT_ONCE].result()
                self.answers += 1
            except grpc.RpcError as error:
                self.failures.append(str(error))
            if not self._open:
                return
            waiting[number % AT_ONCE] = self._ask()

    def _ask(self):
        return self._client.axis.GetAxis.future(axis_pb.GetAxisRequest(axis=self._axis), timeout=60)

    def close(self):
        self._open = False
        self.join(60)


class IdleStreams(Scenario):
    def test_who_keeps_most_is_cut_off_and_nobody_who_is_busy(self):
        machine = self.machine({"axis": spinner(node=1)})
        machine.server = "{ listen: 127.0.0.1:0 }"
        machine.write_config()
        machine.start_lines()
        daemon = machine.start_daemon()
        port = int(wait_for(lambda: re.search(r"serves 'e2e' on port (\d+)", daemon.log()), "its port")[1])
        client = Client(f"127.0.0.1:{port}")
        self.addCleanup(client.close)
        client.wait_online("axis")
        busy = Busy(client, "axis")
        with contextlib.ExitStack() as stack:
            stack.callback(busy.close)
            wait_for(lambda: busy.answers > AT_ONCE, "answers")
            peers = [stack.enter_context(leaver(port)) for _ in range(CONNECTIONS)]
            wait_for(lambda: any(is_cut_off(peer) for peer in peers), "one is cut off")
            before = busy.answers
            wait_for(lambda: busy.answers > before + 10 * AT_ONCE, "more answers")
            client.to_done("Enable", "axis")
            self.assertIn("keeps too many streams open", daemon.log())
        self.assertEqual(busy.failures, [])


if __name__ == "__main__":
    unittest.main()
