"""Mutual TLS, and no plaintext beyond this host."""
import contextlib
import pathlib
import re
import socket
import unittest

import grpc

from certificates import Certificates, openssl
from harness import AXISCTL, AXISD, CallFailed, Client, Scenario, feeder, run, system_pb, wait_for


class MutualTls(Scenario):
    def setUp(self):
        super().setUp()
        self.subject = self.machine({"feeder": feeder()})
        directory = self.subject.directory
        self.ours, self.theirs = Certificates(directory, "ours"), Certificates(directory, "theirs")
        for name in ("server", "operator"):
            self.ours.issue(name)
        self.theirs.issue("stranger")
        tls = (f"{{ certificate: {self.ours.path('crt', 'server')}, key: {self.ours.path('key', 'server')}, "
               f"client_ca: {self.ours.path('crt')} }}")
        self.subject.server = f"{{ listen: 127.0.0.1:0, tls: {tls} }}"
        self.subject.write_config()

    def connect(self, authority=None, name=None):
        if authority is None:
            credentials = grpc.ssl_channel_credentials(self.ours.read("crt"))
        else:
            credentials = grpc.ssl_channel_credentials(self.ours.read("crt"), authority.read("key", name),
                                                       authority.read("crt", name))
        client = Client(f"127.0.0.1:{self.port}", credentials)
        self.addCleanup(client.close)
        return client

    def test_only_with_a_certificate_of_ours(self):
        self.subject.start_lines()
        daemon = self.subject.start_daemon()
        self.port = wait_for(lambda: re.search(r"serves 'e2e' on port (\d+)", daemon.log()), "the port's number")[1]
        operator = self.connect(self.ours, "operator")
        operator.wait_online("feeder")
        command = operator.to_done("Enable", "feeder")
        self.assertEqual(command.client, "operator")
        for client in (self.connect(), self.connect(self.theirs, "stranger"), Client(f"127.0.0.1:{self.port}")):
            self.addCleanup(client.close)
            with self.assertRaises(CallFailed) as refused:
                client.info()
            self.assertEqual(refused.exception.code, grpc.StatusCode.UNAVAILABLE)
        operator.call(operator.system.StopAll, system_pb.StopAllRequest())
        self.assertEqual(operator.info().inhibited_by, "operator")

        words = [AXISCTL, "--server", f"127.0.0.1:{self.port}", "--tls-ca", self.ours.path("crt")]
        ours = ["--tls-cert", self.ours.path("crt", "operator"), "--tls-key", self.ours.path("key", "operator")]
        done = run([*words, *ours, "state", "feeder"])
        self.assertEqual(done.returncode, 0, done.stderr)
        done = run([*words, "state", "feeder"])
        self.assertEqual(done.returncode, 3, done.stderr)
        self.assertRegex(done.stderr, r"\Aaxisctl: [^\n]+\n\Z")

    def test_strangers_do_not_fill_the_log(self):
        self.subject.start_lines()
        daemon = self.subject.start_daemon()
        port = wait_for(lambda: re.search(r"serves 'e2e' on port (\d+)", daemon.log()), "the port's number")[1]
        lane = wait_for(lambda: re.search(r"stops are taken on port (\d+)", daemon.log()), "that of stops")[1]
        before = len(daemon.log().splitlines())
        for number in (port, lane):
            for _ in range(300):
                with contextlib.suppress(OSError), socket.create_connection(("127.0.0.1", int(number)), timeout=1) as stranger:
                    stranger.sendall(b"no handshake of TLS" * 20)
                    stranger.recv(1)  # until it is heard, or cut off
        wait_for(lambda: re.search(r" more like this in the last 10 s\n", daemon.log()), "the others are counted")
        wait_for(lambda: re.search(r"connections ended before anybody was identified", daemon.log()), "those of the lane, too")
        self.assertLess(len(daemon.log().splitlines()) - before, 150, daemon.log())

    def refused_files(self, *findings, start=2):
        """Nobody starts with such files, nor calls them right: one line each, at its key. `start`: how a start ends."""
        self.subject.write_config()
        lines = pathlib.Path(self.subject.config).read_text().splitlines()
        (number,) = [number for number, line in enumerate(lines, 1) if "tls:" in line]
        expected = sorted((lines[number - 1].index(path) + 1, f"{path}: {what}") for path, what in findings)
        daemon = run([AXISD, "--check", "--config", self.subject.config])
        self.assertEqual((daemon.returncode, daemon.stdout), (2, ""), daemon)
        self.assertEqual(len(daemon.stderr.splitlines()), len(findings), daemon)
        for line, (column, text) in zip(daemon.stderr.splitlines(), expected):
            self.assertTrue(line.startswith(f"{self.subject.config}:{number}:{column}: {text}"), (line, column, text))
        checked = run([AXISCTL, "check", self.subject.config])
        self.assertEqual(checked.returncode, 2, checked)
        self.assertEqual(checked.stderr.splitlines()[:-1], daemon.stderr.splitlines())
        started = run([AXISD, "--config", self.subject.config])
        self.assertEqual(started.returncode, start, started)
        for path, what in findings:
            self.assertIn(f"{path}: {what}", started.stderr)
        if start == 2:
            self.assertEqual((started.stdout, started.stderr), ("", daemon.stderr))
        self.assertEqual(run([AXISCTL, "check", "--elsewhere", self.subject.config]).returncode, 0)

    def replace(self, old, new):
        self.subject.server = self.subject.server.replace(old, new)

    def test_sound_files(self):
        for done in (run([AXISCTL, "check", self.subject.config]),
                     run([AXISD, "--check", "--config", self.subject.config])):
            self.assertEqual((done.returncode, done.stderr), (0, ""), done)

    def test_mismatched_key(self):
        other = self.ours.path("key", "operator")
        self.replace(self.ours.path("key", "server"), other)
        self.refused_files((other, "the key does not belong to the certificate"))

    def test_missing_files(self):
        self.replace(self.ours.path("crt"), "/nonexistent/ca.crt")
        self.replace(self.ours.path("key", "server"), "/nonexistent/server.key")
        self.refused_files(("/nonexistent/ca.crt", "cannot read: No such file or directory"),
                           ("/nonexistent/server.key", "cannot read: No such file or directory"))

    def test_unreadable_files(self):
        folder, endless = self.subject.directory, "/dev/zero"
        self.replace(self.ours.path("key", "server"), f"{folder}/.")
        self.replace(self.ours.path("crt", "server"), endless)
        self.refused_files((f"{folder}/.", "cannot read: Is a directory"), (endless, "too large for a PEM file"))

    def test_not_pem(self):
        broken = pathlib.Path(self.subject.path("broken.pem"))
        broken.write_text("-----BEGIN CERTIFICATE-----\nnonsense\n-----END CERTIFICATE-----\n")
        self.replace(self.ours.path("crt", "server"), str(broken))
        self.replace(self.ours.path("crt"), self.subject.config)
        self.refused_files((str(broken), "certificate 1 is not readable"),
                           (self.subject.config, "no certificate in PEM format"))

    def test_expired(self):
        expired = self.subject.path("expired.crt")
        openssl("x509", "-in", self.ours.path("crt"), "-signkey", self.ours.path("key"), "-days", "-1", "-out", expired)
        self.replace(self.ours.path("crt"), expired)
        # A start is tried again: the clock may be wrong, or somebody renews it.
        self.subject.start_lines()
        self.refused_files((expired, "the certificate has expired"), start=1)
        # Beside one that is valid, an old authority harms nobody.
        pathlib.Path(expired).write_bytes(pathlib.Path(expired).read_bytes() + self.ours.read("crt"))
        self.assertEqual(run([AXISCTL, "check", self.subject.config]).returncode, 0)

    def test_a_stop_needs_no_certificate(self):
        self.replace(self.ours.path("crt"), "/nonexistent/ca.crt")
        self.subject.write_config()
        self.subject.start_lines()
        done = self.subject.quiesce()
        self.assertEqual((done.returncode, done.stdout), (0, "feeder: standstill confirmed\n"), done)


class Plaintext(Scenario):
    def test_refused_off_loopback(self):
        for listen in ("0.0.0.0:0", "\"[::]:0\"", "192.0.2.1:7443"):
            machine = self.machine({"feeder": feeder()}, server=f"{{ listen: {listen} }}")
            done = run([AXISD, "--config", machine.config])
            self.assertEqual(done.returncode, 2, done)
            self.assertRegex(done.stderr, rf"\A{machine.config}:3:\d+: .*tls")

    def test_nor_on_the_command_line(self):
        machine = self.machine({"feeder": feeder()})
        done = run([AXISD, "--config", machine.config, "--listen", "0.0.0.0:0"])
        self.assertEqual(done.returncode, 2, done)
        self.assertIn("TLS", done.stderr.upper())


if __name__ == "__main__":
    unittest.main()
