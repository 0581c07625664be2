"""What somebody got wrong, or tries: names, metadata, certificates, configurations and files of a cell."""
import pathlib
import re
import unittest

from harness import ROOT, CallFailed, run, wait_for
from rig import AXIS, CellClient, CellScenario, cell_pb


class OneEntrance(CellScenario):
    """One machine of two runs, known by hand."""

    def setUp(self):
        super().setUp()
        self.one = self.cell(machines=2, members=0)
        self.one.start_axisd("press-1")

    def edit(self, name, change):
        path = pathlib.Path(self.one.path(name, "cell.yaml"))
        path.write_text(change(path.read_text()))

    def refused_at(self, client, call=None):
        with self.assertRaises(CallFailed) as caught:
            (call or (lambda: client.state(AXIS)))()
        return caught.exception

    def test_callers(self):
        self.one.start_entrance("press-1")
        client = CellClient(self.one, "press-1")
        wait_for(lambda: client.states()["press-1"] == "PRESENT", "press-1 is present")
        client.state(AXIS)
        for machine, code, reason in (("press-2", "UNAVAILABLE", "OFFLINE"), ("press-9", "NOT_FOUND", "INVALID_ARGUMENT"),
                                      ("../x", "NOT_FOUND", "INVALID_ARGUMENT")):
            failed = self.refused_at(CellClient(self.one, "press-1", machine))
            self.assertEqual((failed.code.name, failed.reason), (code, f"REASON_{reason}"), machine)
            self.assertTrue(failed.detail.remedy, machine)
        for key, value, code in (("axisd-hops", "1", "FAILED_PRECONDITION"), ("axisd-user", "boss", "PERMISSION_DENIED"),
                                 ("axisd-role", "maintainer", "PERMISSION_DENIED")):
            failed = self.refused_at(CellClient(self.one, "press-1", metadata=[(key, value)]))
            self.assertEqual(failed.code.name, code, key)
        # Whom cell.yaml does not name reads, and stops.
        done = run([str(ROOT / "deploy" / "pki.sh"), "--dir", self.one.path("pki"), "client", "visitor"])
        self.assertEqual(done.returncode, 0, done.stderr)
        visitor = CellClient(self.one, "press-1", user="visitor")
        visitor.state(AXIS)
        failed = self.refused_at(visitor, lambda: visitor.motion("Enable", AXIS))
        self.assertEqual(failed.code.name, "PERMISSION_DENIED")
        visitor.call(visitor.cell.StopAll, cell_pb.StopAllRequest(reason="try"), 10)

    def test_a_loop_is_said_to_be_one(self):
        """The address of press-2's axisd leads to its entrance."""
        self.one.start_axisd("press-2")
        self.one.start_entrance("press-2")
        self.edit("press-1", lambda text: re.sub(r"(press-2: \{ axisd: [0-9.]+):7443", r"\1:7445", text))
        self.one.start_entrance("press-1")
        client = CellClient(self.one, "press-1")
        wait_for(lambda: client.machines()["press-2"].trouble, "something is wrong with press-2")
        self.assertEqual(client.states()["press-2"], "SILENT")
        failed = self.refused_at(CellClient(self.one, "press-1", "press-2"))
        self.assertIn("loop", failed.detail.message + failed.detail.remedy)

    def test_an_address_that_leads_to_another_machine(self):
        self.edit("press-1", lambda text: text.replace(f"axisd: {self.one.address('press-2')}:7443",
                                                       f"axisd: {self.one.address('press-1')}:7443"))
        self.one.start_entrance("press-1")
        client = CellClient(self.one, "press-1")
        trouble = wait_for(lambda: client.machines()["press-2"].trouble, "something is wrong with press-2")
        self.assertIn("press-1", trouble)
        failed = self.refused_at(CellClient(self.one, "press-1", "press-2"))
        self.assertEqual(failed.code.name, "UNAVAILABLE")

    def test_a_file_of_state_that_is_damaged(self):
        """It starts, says so, and goes on with what its configuration has."""
        self.one.start_entrance("press-1")
        client = CellClient(self.one, "press-1")
        wait_for(lambda: client.states()["press-1"] == "PRESENT", "press-1 is present")
        client.call(client.cell.StopAll, cell_pb.StopAllRequest(reason="try"), 10)
        self.one.kill("press-1", "cell")
        files = [path for path in pathlib.Path(self.one.path("press-1", "cell")).iterdir() if path.is_file()]
        self.assertTrue(files)
        for path in files:
            path.write_bytes(b"\xff" * 100)
        program = self.one.start_entrance("press-1")
        wait_for(lambda: "damaged" in program.log(), "it says so")
        client = CellClient(self.one, "press-1")
        wait_for(lambda: client.states() == {"press-1": "PRESENT", "press-2": "SILENT"}, "it goes on")
        self.assertTrue(client.info().inhibited, "the machine's own latch is the machine's")

    def test_configurations_that_cannot_be(self):
        for change, expected in (
                (lambda text: text.replace("cell.key", "server.key", 1).replace("key: ", "key: /nowhere", 1), "nowhere"),
                (lambda text: text.replace("machine: press-1", "machine: Press 1"), "machine"),
                (lambda text: re.sub(r"(?m)^tls:.*$", "", text), "TLS"),
                (lambda text: text + "etcd: { endpoints: [ here ] }\n", "'etcd.endpoints' cannot have 'here'"),
                (lambda text: text + "etcd: { endpoints: [ here:2379 ], ttl: 1 s }\n", "'etcd.ttl' cannot be '1 s'"),
                (lambda text: text + "etcd: { endpoints: [ here:2379 ], ttl: 301 s }\n", "'etcd.ttl' cannot be '301 s'")):
            path = pathlib.Path(self.one.path("press-1", "cell.yaml"))
            kept = path.read_text()
            path.write_text(change(kept))
            program = self.one.start("press-1", "cell", "--check")
            self.assertEqual(program.wait(), 2, program.log() + program.output())
            self.assertIn(expected, program.log())
            path.write_text(kept)


