"""axisd-web as browsers, and those who only claim to be browsers, meet it."""
import http.client
import json
import os
import pathlib
import socket
import ssl
import struct
import subprocess
import unittest

from certificates import Certificates
from harness import LIMIT, OWN_NAME, axis_pb, error_pb, run, system_pb, wait_for
from harness.client import event_pb
from support import AXISD_WEB, DELEGATE, ECHO, Page, WebScenario, frame, frames


class Loopback(WebScenario):
    """Without users everybody at this computer is the gateway itself."""

    def setUp(self):
        super().setUp()
        self.start_machine()
        self.gateway = self.web("limits: { streams_each: 8 }\n").start()
        self.page = Page(self.gateway)

    def info(self, page=None):
        return (page or self.page).call("SystemService/GetInfo", system_pb.GetInfoRequest(), system_pb.GetInfoResponse)

    def test_the_page_is_served(self):
        status, headers, body = self.gateway.request("GET", "/")
        self.assertEqual((status, body), (200, b"<!doctype html><title>axisd</title>"))
        self.assertIn("default-src 'none'; script-src 'self'", headers["Content-Security-Policy"])
        self.assertEqual(headers["Cache-Control"], "no-cache")
        self.assertEqual(self.gateway.request("GET", "/", headers={"If-None-Match": headers["ETag"]})[0], 304)
        self.assertEqual(self.gateway.request("GET", "/axes/spinner?tab=1")[2], body)
        status, headers, packed = self.gateway.request("GET", "/assets/page-1A2B.js", headers={"Accept-Encoding": "gzip"})
        self.assertEqual((status, packed, headers["Content-Encoding"]), (200, b"compressed", "gzip"))
        self.assertIn("immutable", headers["Cache-Control"])
        self.assertEqual(self.gateway.request("GET", "/assets/page-1A2B.js")[2], b"export {};")
        self.assertEqual(self.gateway.request("GET", "/assets/none.js")[0], 404)
        self.assertEqual(self.gateway.request("HEAD", "/")[2], b"")
        self.assertEqual(self.gateway.request("PUT", "/")[0], 405)
        for path in ("/../users", "/assets/../../users", "//etc/passwd.txt"):
            self.assertEqual(self.gateway.request("GET", path)[0], 404, path)

    def test_calls_are_passed_on(self):
        self.assertEqual(self.info().identity, OWN_NAME)
        self.assertEqual(self.page.session(), (200, {"name": "loopback", "role": "", "how": "loopback", "expires_in_s": 0}))
        status, message, detail = self.page.call("AxisService/GetAxis", axis_pb.GetAxisRequest(axis="spinnr"),
                                                 axis_pb.GetAxisResponse)
        self.assertEqual((status, detail.reason), (5, error_pb.REASON_UNKNOWN_AXIS))
        self.assertIn("spinnr", message)
        status, _, detail = self.page.call("AxisService/Nothing", axis_pb.GetAxisRequest(), axis_pb.GetAxisResponse)
        self.assertEqual((status, detail), (12, None))
        connection = self.gateway.connect()  # several on one connection
        self.addCleanup(connection.close)
        for _ in range(3):
            status, _, body = self.gateway.request("POST", "/axisd.v1.SystemService/GetInfo", frame(b""),
                                                   self.page.headers(), connection)
            self.assertEqual((status, frames(body)[1]["grpc-status"]), (200, "0"))

    def test_a_deadline_ends_a_stream(self):
        status, _, body = self.page.post("EventService/WatchEvents", event_pb.WatchEventsRequest(), grpc_timeout="200m")
        self.assertEqual((status, frames(body)[1]["grpc-status"]), (200, "4"))

    def test_a_stream_comes_as_it_happens(self):
        connection, following = self.page.stream("AxisService/WatchAxes", axis_pb.WatchAxesRequest(),
                                                 axis_pb.WatchAxesResponse)
        self.addCleanup(connection.close)
        ticks = [following().tick for _ in range(5)]
        self.assertEqual(ticks, sorted(set(ticks)))
        self.subject.daemon.kill()
        while following() is not None:
            pass
        wait_for(lambda: self.gateway.request("GET", "/healthz")[0] == 503, "the gateway tells that axisd is away")
        self.assertIn(b"axisd does not answer at unix:", self.gateway.request("GET", "/healthz")[2])
        self.assertEqual(self.info()[0], 14)
        self.subject.start_daemon()
        wait_for(lambda: self.gateway.request("GET", "/healthz")[0] == 200, "the gateway has found axisd again")
        self.assertEqual(self.info().identity, OWN_NAME)

    def test_who_leaves_leaves_nothing_behind(self):
        for _ in range(40):  # far more than a person may have open
            connection, _ = self.page.stream("EventService/WatchEvents", event_pb.WatchEventsRequest(),
                                             event_pb.WatchEventsResponse)
            connection.close()
            wait_for(lambda: self.post_status() == 200, "a place for a call")

    def post_status(self):
        return self.page.post("SystemService/GetInfo", system_pb.GetInfoRequest())[0]

    def test_a_persons_calls_have_a_limit(self):
        open_ = [self.page.stream("AxisService/WatchAxes", axis_pb.WatchAxesRequest(), axis_pb.WatchAxesResponse)
                 for _ in range(8)]
        status, headers, _ = self.page.post("SystemService/GetInfo", system_pb.GetInfoRequest())
        self.assertEqual((status, headers["grpc-status"]), (429, "8"))
        stop = axis_pb.StopRequest(axis="spinner")
        self.assertEqual(self.page.post("AxisService/Stop", stop)[0], 200, "stops have places of their own")
        for connection, _ in open_:
            connection.close()
        wait_for(lambda: self.post_status() == 200, "the places are free again")

    def test_other_pages_and_other_content_are_refused(self):
        request = system_pb.GetInfoRequest()
        for headers, status in (({"Origin": None}, 403), ({"Origin": "http://evil.example"}, 403), ({"Origin": "null"}, 403),
                                ({"Origin": f"https://localhost:{self.gateway.port}"}, 403),
                                ({"Host": f"evil.example:{self.gateway.port}"}, 421),
                                ({"Content-Type": "application/grpc-web+json"}, 415), ({"Content-Type": "text/plain"}, 415),
                                ({"Content-Type": "application/x-www-form-urlencoded"}, 415)):
            named = self.page.headers() | headers
            named = {key: value for key, value in named.items() if value is not None}
            got = self.gateway.request("POST", "/axisd.v1.SystemService/GetInfo", frame(request.SerializeToString()), named)
            self.assertEqual(got[0], status, headers)
            self.assertNotIn("Access-Control-Allow-Origin", got[1])
        self.assertEqual(self.gateway.request("OPTIONS", "/axisd.v1.SystemService/GetInfo", headers=self.page.headers())[0], 404)
        self.assertEqual(self.gateway.request("GET", "/axisd.v1.SystemService/GetInfo", headers=self.page.headers())[0], 404)

    def test_bad_bodies_are_refused(self):
        for body, status in ((b"", 400), (b"\0\0\0", 400), (struct.pack(">BI", 0, 100) + b"half", 400),
                             (frame(b"") + frame(b""), 400), (struct.pack(">BI", 1, 0), 400),
                             (frame(bytes(1 << 20)), 413)):
            got = self.gateway.request("POST", "/axisd.v1.SystemService/GetInfo", body, self.page.headers())
            self.assertEqual(got[0], status, body[:20])
        status, _, body = self.gateway.request("POST", "/axisd.v1.AxisService/GetAxis", frame(b"\xff\xff"), self.page.headers())
        self.assertEqual(status, 200)
        self.assertNotEqual(frames(body)[1]["grpc-status"], "0")

    def says(self, text):
        """The first line of the answer to raw bytes; empty: there is none."""
        with self.gateway.raw() as client:
            client.sendall(text)
            return client.makefile("rb").readline().decode().strip()

    def test_what_is_no_http_is_contained(self):
        self.assertIn(" 400 ", self.says(b"\x16\x03\x01\x02\x00\x01\x00\x01\xfc\x03\x03" + bytes(200) + b"\r\n\r\n"))
        self.assertIn(" 400 ", self.says(b"PRI * HTTP/2.0\r\n\r\nSM\r\n\r\n"))
        self.assertIn(" 505 ", self.says(b"GET / HTTP/1.0\r\nHost: localhost\r\n\r\n"))
        self.assertIn(" 421 ", self.says(b"GET / HTTP/1.1\r\n\r\n"))
        self.assertIn(" 421 ", self.says(b"GET / HTTP/1.1\r\nHost: localhost\r\nHost: localhost\r\n\r\n"))
        self.assertIn(" 431 ", self.says(b"GET / HTTP/1.1\r\nHost: localhost\r\nX: " + b"x" * 20_000 + b"\r\n\r\n"))
        self.assertIn(" 400 ", self.says(b"GET / HTTP/1.1\r\nHost: localhost\r\nContent-Length: -1\r\n\r\n"))
        self.assertEqual(self.info().identity, OWN_NAME)

    def test_half_a_request_is_cut_off_after_its_time(self):
        self.gateway.stop()
        self.gateway = self.web("limits: { request: 1 s }\n").start()
        clients = []
        for text in (b"G", b"GET / HTTP/1.1\r\nHost: localh", b"POST /session HTTP/1.1\r\nHost: localhost\r\n"
                     b"Origin: http://localhost\r\nContent-Type: application/json\r\nContent-Length: 5\r\n\r\n{"):
            clients.append(self.gateway.raw())
            self.addCleanup(clients[-1].close)
            clients[-1].sendall(text)
        for client in clients:
            self.assertEqual(client.recv(1), b"", "closed by the gateway")

    def test_who_asks_for_more_before_a_call_is_answered_is_cut_off(self):
        content = frame(b"")
        head = "\r\n".join(["POST /axisd.v1.AxisService/WatchAxes HTTP/1.1", f"Host: localhost:{self.gateway.port}",
                            *(f"{key}: {value}" for key, value in self.page.headers().items()),
                            f"Content-Length: {len(content)}", "", ""]).encode()
        with self.gateway.raw() as client:
            client.sendall(head + content)
            self.assertIn(b"200", client.recv(4096))
            client.sendall(b"GET / HTTP/1.1\r\n")
            try:
                while client.recv(4096):
                    pass
            except ConnectionError:
                pass
        with self.gateway.raw() as client:
            client.sendall(head + content + b"GET / HTTP/1.1\r\n")
            try:
                self.assertEqual(client.recv(4096), b"")
            except ConnectionError:
                pass

    def test_out_of_descriptors_it_goes_on(self):
        self.gateway.stop()
        web = self.web("limits: { log_in: 2 s }\n", prefix=("prlimit", "--nofile=64:64")).start()
        crowd = []
        self.addCleanup(lambda: [client.close() for client in crowd])
        for _ in range(120):
            crowd.append(web.raw())
        wait_for(lambda: web.request("GET", "/healthz")[0] == 200, "it serves again")
        self.assertTrue(web.program.running())

    def test_an_axis_is_moved_while_others_misbehave(self):
        self.subject.client.motion("MoveVelocity", "spinner", velocity=2.0)
        self.subject.sim.wait_moving()
        crowd = [self.gateway.raw() for _ in range(60)]  # more than there is a share of
        for client in crowd:
            client.sendall(os.urandom(64))
        self.assertTrue(self.subject.sim.shaft().moving)
        for client in crowd:
            client.close()
        stop = axis_pb.StopRequest(axis="spinner")
        answer = wait_for(lambda: self.page.post("AxisService/Stop", stop), "a stop")
        self.assertEqual(frames(answer[2])[1]["grpc-status"], "0")
        self.stands_for_good()

    def test_another_gateway_at_the_same_address_is_an_error(self):
        second = self.web()
        pathlib.Path(second.config).write_text(f"listen: localhost:{self.gateway.port}\nusers: {second.users}\n"
                                               f"files: {second.page}\n")
        done = run([AXISD_WEB, "--config", second.config])
        self.assertEqual(done.returncode, 1, done)
        self.assertIn("nothing else listens there", done.stderr)
        pathlib.Path(second.users).unlink()
        done = run([AXISD_WEB, "--config", second.config])
        self.assertEqual(done.returncode, 2, done)
        self.assertIn("the users file that the configuration names is not there", done.stderr)
        pathlib.Path(second.config).write_text("listn: localhost:1\nfiles: []\n")
        done = run([AXISD_WEB, "--config", second.config, "--check"])
        self.assertEqual((done.returncode, len(done.stderr.splitlines())), (2, 2), done)
        self.assertIn("unknown key 'listn'; did you mean 'listen'?", done.stderr)

    def test_a_check_finds_what_a_start_would(self):
        other = self.web()
        check = [AXISD_WEB, "--config", other.config, "--check"]
        good = pathlib.Path(other.config).read_text()
        self.assertEqual(run(check).returncode, 0)
        for changed, told in (
                (good.replace(f"files: {other.page}", "files: /nothere"), "/nothere: cannot be read: No such file"),
                (good.replace(f"files: {other.page}", f"files: {other.page}/assets"), "no page of axisd-web is there; check 'files'"),
                (good.replace("axisd: {", "axisd: { tls: { ca: /nothere.crt, certificate: /y, key: /z },"),
                 "/nothere.crt: cannot be read; check axisd.tls"),
                ("", "is empty")):
            pathlib.Path(other.config).write_text(changed)
            for words in (check, check[:-1]):
                done = run(words)
                self.assertEqual(done.returncode, 2, done)
                self.assertIn(told, done.stderr)
        pathlib.Path(other.config).unlink()
        self.assertIn("cannot be read: No such file or directory", run(check).stderr)

    def test_a_daemon_that_is_away_is_told_once(self):
        self.subject.daemon.terminate()
        away = f"axisd does not answer at unix:{self.subject.socket}: "
        wait_for(lambda: away in self.gateway.program.log(), "it tells")
        self.subject.start_daemon()
        wait_for(lambda: "axisd answers at " in self.gateway.program.log().partition(away)[2], "it tells of its return")
        self.assertEqual(self.gateway.program.log().count(away), 1)

    def test_a_user_needs_a_password(self):
        words = [AXISD_WEB, "--config", self.gateway.config, "user"]
        done = subprocess.run([*words, "add", "shift-a", "--role", "operator"], stdin=subprocess.DEVNULL, capture_output=True,
                              text=True, check=False, timeout=LIMIT)
        self.assertEqual((done.returncode, done.stdout), (2, ""))
        self.assertIn("no password was given: type it, or write it as the first line", done.stderr)
        self.assertEqual(self.gateway.user("add", "shift-a", "--role", "operator", password="correct horse"),
                         "shift-a  operator\n")

    def test_a_daemon_that_does_not_let_it_speak_for_others_is_told_once(self):
        self.gateway.user("add", "anna", "--role", "operator", password="correct horse")
        page = Page(self.gateway)
        wait_for(lambda: page.log_in("anna", "correct horse")[0] == 204, "the user is known")
        for _ in range(2):
            status, message, detail = page.call("AxisService/GetAxis", axis_pb.GetAxisRequest(axis="spinner"),
                                                axis_pb.GetAxisResponse)
            self.assertEqual((status, detail.reason), (7, error_pb.REASON_ACCESS_DENIED), message)
            self.assertTrue(detail.remedy)
        told = f"refuses whoever has logged in: {OWN_NAME} may not speak for others; "
        self.assertEqual(self.gateway.program.log().count(told), 1, self.gateway.program.log())


