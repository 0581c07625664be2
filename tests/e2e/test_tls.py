"""Mutual TLS, and no plaintext beyond this host."""
import pathlib
import re
import unittest

import grpc

from certificates import Certificates
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

    def test_mismatched_key(self):
        self.subject.server = self.subject.server.replace(self.ours.path("key", "server"),
                                                          self.ours.path("key", "operator"))
        self.subject.write_config()
        daemon = self.subject.start_daemon(wait=False)
        self.assertEqual(daemon.wait(), 1)
        self.assertIn(self.ours.path("key", "operator"), daemon.log())

    def test_missing_file(self):
        self.subject.server = self.subject.server.replace(self.ours.path("crt"), "/nonexistent/ca.crt")
        self.subject.write_config()
        daemon = self.subject.start_daemon(wait=False)
        self.assertEqual(daemon.wait(), 1)
        self.assertIn("/nonexistent/ca.crt", daemon.log())


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
        self.assertIn(done.returncode, (1, 2), done)
        self.assertIn("TLS", done.stderr.upper())


if __name__ == "__main__":
    unittest.main()
