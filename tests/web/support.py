"""axisd-web in front of a real daemon with simulated drives, and what a browser would send to it."""
import base64
import http.client
import itertools
import json
import os
import pathlib
import re
import socket
import ssl
import struct
import subprocess
import threading
import time
import uuid

from harness import LIMIT, OWN_NAME, Program, Scenario, axis_pb, command_pb, pb, spinner, wait_for
from harness.client import error_pb
from harness.notify import NotifySocket

AXISD_WEB = os.environ["AXISD_WEB"]
GRPC_WEB = "application/grpc-web+proto"
_numbers = itertools.count()
ANSWER, LATE, ECHO, REFUSED = 1, 2, 3, 4
#: A person's role, and what the daemon has to know of the gateway, which comes as this user of the computer.
DELEGATE = f"access: {{ roles: {{ {OWN_NAME}: maintainer }}, delegates: {{ {OWN_NAME}: operator }} }}"


class Web:
    """A running gateway. `keys` are lines of its configuration, `axisd` is that which says whom it is for."""

    def __init__(self, machine, keys="", prefix=(), tls=None, axisd=None):
        self.machine, self.tls = machine, tls
        self.page = pathlib.Path(machine.path("page"))
        (self.page / "assets").mkdir(parents=True, exist_ok=True)
        (self.page / "index.html").write_text("<!doctype html><title>axisd</title>")
        (self.page / "assets" / "page-1A2B.js").write_text("export {};")
        (self.page / "assets" / "page-1A2B.js.gz").write_bytes(b"compressed")
        self.users = machine.path("users")
        self.config = machine.path("web.yaml")
        pathlib.Path(self.config).write_text(
            f"listen: localhost:0\n{axisd or self.whom(machine)}\nfiles: {self.page}\n"
            f"users: {self.users}\n{keys}")
        os.close(os.open(self.users, os.O_CREAT | os.O_WRONLY, 0o600))  # nobody yet
        self.prefix, self.notify, self.program, self.port = prefix, None, None, 0

    @staticmethod
    def whom(machine):
        return f"axisd: {{ server: \"unix:{machine.socket}\" }}"

    def user(self, *words, password=None):
        done = subprocess.run([AXISD_WEB, "--config", self.config, "user", *words], capture_output=True, text=True,
                              input=None if password is None else password + "\n", check=False, timeout=LIMIT)
        assert done.returncode == 0, done
        return done.stdout

    def start(self, port=0):
        text = pathlib.Path(self.config).read_text()
        pathlib.Path(self.config).write_text(re.sub(r"(?m)^listen: .*$", f"listen: localhost:{port}", text))
        number = next(_numbers)
        directory = pathlib.Path(self.machine.path(f"notify-{number}"))
        directory.mkdir()
        self.notify = NotifySocket(str(directory))
        self.program = Program(f"axisd-web-{number}", [*self.prefix, AXISD_WEB, "--config", self.config],
                               self.machine.directory, {"NOTIFY_SOCKET": self.notify.path})
        self.notify.wait_for("READY=1", self.program)
        self.port = int(wait_for(lambda: re.search(r"; port (\d+)", self.program.log()), "it tells its port")[1])
        wait_for(lambda: self.request("GET", "/healthz")[0] == 200, "axisd-web has reached axisd")
        return self

    def stop(self):
        if self.program is not None and self.program.running():
            self.program.terminate()
        self.forget()

    def kill(self):
        self.program.kill()
        self.forget()

    def forget(self):
        if self.notify is not None:
            self.notify.close()
            self.program.check_memory()
            self.notify = None

    @property
    def origin(self):
        return f"{'https' if self.tls else 'http'}://localhost:{self.port}"

    def connect(self):
        if self.tls:
            return http.client.HTTPSConnection("localhost", self.port, timeout=LIMIT, context=self.tls)
        return http.client.HTTPConnection("localhost", self.port, timeout=LIMIT)

    def raw(self):
        """A socket, without TLS."""
        return socket.create_connection(("localhost", self.port), timeout=LIMIT)

    def request(self, method, path, body=None, headers=None, connection=None):
        """Status, headers, body."""
        own = connection or self.connect()
        own.request(method, path, body, headers or {})
        answer = own.getresponse()
        content = answer.read()
        if connection is None:
            own.close()
        return answer.status, answer.headers, content