class Persons(WebScenario):
    def setUp(self):
        super().setUp()
        self.start_machine(DELEGATE)
        self.gateway = self.web()
        self.gateway.user("add", "anna", "--role", "operator", password="correct horse")
        self.gateway.user("add", "bert", "--role", "viewer", password="battery staple")
        self.assertEqual(self.gateway.user("list"), "anna  operator\nbert  viewer\n")
        self.assertEqual(os.stat(self.gateway.users).st_mode & 0o777, 0o600)
        self.gateway.start()
        self.page = Page(self.gateway)

    def disable(self, page, **headers):
        """What takes a role."""
        request = axis_pb.DisableRequest(axis="spinner", options={"request_id": "once"})
        return page.call("AxisService/Disable", request, axis_pb.DisableResponse, **headers)

    def test_nobody_may_ask_for_anything(self):
        for _ in range(2):
            status, headers, _ = self.page.post("SystemService/GetInfo", system_pb.GetInfoRequest())
            self.assertEqual((status, headers["grpc-status"]), (401, "16"))
            self.assertEqual(self.page.session()[0], 401)
            self.page.cookie = "axisd=" + "0" * 64  # somebody's guess
        self.assertEqual(self.gateway.request("GET", "/")[0], 200, "the page itself asks for the log-in")

    def test_the_log_in(self):
        for name, password in (("anna", "wrong horse"), ("nobody", "correct horse"), ("", "")):
            status, answer = self.page.log_in(name, password)
            self.assertEqual((status, answer["reason"]), (401, "wrong"))
        self.assertGreater(answer["retry_after_ms"], 0, "the third failure begins the pauses")
        status, answer = self.page.log_in("anna", "correct horse")
        self.assertEqual((status, answer["reason"]), (401, "too_soon"))

        def logged_in():
            return self.page.log_in("anna", "correct horse")[0] == 204
        wait_for(logged_in, "the pause is over")
        status, answer = self.page.session()
        self.assertEqual((status, answer["name"], answer["role"], answer["how"]), (200, "anna", "operator", "password"))
        self.assertGreater(answer["expires_in_s"], 0)
        self.assertEqual(self.disable(self.page).command.client, f"anna via {OWN_NAME}")
        self.assertEqual(self.page.log_out(), 204)
        self.assertEqual(self.page.session()[0], 401)

    def test_the_cookie(self):
        _, headers = self.page.log_in("anna", "correct horse")
        self.assertRegex(headers["Set-Cookie"], r"^axisd=[0-9a-f]{64}; HttpOnly; SameSite=Strict; Path=/$")
        status, _, _ = self.gateway.request(
            "POST", "/session", json.dumps({"name": "anna", "password": "correct horse"}),
            {"Origin": "http://evil.example", "Content-Type": "application/json"})
        self.assertEqual(status, 403)
        for body in ("", "[]", "{", '{"name": 1}', '{"name": "anna"}', json.dumps({"name": "anna", "password": "x" * 2000}),
                     json.dumps({"name": "a" * 65, "password": "x"})):
            status, _, _ = self.gateway.request("POST", "/session", body,
                                                {"Origin": self.gateway.origin, "Content-Type": "application/json"})
            self.assertEqual(status, 400, body[:20])
        status, _, _ = self.gateway.request("POST", "/session", " " * 8193,
                                            {"Origin": self.gateway.origin, "Content-Type": "application/json"})
        self.assertEqual(status, 413)

    def test_each_may_do_what_its_role_says(self):
        viewer = Page(self.gateway)
        viewer.log_in("bert", "battery staple")
        status, message, detail = self.disable(viewer)
        self.assertEqual((status, detail.reason), (7, error_pb.REASON_ACCESS_DENIED))
        self.assertIn("bert via", message)
        # Whatever a page says of itself.
        for forged in ({"axisd_user": "anna", "axisd_role": "maintainer"}, {"axisd_role": "operator"}):
            self.assertEqual(self.disable(viewer, **forged)[0], 7)
        answer = viewer.call("AxisService/Stop", axis_pb.StopRequest(axis="spinner"), axis_pb.StopResponse,
                             axisd_user="anna")
        self.assertEqual(answer.command.client, f"bert via {OWN_NAME}")

    def test_sessions_are_listed_and_revoked(self):
        anna, bert = Page(self.gateway), Page(self.gateway)
        anna.log_in("anna", "correct horse")
        bert.log_in("bert", "battery staple")

        def listed(page):
            return json.loads(self.gateway.request("GET", "/sessions", headers=page.headers(Origin=None))[2])
        (own,) = listed(bert)
        self.assertEqual((own["name"], own["own"]), ("bert", True))
        (hers,) = listed(anna)
        self.assertEqual(self.gateway.request("DELETE", f"/sessions/{hers['id']}", headers=bert.headers())[0], 404)
        connection, following = anna.stream("AxisService/WatchAxes", axis_pb.WatchAxesRequest(), axis_pb.WatchAxesResponse)
        self.addCleanup(connection.close)
        self.assertIsNotNone(following())
        self.assertEqual(self.gateway.request("DELETE", f"/sessions/{hers['id']}", headers=anna.headers())[0], 204)
        with self.assertRaises((http.client.IncompleteRead, ConnectionError, ValueError)):
            while following() is not None:
                pass
            raise ConnectionError  # it ended in order
        self.assertEqual(anna.session()[0], 401)
        self.assertEqual(bert.session()[0], 200)

    def test_a_change_of_the_users_is_seen_at_once(self):
        self.page.log_in("anna", "correct horse")
        self.gateway.user("add", "anna", "--role", "viewer", password="correct horse")
        wait_for(lambda: self.page.session()[0] == 401, "the session of another role has ended")
        self.assertEqual(self.page.log_in("anna", "correct horse")[0], 204)
        self.assertEqual(self.disable(self.page)[0], 7)
        pathlib.Path(self.gateway.users).unlink()
        self.assertEqual(self.page.session()[0], 200, "a file that is gone lets nobody in, and nobody out")
        self.assertEqual(Page(self.gateway).session()[0], 401)


