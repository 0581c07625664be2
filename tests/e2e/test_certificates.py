"""Certificates over the years: who is told what, revoked, expired and replaced while connections are open."""
import datetime
import os
import pathlib
import re
import shutil
import ssl
import threading
import unittest

import grpc

from certificates import openssl
from harness import (AXISCTL, AXISD, ROOT, CallFailed, Client, Scenario, axis_pb, feeder, run, system_pb, wait_for)

STAMP = r"\(20\d\d-\d\d-\d\dT\d\d:\d\d:\d\dZ\)"


class Cell(Scenario):
    """A daemon with files in `tls`, and the authority in `cell` that made them."""

    def setUp(self):
        super().setUp()
        self.subject = self.machine({"feeder": feeder()})
        self.tls = pathlib.Path(self.subject.path("tls"))
        self.tls.mkdir()
        self.pki("init", "cell")
        self.pki("server", "press-1", "127.0.0.1")
        for name in ("shift-a", "panel"):
            self.pki("client", name)
        self.install()
        names = {"certificate": "server.crt", "key": "server.key", "client_ca": "clients.crt", "crl": "clients.crl"}
        keys = ", ".join(f"{key}: {self.tls / name}" for key, name in names.items())
        self.subject.server = f"{{ listen: 127.0.0.1:0, tls: {{ {keys} }} }}"
        self.subject.write_config()

    def pki(self, *words, cell="cell"):
        done = run([str(ROOT / "deploy/pki.sh"), "--dir", self.subject.path(cell), *words])
        self.assertEqual(done.returncode, 0, done)

    def made(self, name, cell="cell"):
        return self.subject.path(f"{cell}/{name}")

    def put(self, source, name):
        """In the place of the file at once, as an administrator should."""
        fresh = self.tls / f"{name}.new"
        shutil.copy(source, fresh)
        fresh.replace(self.tls / name)

    def install(self):
        for source, name in (("press-1.key", "server.key"), ("press-1.crt", "server.crt"), ("ca.crt", "clients.crt"),
                             ("clients.crl", "clients.crl")):
            self.put(self.made(source), name)

    def issue(self, name, begin, end):
        """NAME-then.crt: for the same key, in another time."""
        base, then = self.made(name), self.made(f"{name}-then.crt")
        openssl("req", "-new", "-config", self.made("openssl.cnf"), "-key", f"{base}.key", "-subj", f"/CN={name}", "-out",
                f"{base}.csr")
        openssl("ca", "-config", self.made("openssl.cnf"), "-batch", "-notext", "-startdate", begin, "-enddate", end,
                "-extfile", f"{base}.ext", "-in", f"{base}.csr", "-out", then)
        return then

    def start(self):
        self.subject.start_lines()
        self.daemon = self.subject.start_daemon()
        self.port = wait_for(lambda: re.search(r"serves 'e2e' on port (\d+)", self.daemon.log()), "its port")[1]
        self.lane = re.search(r"stops are taken on port (\d+)", self.daemon.log())[1]

    def connect(self, name, certificate=None, port=None):
        def read(path):
            return pathlib.Path(path).read_bytes()

        client = Client(f"127.0.0.1:{port or self.port}", grpc.ssl_channel_credentials(
            read(self.made("ca.crt")), read(self.made(f"{name}.key")), read(certificate or self.made(f"{name}.crt"))))
        self.addCleanup(client.close)
        return client

    def axisctl(self, *words, ca=None, certificate=None, key=None, host="127.0.0.1"):
        files = ["--tls-ca", ca or self.made("ca.crt"), "--stop-server", f"127.0.0.1:{self.lane}"]
        if certificate:
            files += ["--tls-cert", certificate, "--tls-key", key or re.sub(r"(-then)?\.crt$", ".key", certificate)]
        # c-ares forgets a few bytes of a name at the end, which LeakSanitizer tells.
        environment = os.environ | {"GRPC_DNS_RESOLVER": "native"}
        return run([AXISCTL, "--server", f"{host}:{self.port}", *files, *words], env=environment)

    def told(self, status, text, *words, **files):
        """One line, which says this."""
        done = self.axisctl(*(words or ("list",)), **files)
        self.assertEqual(done.returncode, status, done)
        self.assertRegex(done.stderr, r"\Aaxisctl: [^\n]+\n\Z")
        self.assertRegex(done.stderr, text)

    def unauthenticated(self, function, *arguments, **keywords):
        return self.refused("UNAUTHENTICATED", "UNAUTHENTICATED", function, *arguments, **keywords).message

    def shown(self):
        return ssl.get_server_certificate(("127.0.0.1", int(self.port)))

    def served(self, file):
        return self.shown().split() == pathlib.Path(file).read_text().split()