class Page:
    """A browser's page: its cookie, its calls."""

    def __init__(self, web):
        self.web, self.cookie = web, None

    def headers(self, **changed):
        named = {"Origin": self.web.origin, "Content-Type": GRPC_WEB}
        if self.cookie:
            named["Cookie"] = self.cookie
        return {key: value for key, value in (named | {k.replace("_", "-"): v for k, v in changed.items()}).items()
                if value is not None}

    def log_in(self, name, password):
        """Status, answer."""
        status, headers, body = self.web.request(
            "POST", "/session", json.dumps({"name": name, "password": password}),
            {"Origin": self.web.origin, "Content-Type": "application/json"})
        if status == 204:
            self.cookie = headers["Set-Cookie"].split(";")[0]
        return status, headers if status == 204 else json.loads(body)

    def session(self):
        status, _, body = self.web.request("GET", "/session", headers=self.headers(Origin=None))
        return status, json.loads(body)

    def log_out(self):
        return self.web.request("DELETE", "/session", headers=self.headers())[0]

    def post(self, method, request, **headers):
        """HTTP status, headers, body."""
        return self.web.request("POST", f"/axisd.v1.{method}", frame(request.SerializeToString()),
                                self.headers(**headers))

    def call(self, method, request, response_type, **headers):
        """The response; a tuple of status, message and ErrorDetail where it failed."""
        status, head, body = self.post(method, request, **headers)
        assert (status, head["Content-Type"]) == (200, GRPC_WEB), (status, body)
        messages, trailers = frames(body)
        if trailers["grpc-status"] != "0":
            return int(trailers["grpc-status"]), trailers.get("grpc-message"), details(trailers)
        return response_type.FromString(messages[0])

    def stream(self, method, request, response_type):
        """An open connection, and a function for the next message; None: it has ended."""
        connection = self.web.connect()
        connection.request("POST", f"/axisd.v1.{method}", frame(request.SerializeToString()), self.headers())
        answer = connection.getresponse()
        assert answer.status == 200, answer.read()

        def following():
            head = answer.read(5)
            if len(head) < 5:
                return None
            content = answer.read(struct.unpack(">I", head[1:])[0])
            return None if head[0] & 0x80 else response_type.FromString(content)
        return connection, following

    def lane(self, origin=None, protocol="axisd-lane-1", machine=None):
        return Lane(self, origin, protocol, machine)


def frame(message):
    return struct.pack(">BI", 0, len(message)) + message


def frames(body):
    """The messages, and the trailers as a dictionary."""
    messages, trailers = [], None
    while body:
        flag, size = struct.unpack(">BI", body[:5])
        content, body = body[5:5 + size], body[5 + size:]
        if flag & 0x80:
            trailers = dict(line.split(": ", 1) for line in content.decode().split("\r\n") if line)
        else:
            messages.append(content)
    assert trailers is not None, messages
    return messages, trailers


def details(trailers):
    """The ErrorDetail of trailers; None: there is none."""
    encoded = trailers.get("grpc-status-details-bin")
    if encoded is None:
        return None
    packed = error_pb.StatusDetails.FromString(base64.b64decode(encoded)).details
    return error_pb.ErrorDetail.FromString(packed[0].value)


class LaneRefused(Exception):
    """The HTTP status in place of a WebSocket."""