class Tls(WebScenario):
    def setUp(self):
        super().setUp()
        self.start_machine(DELEGATE)
        self.authority = Certificates(self.subject.directory, "authority")
        for name in ("server", "panel-1", "stranger", "anna"):
            self.authority.issue(name)
        self.context = self.trusting()
        self.gateway = self.web(
            f"tls: {{ certificate: {self.authority.path('crt', 'server')}, key: {self.authority.path('key', 'server')}, "
            f"client_ca: {self.authority.path('crt')} }}\n", tls=self.context)
        self.gateway.user("add", "anna", "--role", "operator", password="correct horse")
        self.gateway.user("add", "panel-1", "--role", "operator", "--certificate")
        self.gateway.start()

    def trusting(self, name=None):
        context = ssl.create_default_context(cafile=self.authority.path("crt"))
        if name:
            context.load_cert_chain(self.authority.path("crt", name), self.authority.path("key", name))
        return context

    def test_a_password_gives_a_cookie_of_this_host_alone(self):
        page = Page(self.gateway)
        status, headers = page.log_in("anna", "correct horse")
        self.assertEqual(status, 204)
        self.assertRegex(headers["Set-Cookie"],
                         r"^__Host-axisd=[0-9a-f]{64}; Secure; HttpOnly; SameSite=Strict; Path=/$")
        self.assertEqual(page.session()[1]["how"], "password")
        lane = self.lane(page)
        self.held(lane, hold=2.0)
        lane.close()
        self.stands_for_good()
        self.was_halted(f"anna via {OWN_NAME}")

    def test_a_certificate_is_a_person(self):
        self.gateway.tls = self.trusting("panel-1")
        page = Page(self.gateway)
        self.assertEqual(page.session(), (200, {"name": "panel-1", "role": "operator", "how": "certificate", "expires_in_s": 0}))
        request = axis_pb.DisableRequest(axis="spinner", options={"request_id": "once"})
        answer = page.call("AxisService/Disable", request, axis_pb.DisableResponse)
        self.assertEqual(answer.command.client, f"panel-1 via {OWN_NAME}")
        self.gateway.tls = self.trusting("stranger")
        self.assertEqual(Page(self.gateway).session()[1]["role"], "viewer")
        self.gateway.tls = self.trusting("anna")
        self.assertEqual(Page(self.gateway).session()[1], {"name": "anna", "role": "viewer", "how": "certificate",
                                                           "expires_in_s": 0}, "a certificate knows no password")
        self.gateway.tls = self.context
        self.assertEqual(Page(self.gateway).session()[0], 401)

    def test_a_certificate_of_another_role_is_out_at_once(self):
        self.gateway.tls = self.trusting("panel-1")
        page = Page(self.gateway)
        lane = self.lane(page)
        connection, following = page.stream("AxisService/WatchAxes", axis_pb.WatchAxesRequest(), axis_pb.WatchAxesResponse)
        self.addCleanup(connection.close)
        self.assertIsNotNone(following())
        self.held(lane, hold=2.0)
        self.gateway.user("add", "bert", "--role", "viewer", "--certificate")
        wait_for(lambda: "3 users" in self.gateway.program.log(), "the gateway has read it")
        self.assertEqual(lane.ask("")[0], ECHO, "nothing has changed for this one")
        self.gateway.user("add", "panel-1", "--role", "viewer", "--certificate")
        lane.until_end()
        self.stands_for_good()
        self.was_halted(f"panel-1 via {OWN_NAME}")
        with self.assertRaises((http.client.IncompleteRead, ConnectionError, ssl.SSLError)):
            while following() is not None:
                pass
            raise ConnectionError  # it ended in order
        self.assertEqual(page.session()[1]["role"], "viewer")

    def test_garbage_in_tls_is_contained(self):
        for garbage in (b"GET / HTTP/1.1\r\nHost: localhost\r\n\r\n", os.urandom(500), b"\x16\x03\x01\xff\xff" + bytes(70_000)):
            with self.gateway.raw() as client:
                try:
                    client.sendall(garbage)
                    while client.recv(4096):
                        pass
                except ConnectionError:
                    pass
        half = self.context.wrap_bio(ssl.MemoryBIO(), out := ssl.MemoryBIO(), server_hostname="localhost")
        with self.assertRaises(ssl.SSLWantReadError):
            half.do_handshake()
        with self.gateway.raw() as client:
            client.sendall(out.read()[:50])
        old = ssl.SSLContext(ssl.PROTOCOL_TLS_CLIENT)
        old.load_verify_locations(self.authority.path("crt"))
        old.minimum_version, old.maximum_version = ssl.TLSVersion.TLSv1, ssl.TLSVersion.TLSv1_1
        old.set_ciphers("ALL:@SECLEVEL=0")
        with self.assertRaises((ssl.SSLError, ConnectionError)), socket.create_connection(
                ("localhost", self.gateway.port), timeout=LIMIT) as client:
            old.wrap_socket(client, server_hostname="localhost")
        self.assertEqual(Page(self.gateway).log_in("anna", "correct horse")[0], 204)

    def test_the_handshake_has_its_time(self):
        self.gateway.stop()
        with open(self.gateway.config, "a") as config:
            config.write("limits: { request: 1 s }\n")
        self.gateway.start()
        with self.gateway.raw() as client:
            client.settimeout(LIMIT)
            self.assertEqual(client.recv(1), b"", "closed by the gateway")


if __name__ == "__main__":
    unittest.main()
