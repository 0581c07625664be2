"""What a user is told where a certificate is in the way: axisctl and the Python client, against servers of all kinds."""
import concurrent.futures
import pathlib
import subprocess
import tempfile
import threading
import unittest
import unittest.mock

import grpc

from support import AXISCTL, LIMIT, environment
import axisd

PKI = pathlib.Path(__file__).resolve().parents[2] / "deploy/pki.sh"


def run(*words):
    subprocess.run([str(word) for word in words], check=True, capture_output=True)


class Trouble(unittest.IsolatedAsyncioTestCase):
    @classmethod
    def setUpClass(cls):
        cls.folder = cls.enterClassContext(tempfile.TemporaryDirectory())
        for cell, daemon in (("ours", "press-1"), ("theirs", "press-2")):
            run(PKI, "--dir", cls.path(cell), "init", cell)
            run(PKI, "--dir", cls.path(cell), "server", daemon, "127.0.0.1")
            run(PKI, "--dir", cls.path(cell), "client", "shift-a")
        run(PKI, "--dir", cls.path("ours"), "server", "elsewhere", "press-9.local")
        for name in ("press-1", "shift-a"):
            cls.issue("old", name, "20200101000000Z", "20210101000000Z")
            cls.issue("later", name, "20400101000000Z", "20410101000000Z")

    @classmethod
    def path(cls, name):
        return f"{cls.folder}/{name}"

    @classmethod
    def issue(cls, lead, name, begin, end):
        """Makes LEAD-NAME.crt, for the key of NAME."""
        base, configuration = cls.path(f"ours/{name}"), cls.path("ours/openssl.cnf")
        run("openssl", "req", "-new", "-config", configuration, "-key", f"{base}.key", "-subj", f"/CN={name}", "-out",
            f"{base}.csr")
        run("openssl", "ca", "-config", configuration, "-batch", "-notext", "-startdate", begin, "-enddate", end,
            "-extfile", f"{base}.ext", "-in", f"{base}.csr", "-out", cls.path(f"ours/{lead}-{name}.crt"))

    def serve(self, certificate="ours/press-1.crt", key="ours/press-1.key", tls=True, asks=True, answers=()):
        def read(name):
            return pathlib.Path(self.path(name)).read_bytes()

        server = grpc.server(concurrent.futures.ThreadPoolExecutor(1), handlers=answers)
        if tls:
            credentials = grpc.ssl_server_credentials([(read(key), read(certificate))], read("ours/ca.crt") if asks else None, asks)
            port = server.add_secure_port("127.0.0.1:0", credentials)
        else:
            port = server.add_insecure_port("127.0.0.1:0")
        server.start()
        self.addCleanup(server.stop, None)
        return f"127.0.0.1:{port}"

    async def told(self, server, ca="ours/ca.crt", certificate="ours/shift-a.crt", key="ours/shift-a.key"):
        """The lines of axisctl and of Python, without what leads them."""
        words = [AXISCTL, "--server", server, "--tls-ca", self.path(ca)]
        files = {"tls_ca": self.path(ca)}
        if certificate:
            words += ["--tls-cert", self.path(certificate), "--tls-key", self.path(key)]
            files |= {"tls_certificate": self.path(certificate), "tls_key": self.path(key)}
        done = subprocess.run([*words, "list"], capture_output=True, text=True, env=environment(), timeout=LIMIT,
                              check=False)
        self.assertEqual(done.returncode, 3, done)
        self.assertRegex(done.stderr, r"\Aaxisctl: [^\n]+\n\Z")
        lead = f"cannot reach axisd at {server}: "
        self.assertIn(lead, done.stderr)
        async with axisd.connect(server, **files) as machine:
            with self.assertRaises(axisd.UnreachableError) as raised:
                await machine.info()
        self.assertIn(lead, str(raised.exception))
        return done.stderr.partition(lead)[2].rstrip("\n"), str(raised.exception).partition(lead)[2]

    async def test_no_certificate(self):
        shell, python = await self.told(self.serve(), certificate=None)
        self.assertEqual(shell, "the daemon asks for a certificate of the client; give --tls-cert and --tls-key")
        self.assertEqual(python,
                         "the daemon asks for a certificate of the client; give tls_certificate and tls_key")

    async def test_one_of_another_authority(self):
        shell, python = await self.told(self.serve(), certificate="theirs/shift-a.crt", key="theirs/shift-a.key")
        self.assertEqual(shell, "the daemon does not take certificates of CN=theirs, which signed that of --tls-cert; "
                                "give one of CN=ours")
        self.assertIn("the daemon does not take the certificate of tls_certificate", python)

    async def test_one_that_has_expired(self):
        shell, python = await self.told(self.serve(), certificate="ours/old-shift-a.crt")
        self.assertEqual(shell, "--tls-cert: the certificate has expired (2021-01-01T00:00:00Z); renew it")
        self.assertEqual(python, "tls_certificate: the certificate has expired (2021-01-01T00:00:00Z); renew it")

    async def test_one_that_has_not_begun(self):
        shell, python = await self.told(self.serve(), certificate="ours/later-shift-a.crt")
        self.assertEqual(shell, "--tls-cert: the certificate is not valid before 2040-01-01T00:00:00Z; "
                                "set the clock of this computer, or give another one")
        self.assertEqual(python, shell.replace("--tls-cert", "tls_certificate"))

    async def test_what_may_have_been_done_is_said_as_well(self):
        """The daemon took the call and did not answer: that the certificate has expired since is only half of it."""
        over = threading.Event()

        class Silent(grpc.GenericRpcHandler):
            def service(self, handler_call_details):
                return grpc.unary_unary_rpc_method_handler(lambda request, context: over.wait(LIMIT) and b"")

        server = self.serve(asks=False, answers=(Silent(),))
        self.addCleanup(over.set)
        files = [self.path(f"ours/{name}") for name in ("ca.crt", "old-shift-a.crt", "shift-a.key")]
        words = [AXISCTL, "--server", server, "--stop-server", server, "--timeout", "300ms", "--tls-ca", files[0],
                 "--tls-cert", files[1], "--tls-key", files[2]]
        text = "the certificate has expired (2021-01-01T00:00:00Z); renew it"
        for command, known in ((["list"], "no answer from axisd at "),
                               (["stop", "--all"], "repeated for 300 ms: whether it arrived is not known; ")):
            done = subprocess.run([*words, *command], capture_output=True, text=True, env=environment(), timeout=LIMIT,
                                  check=False)
            self.assertEqual(done.returncode, 3, done)
            self.assertIn(known, done.stderr)
            self.assertTrue(done.stderr.endswith(f"; --tls-cert: {text}\n"), done)
        async with axisd.connect(server, tls_ca=files[0], tls_certificate=files[1], tls_key=files[2], timeout=0.3,
                                 stop_server=server) as machine:
            with self.assertRaises(axisd.UnreachableError) as raised:
                await machine.info()
            self.assertRegex(str(raised.exception), f"no answer from axisd at {server}: .*; tls_certificate: ")
            self.assertFalse(raised.exception.nothing_sent)
            with self.assertRaises(axisd.UnreachableError) as raised:
                await machine.stop_all(wait=False)
            self.assertRegex(str(raised.exception), "tls_certificate: .*repeated for 0.3 s: whether it arrived is not known")

    async def test_key_of_another_certificate(self):
        shell, python = await self.told(self.serve(), key="ours/press-1.key")
        self.assertIn("--tls-key: the key does not belong to the certificate of --tls-cert; ", shell)
        self.assertIn("tls_key: the key does not belong to the certificate of tls_certificate; ", python)

    async def test_daemon_of_another_authority(self):
        shell, python = await self.told(self.serve(), ca="theirs/ca.crt")
        self.assertIn("the daemon's certificate is signed by CN=ours, which is not in --tls-ca; ", shell)
        self.assertIn("the daemon's certificate is not signed by an authority of tls_ca; ", python)

    async def test_daemon_that_has_expired(self):
        for line in await self.told(self.serve("ours/old-press-1.crt")):
            self.assertEqual(line, "the daemon's certificate has expired (2021-01-01T00:00:00Z); renew it there")

    async def test_daemon_that_has_not_begun(self):
        for line in await self.told(self.serve("ours/later-press-1.crt")):
            self.assertEqual(line, "the daemon's certificate is not valid before 2040-01-01T00:00:00Z; "
                                   "compare the clocks of both computers")

    async def test_daemon_of_another_name(self):
        for line in await self.told(self.serve("ours/elsewhere.crt", "ours/elsewhere.key")):
            self.assertIn("the daemon's certificate is for press-9.local, you called 127.0.0.1; ", line)

    async def test_daemon_without_tls(self):
        for line in await self.told(self.serve(tls=False)):
            self.assertIn("the daemon speaks no TLS at that address; ", line)

    async def test_client_without_tls(self):
        server = self.serve()
        done = subprocess.run([AXISCTL, "--server", server, "list"], capture_output=True, text=True, env=environment(),
                              timeout=LIMIT, check=False)
        self.assertEqual(done.returncode, 3, done)
        self.assertIn("the daemon speaks TLS; give --tls-ca", done.stderr)
        for asks in (True, False):
            async with axisd.connect(self.serve(asks=asks)) as machine:
                with self.assertRaisesRegex(axisd.UnreachableError,
                                            "the daemon speaks TLS; give tls_ca, tls_certificate and tls_key"):
                    await machine.info()

    async def test_of_a_daemon_that_is_away_nothing_is_said_of_tls(self):
        async with axisd.connect("127.0.0.1:1") as machine:
            with self.assertRaises(axisd.UnreachableError) as raised:
                await machine.info()
        self.assertNotIn("TLS", str(raised.exception))
        self.assertTrue(raised.exception.nothing_sent)

    def test_wrong_files_are_named_before_anything_is_sent(self):
        good = {"tls_ca": "ours/ca.crt", "tls_certificate": "ours/shift-a.crt", "tls_key": "ours/shift-a.key"}
        wrong = (("tls_ca", "nope", "tls_ca: cannot read '.*/nope': No such file or directory; give a PEM file"),
                 ("tls_ca", "ours/shift-a.key", "tls_ca: there is no certificate in"),
                 ("tls_certificate", "ours/shift-a.key", "tls_certificate: there is no certificate in"),
                 ("tls_key", "ours/shift-a.crt", "tls_key: there is no private key in"))
        for name, file, text in wrong:
            files = {key: self.path(value) for key, value in (good | {name: file}).items()}
            with self.assertRaisesRegex(axisd.ArgumentError, text):
                axisd.connect("localhost:1", **files)

    async def test_the_environment_names_the_files(self):
        """Where the call names none: of a machine, and of the entrance of a cell."""
        class Version(grpc.GenericRpcHandler):
            def service(self, handler_call_details):
                return grpc.unary_unary_rpc_method_handler(lambda request, context: b"")

        server = self.serve(answers=(Version(),))
        named = {"AXISD_TLS_CA": self.path("ours/ca.crt"), "AXISD_TLS_CERT": self.path("ours/shift-a.crt"),
                 "AXISD_TLS_KEY": self.path("ours/shift-a.key")}
        with unittest.mock.patch.dict("os.environ", named):
            async with axisd.connect(server) as machine:
                self.assertEqual((await machine.info()).version, "")
            async with axisd.connect_cell(server) as cell:
                self.assertEqual(await cell.machines(), {})
            async with axisd.connect(server, tls_certificate=self.path("theirs/shift-a.crt"),
                                     tls_key=self.path("theirs/shift-a.key")) as machine:
                with self.assertRaisesRegex(axisd.UnreachableError, "does not take the certificate of tls_certificate"):
                    await machine.info()


if __name__ == "__main__":
    unittest.main()