class Lane:
    """A page's WebSocket, by hand."""

    def __init__(self, page, origin=None, protocol="axisd-lane-1", machine=None):
        self.page, self._ids, self._lock, self._sending = page, 0, threading.Lock(), threading.Lock()
        web = page.web
        self.socket = web.raw()
        if web.tls:
            self.socket = web.tls.wrap_socket(self.socket, server_hostname="localhost")
        lines = [f"GET /lane{f'?machine={machine}' if machine else ''} HTTP/1.1", f"Host: localhost:{web.port}", "Upgrade: websocket", "Connection: Upgrade",
                 "Sec-WebSocket-Key: " + base64.b64encode(os.urandom(16)).decode(), "Sec-WebSocket-Version: 13",
                 f"Sec-WebSocket-Protocol: {protocol}", f"Origin: {origin or web.origin}"]
        if page.cookie:
            lines.append(f"Cookie: {page.cookie}")
        self.socket.sendall(("\r\n".join(lines) + "\r\n\r\n").encode())
        self._input = self.socket.makefile("rb")
        status = int(self._input.readline().split()[1])
        headers = {}
        while (line := self._input.readline().strip()):
            key, value = line.decode().split(": ", 1)
            headers[key.lower()] = value
        if status != 101:
            self.close()
            raise LaneRefused(status)
        assert headers["sec-websocket-protocol"] == protocol

    def send_frame(self, payload, opcode=2, final=True):
        mask = os.urandom(4)
        head = bytes([(0x80 if final else 0) | opcode])
        if len(payload) < 126:
            head += bytes([0x80 | len(payload)])
        elif len(payload) < 65536:
            head += bytes([0x80 | 126]) + struct.pack(">H", len(payload))
        else:
            head += bytes([0x80 | 127]) + struct.pack(">Q", len(payload))
        with self._sending:  # a finger is a thread
            self.socket.sendall(head + mask + bytes(byte ^ mask[i % 4] for i, byte in enumerate(payload)))

    def message(self, method, request=b"", late=0.0):
        """Bytes of a message, and its id."""
        with self._lock:
            self._ids += 1
            number = self._ids
        sent = int((time.monotonic() - late) * 1000) & 0xFFFFFFFF
        content = request if isinstance(request, bytes) else request.SerializeToString()
        return (struct.pack(">BII", 1, number, sent) + bytes([len(method)]) + method.encode() + content), number

    def send(self, method, request=b"", late=0.0):
        bytes_, number = self.message(f"axisd.v1.{method}" if method else "", request, late)
        self.send_frame(bytes_)
        return number

    def receive(self):
        """(kind, id, status, message, response); None: it has ended."""
        try:
            while True:
                head = self._input.read(2)
                if len(head) < 2:
                    return None
                size = head[1] & 0x7F
                if size == 126:
                    size = struct.unpack(">H", self._input.read(2))[0]
                elif size == 127:
                    size = struct.unpack(">Q", self._input.read(8))[0]
                payload = self._input.read(size)
                opcode = head[0] & 0x0F
                if opcode == 8:
                    return None
                if opcode == 9:
                    self.send_frame(payload, 10)
                if opcode == 2:
                    return self._parsed(payload)
        except (ConnectionError, ssl.SSLError):
            return None

    @staticmethod
    def _parsed(payload):
        kind, number, status, size = struct.unpack(">BIBH", payload[:8])
        text, rest = payload[8:8 + size].decode(), payload[8 + size:]
        size = struct.unpack(">I", rest[:4])[0]
        return kind, number, status, text, rest[4 + size:]

    def ask(self, method, request=b"", late=0.0):
        """Sends, and returns (kind, status, message, response) of the answer to it; None: the lane has ended."""
        number = self.send(method, request, late)
        while (answer := self.receive()) is not None:
            if answer[1] == number:
                return (answer[0], *answer[2:])
        return None

    def measure(self):
        """As a page does once it is open: without that no press is taken."""
        kind, _, _, number = self.ask("")
        assert (kind, len(number)) == (ECHO, 8)
        assert self.ask("", number)[0] == ECHO
        return self

    def ask_to_jog(self):
        """The answer to a press that came in time, as on a computer that is busy not each does."""
        while (answer := self.ask("AxisService/Jog", jog_request(str(uuid.uuid4()))))[0] == LATE:
            pass
        return answer

    def until_end(self):
        """What still comes."""
        rest = []
        while (answer := self.receive()) is not None:
            rest.append(answer)
        return rest

    def jog(self, press, hold=1.0, late=0.0, velocity=2.0, axis="spinner"):
        return self.send("AxisService/Jog", jog_request(press, hold, velocity, axis), late)

    def close(self):
        for part in (getattr(self, "_input", None), self.socket):
            if part is not None:
                part.close()