class Registered(CellScenario):
    def test_two_machines_of_one_name(self):
        """The second computer is refused and says who has the name; the first takes its own back at once."""
        cell = self.cell(machines=4, members=1)
        cell.etcd.set_up()
        for what in ("axisd.yaml", "cell.yaml"):  # press-4 is put up as another press-1
            path = pathlib.Path(cell.path("press-4", what))
            path.write_text(path.read_text().replace("machine: press-4", "machine: press-1"))
        for end in ("crt", "key"):
            pathlib.Path(cell.path("press-4", f"cell.{end}")).write_bytes(
                pathlib.Path(cell.path("press-1", f"cell.{end}")).read_bytes())
        for name in ("press-1", "press-4"):
            cell.start_axisd(name)
        cell.start_entrance("press-1")
        first = CellClient(cell, "press-1")
        wait_for(lambda: first.registry() == "OK", "press-1 is registered")
        cell.start_entrance("press-4")
        second = CellClient(cell, "press-4")
        wait_for(lambda: cell.address("press-1") in
                 second.call(second.cell.GetCell, cell_pb.GetCellRequest()).registry_trouble.message,
                 "the second one is refused, and says who has the name")
        self.assertEqual(second.registry(), "DEGRADED")

        cell.kill("press-1", "cell")
        cell.start_entrance("press-1")
        first = CellClient(cell, "press-1")
        wait_for(lambda: first.registry() == "OK", "the first one is registered again", 10)
        self.assertEqual(second.registry(), "DEGRADED")

    def test_etcd_takes_nothing_more(self):
        """Its quota is used up: the registry is degraded, calls go on; afterwards all is whole again."""
        cell = self.cell(machines=2, members=1)
        environment = pathlib.Path(cell.path("press-1", "etcd", "member.env"))
        environment.write_text(re.sub(r"(?m)^ETCD_QUOTA_BACKEND_BYTES=.*$", "ETCD_QUOTA_BACKEND_BYTES=4194304",
                                      environment.read_text()))
        cell.start_all()
        client = CellClient(cell, "press-2")
        whole = {"press-1": "PRESENT", "press-2": "PRESENT"}
        wait_for(lambda: client.states() == whole and client.registry() == "OK", "all are present")
        filler = "x" * 100_000
        for number in range(100):
            if cell.etcd.ask("root", "put", f"/full/{number}", filler).returncode != 0:
                break
        self.assertIn("NOSPACE", cell.etcd.done("root", "alarm", "list"))
        cell.kill("press-2", "cell")
        cell.start_entrance("press-2")
        client = CellClient(cell, "press-2")
        wait_for(lambda: client.states().get("press-1") == "PRESENT", "press-1 is known all the same")
        CellClient(cell, "press-2", "press-1").state(AXIS)
        wait_for(lambda: "space" in client.registry_trouble().message, "it is told why press-2 is not registered")
        self.assertEqual(client.registry(), "DEGRADED")

        cell.etcd.done("root", "del", "--prefix", "/full/")
        revision = re.search(r'"revision":(\d+)', cell.etcd.done("root", "get", "x", "--write-out", "json"))[1]
        cell.etcd.done("root", "compact", revision)
        cell.etcd.done("root", "defrag")
        cell.etcd.done("root", "alarm", "disarm")
        wait_for(lambda: client.states() == whole and client.registry() == "OK", "all is whole again")

    def test_another_authority(self):
        """etcd's certificate is not of the authority that cell.yaml names: degraded, with the reason; the rest works."""
        cell = self.cell(machines=1, members=1)
        done = run([str(ROOT / "deploy" / "pki.sh"), "--dir", cell.path("other"), "init", "other"])
        self.assertEqual(done.returncode, 0, done.stderr)
        path = pathlib.Path(cell.path("press-1", "cell.yaml"))
        head, _, etcd = path.read_text().partition("\netcd:\n")
        path.write_text(f"{head}\netcd:\n" + etcd.replace(cell.path("press-1", "ca.crt"), cell.path("other", "ca.crt")))
        cell.start_all()
        client = CellClient(cell, "press-1")
        self.expect_degraded(client, "etcd at ")

    def expect_degraded(self, client, why):
        """It says why, and its machine works."""
        wait_for(lambda: why in client.registry_trouble().message, why)
        self.assertEqual(client.registry(), "DEGRADED")
        self.assertTrue(client.registry_trouble().remedy)
        wait_for(lambda: client.states()["press-1"] in ("PRESENT", "UNREGISTERED"), "its machine answers")
        client.state(AXIS)

    def test_a_certificate_for_etcd_that_has_expired(self):
        cell = self.cell(machines=1, members=1)
        own, pki = pathlib.Path(cell.path("press-1", "cell.crt")), cell.path("pki")
        good, key, request = own.read_bytes(), cell.path("press-1", "cell.key"), cell.path("late.csr")
        for words in (["-x509toreq", "-in", str(own), "-signkey", key, "-out", request],
                      ["-req", "-in", request, "-CA", f"{pki}/ca.crt", "-CAkey", f"{pki}/ca.key", "-CAcreateserial", "-days",
                       "-1", "-out", str(own)]):
            done = run(["openssl", "x509", "-copy_extensions", "copy", *words])
            self.assertEqual(done.returncode, 0, done.stderr)
        cell.start_all()
        client = CellClient(cell, "press-1")
        self.expect_degraded(client, "etcd at ")
        program = cell.programs["press-1", "cell"]
        wait_for(lambda: f"{own}: the certificate has expired" in program.log(), "it says which one")
        own.write_bytes(good)
        wait_for(lambda: client.registry() == "OK", "it is read again")

    def test_a_cell_that_is_not_its_own(self):
        """etcd permits nothing outside of the cell that the certificate is for."""
        cell = self.cell(machines=1, members=1)
        path = pathlib.Path(cell.path("press-1", "cell.yaml"))
        path.write_text(re.sub(r"(?m)^cell: demo$", "cell: other", path.read_text()))
        cell.start_all()
        client = CellClient(cell, "press-1")
        self.expect_degraded(client, "permission denied")
        self.assertEqual(client.call(client.cell.GetCell, cell_pb.GetCellRequest()).cell, "other")
        self.assertEqual(cell.etcd.done("root", "get", "--prefix", "/axisd/", "--keys-only").strip(), "")


if __name__ == "__main__":
    unittest.main()