class Clients(Cell):
    def test_what_each_is_told(self):
        self.start()
        self.pki("init", "other", cell="other")
        self.pki("client", "stranger", cell="other")
        good = self.made("shift-a.crt")
        self.assertEqual(self.axisctl("list", certificate=good).returncode, 0)
        self.told(3, "the daemon asks for a certificate of the client; give --tls-cert and --tls-key")
        self.told(3, "the daemon does not take certificates of CN=other, which signed that of --tls-cert; give one of CN=cell",
                  certificate=self.made("stranger.crt", "other"))
        self.told(3, "--tls-key: the key does not belong to the certificate of --tls-cert; ", certificate=good,
                  key=self.made("panel.key"))
        self.told(3, rf"--tls-cert: the certificate has expired {STAMP}; renew it",
                  certificate=self.issue("shift-a", "20200101000000Z", "20210101000000Z"))
        self.told(3, "--tls-cert: the certificate is not valid before 2040-01-01T00:00:00Z; ",
                  certificate=self.issue("shift-a", "20400101000000Z", "20410101000000Z"))
        self.told(3, "the daemon's certificate is signed by CN=cell, which is not in --tls-ca; ", certificate=good,
                  ca=self.made("ca.crt", "other"))
        self.told(3, "the daemon's certificate is for 127.0.0.1, you called localhost; ", certificate=good,
                  host="localhost")

    def test_revoked_while_it_is_connected(self):
        self.start()
        panel, shift = self.connect("panel"), self.connect("shift-a")
        lane = self.connect("panel", port=self.lane)
        stop = lane.channel.unary_unary("/axisd.v1.StopService/Stop",
                                        request_serializer=axis_pb.StopRequest.SerializeToString,
                                        response_deserializer=axis_pb.StopResponse.FromString)
        panel.wait_online("feeder")
        self.assertEqual(panel.to_done("Enable", "feeder").client, "panel")
        lane.call(stop, axis_pb.StopRequest(axis="feeder"))
        watch = panel.axis.WatchAxes(axis_pb.WatchAxesRequest())
        next(watch)
        shutil.copy(self.made("panel.crt"), self.subject.path("panel.crt"))
        shutil.copy(self.made("panel.key"), self.subject.path("panel.key"))
        self.pki("revoke", "panel")
        self.install()
        wait_for(lambda: "the files were replaced" in self.daemon.log(), "the new list")
        text = rf"the certificate of panel was revoked {STAMP}"
        self.assertRegex(self.unauthenticated(panel.info), text)
        self.assertRegex(self.unauthenticated(panel.motion, "Stop", "feeder"), text)
        self.assertRegex(self.unauthenticated(lane.call, stop, axis_pb.StopRequest(axis="feeder")), text)
        with self.assertRaises(grpc.RpcError) as ended:
            for _ in watch:
                pass
        self.assertIs(ended.exception.code(), grpc.StatusCode.UNAUTHENTICATED)
        revoked = self.subject.path("panel.crt")
        self.told(4, text, certificate=revoked)
        self.told(4, text, "stop", "feeder", certificate=revoked)
        shift.to_done("Stop", "feeder")

    def test_expires_while_it_is_connected(self):
        self.start()
        end = datetime.datetime.now(datetime.timezone.utc) + datetime.timedelta(seconds=45)
        panel = self.connect("panel", self.issue("panel", "20200101000000Z", end.strftime("%Y%m%d%H%M%SZ")))
        panel.wait_online("feeder")

        def refusal():
            try:
                panel.info()
                return None
            except CallFailed as failed:
                if failed.code is not grpc.StatusCode.UNAUTHENTICATED:
                    raise
                return failed
        failure = wait_for(refusal, "its end")
        self.assertEqual((failure.code, failure.reason), (grpc.StatusCode.UNAUTHENTICATED, "REASON_UNAUTHENTICATED"))
        text = rf"the certificate of panel has expired {STAMP}"
        self.assertRegex(failure.message, text)
        self.assertRegex(self.unauthenticated(panel.motion, "Stop", "feeder"), text)