def jog_request(press, hold=1.0, velocity=2.0, axis="spinner"):
    return axis_pb.JogRequest(axis=axis, velocity=velocity,
                              hold={"seconds": int(hold), "nanos": round(hold % 1 * 1e9)},
                              options={"request_id": press})


def move_request(valid=2.0, velocity=2.0):
    """Goes on by itself."""
    return axis_pb.MoveVelocityRequest(
        axis="spinner", velocity=velocity,
        options={"request_id": str(uuid.uuid4()), "not_after": {"seconds": int(time.time() + valid)}})


class Finger(threading.Thread):
    """Holds a button: renews one press until it is let go, or the lane is gone."""

    def __init__(self, lane, hold=1.0):
        super().__init__(daemon=True)
        self.lane, self.hold, self.press = lane, hold, str(uuid.uuid4())
        self._let_go = threading.Event()
        self.start()

    def run(self):
        while not self._let_go.wait(0.05):
            try:
                self.lane.jog(self.press, self.hold)
            except (OSError, ValueError):  # it is closed
                return

    def let_go(self):
        """Nothing more is said."""
        self._let_go.set()
        self.join()


class WebScenario(Scenario):
    """A spinner, enabled, behind a gateway."""

    def setUp(self):
        super().setUp()
        self.subject = self.machine({"spinner": spinner()})

    def start_machine(self, access=""):
        self.subject.server += f"\n{access}"
        self.subject.write_config()
        self.subject.start()
        self.subject.client.to_done("Enable", "spinner")
        return self.subject

    def web(self, keys="", **arguments):
        web = Web(self.subject, keys, **arguments)
        self.addCleanup(web.stop)
        return web

    def lane(self, page, **arguments):
        lane = page.lane(**arguments)
        self.addCleanup(lane.close)
        return lane.measure()

    def held(self, lane, hold=1.0):
        """A finger on a button, and the shaft that turns for it."""
        before = self.subject.sim.shaft()
        finger = Finger(lane, hold)
        self.addCleanup(finger.let_go)
        again = time.monotonic() + 3

        def turns():
            nonlocal again
            if self.subject.sim.shaft().position - before.position > 100:
                return True
            if time.monotonic() > again:  # a press that came late, on a computer that is busy, starts nothing
                finger.press, again = str(uuid.uuid4()), time.monotonic() + 3
            return False
        wait_for(turns, "the shaft turns")
        finger.starts = self.subject.sim.shaft().starts
        return finger

    def was_halted(self, client=OWN_NAME):
        """What the daemon tells: the last jog was ended by a Halt of that client, and not by its hold."""
        own = self.subject.client
        commands = own.call(own.command.ListCommands, command_pb.ListCommandsRequest(axis="spinner")).commands

        def last(kind):
            return max((c for c in commands if c.kind == kind), key=lambda c: c.accepted_at.ToNanoseconds())
        jog, halt = last(pb.COMMAND_KIND_JOG), last(pb.COMMAND_KIND_HALT)
        self.assertEqual((jog.state, jog.cause.reason), (pb.COMMAND_STATE_ABORTED, error_pb.REASON_SUPERSEDED), jog)
        self.assertEqual(halt.client, client)
        self.assertGreater(halt.accepted_at.ToNanoseconds(), jog.started_at.ToNanoseconds())

    def stands_for_good(self, seconds=1.2):
        """The shaft comes to rest, and stays there: longer than a start may be on its way."""
        self.subject.sim.wait_rest()
        rest = self.subject.sim.shaft()
        until = time.monotonic() + seconds
        while time.monotonic() < until:
            self.assertEqual(self.subject.sim.shaft(), rest)
            time.sleep(0.02)