class Files(Cell):
    def refused_by_check(self, name, text):
        for done in (run([AXISD, "--check", "--config", self.subject.config]), run([AXISCTL, "check", self.subject.config])):
            self.assertEqual(done.returncode, 2, done)
            self.assertRegex(done.stderr.splitlines()[0], rf"axisd\.yaml:\d+:\d+: {self.tls / name}: {text}")

    def test_open_to_every_user(self):
        (self.tls / "server.key").chmod(0o644)
        self.refused_by_check("server.key", r"every user of this computer may read or change this private key \(mode 0644\); "
                                            "chmod 640 ")

    def test_revocation_lists(self):
        self.pki("init", "other", cell="other")
        self.put(self.made("clients.crl", "other"), "clients.crl")
        self.refused_by_check("clients.crl", "the CRL was not issued by an authority of ")
        done = run([AXISD, "--config", self.subject.config])
        self.assertEqual(done.returncode, 2, done)

    def test_revocation_list_that_has_expired(self):
        for suffix in ("crt", "key"):
            shutil.copy(self.made(f"panel.{suffix}"), self.subject.path(f"panel.{suffix}"))
        self.pki("revoke", "panel")
        openssl("ca", "-config", self.made("openssl.cnf"), "-gencrl", "-crl_lastupdate", "20200101000000Z",
                "-crl_nextupdate", "20210101000000Z", "-out", str(self.tls / "clients.crl"))
        text = r"the CRL has expired \(2021-01-01T00:00:00Z\); renew it"
        self.refused_by_check("clients.crl", text)
        # It stops no machine, and goes on to revoke what it names.
        self.start()
        shift = self.made("shift-a.crt")
        wait_for(lambda: re.search(rf"{self.tls / 'clients.crl'}: {text}", self.daemon.log()), "the warning")
        self.assertRegex(self.axisctl("events", "--kind", "certificate", certificate=shift).stdout, text)
        self.pki("renew", "press-1")
        self.put(self.made("press-1.key"), "server.key")
        self.put(self.made("press-1.crt"), "server.crt")
        wait_for(lambda: self.served(self.made("press-1.crt")), "the new pair")
        done = self.axisctl("config", "reload", certificate=shift)
        self.assertEqual(done.returncode, 0, done)
        self.told(4, "the certificate of panel was revoked", certificate=self.subject.path("panel.crt"))
        config = pathlib.Path(self.subject.config).read_text()
        checked = self.connect("shift-a").system.CheckConfig(system_pb.CheckConfigRequest(yaml=config))
        self.assertRegex(" ".join(found.message for found in checked.findings), r"the CRL has expired")

    def test_not_valid_yet(self):
        self.put(self.issue("press-1", "20400101000000Z", "20410101000000Z"), "server.crt")
        text = "the certificate is not valid before 2040-01-01T00:00:00Z; this computer's clock says 20"
        self.refused_by_check("server.crt", text)
        # A start is tried again: the clock may be wrong.
        self.subject.start_lines()
        done = run([AXISD, "--config", self.subject.config])
        self.assertEqual(done.returncode, 1, done)
        self.assertIn(f"{self.tls / 'server.crt'}: {text}", done.stderr)

    def test_ends_soon(self):
        self.pki("--days", "20", "renew", "press-1")
        self.install()
        self.start()
        text = rf"{self.tls / 'server.crt'}: the certificate expires in 19 days {STAMP}; renew it"
        wait_for(lambda: re.search(text, self.daemon.log()), "the warning")
        told = self.axisctl("events", "--kind", "certificate", certificate=self.made("shift-a.crt"))
        self.assertRegex(told.stdout, text)


class Replaced(Cell):
    def test_under_load_no_call_fails(self):
        self.start()
        clients = [self.connect("shift-a") for _ in range(4)]
        failures, done = [], threading.Event()

        def ask(client):
            """On a connection that stays."""
            while not done.wait(0.001):
                try:
                    client.info()
                except CallFailed as failure:
                    failures.append(failure)

        def connect_anew():
            while not done.wait(0.01):
                client = self.connect("shift-a")
                try:
                    client.info()
                except CallFailed as failure:
                    failures.append(failure)
                client.close()

        threads = [threading.Thread(target=ask, args=(client,)) for client in clients]
        threads += [threading.Thread(target=connect_anew)]
        for thread in threads:
            thread.start()
        try:
            for _ in range(5):
                self.pki("renew", "press-1")
                self.install()
                wait_for(lambda: self.served(self.made("press-1.crt")), "the new certificate")
        finally:
            done.set()
            for thread in threads:
                thread.join()
        self.assertEqual(failures, [])
        self.assertIn("the files were replaced", self.axisctl("events", "--kind", "certificate",
                                                              certificate=self.made("shift-a.crt")).stdout)

    def test_at_once_with_a_reload(self):
        self.start()
        self.pki("renew", "press-1")
        self.install()
        done = self.axisctl("config", "reload", certificate=self.made("shift-a.crt"))
        self.assertEqual(done.returncode, 0, done)
        self.assertTrue(self.served(self.made("press-1.crt")))

    def test_damaged_files_change_nothing(self):
        self.start()
        shift = self.connect("shift-a")
        before = self.shown()
        (self.tls / "server.crt").write_text("nonsense")
        wait_for(lambda: "what was served before stays" in self.daemon.log(), "the complaint")
        self.assertIn(f"{self.tls / 'server.crt'}: no certificate in PEM format", self.daemon.log())
        response = shift.call(shift.system.ReloadConfig, system_pb.ReloadConfigRequest())
        self.assertFalse(response.applied)
        done = self.axisctl("config", "reload", certificate=self.made("shift-a.crt"))
        self.assertNotEqual(done.returncode, 0, done)
        self.assertIn(f"{self.tls / 'server.crt'}: no certificate in PEM format", done.stdout + done.stderr)
        self.assertEqual(self.shown(), before)
        self.connect("shift-a").info()
        # A key without its certificate is as bad; with it, both are served.
        self.pki("renew", "press-1")
        self.put(self.made("press-1.key"), "server.key")
        self.put(self.made("press-1.crt"), "server.crt")
        wait_for(lambda: self.served(self.made("press-1.crt")), "the new pair")
        shift.info()


if __name__ == "__main__":
    unittest.main()
