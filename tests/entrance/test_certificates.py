"""Who calls an entrance, by certificates; whom machines are told of; certificates that are replaced."""
import re
import shutil
import time
import unittest

import grpc

from certificates import Certificates
from harness import LIMIT, OWN_NAME, Client, axis_pb, pb, run, spinner, system_pb, wait_for
from harness.scrape import scrape
from support import AXISD_CELL, HOST, PRESENT, SILENT, CallFailed, CellScenario, cell_pb, cell_service_pb2_grpc

#: The entrance comes by a unix socket, as this user of the computer, and so do the tests themselves.
ACCESS = f"access: {{ roles: {{ {OWN_NAME}: maintainer, cell.hall-1: viewer }}, " \
         f"delegates: {{ {OWN_NAME}: maintainer, cell.hall-1: operator }} }}"


class CertificatesOfCallers(CellScenario):
    def setUp(self):
        super().setUp()
        self.one = self.press(1, start=False)
        self.authority = Certificates(self.one.directory, "authority")
        self.others = Certificates(self.one.directory, "others")
        for name in ("server", "anna", "boss", "panel", "cell.hall-1", "cell.hall-2", "two words"):
            self.authority.issue(name)
        self.others.issue("stranger")
        self.one.server += f"\n{ACCESS}"
        self.one.write_config()
        self.one.start()
        self.keys = (f"tls: {{ certificate: {self.path('crt', 'server')}, key: {self.path('key', 'server')}, "
                     f"client_ca: {self.authority.path('crt')} }}\n"
                     "roles: { anna: operator, boss: maintainer }\n")

    def path(self, suffix, name):
        return self.authority.path(suffix, name)

    def begin(self, keys=""):
        """An entrance at localhost, which the certificates are of."""
        self.here = self.entrance(self.one, keys=self.keys + keys, listen="localhost:0")
        port = wait_for(lambda: re.search(r"; port (\d+)", self.here.program.log()), "it tells its port")[1]
        self.here.address = f"localhost:{port}"
        wait_for(lambda: self.machines(self.connect("panel")).get("press-1") == PRESENT, "its axisd answers")
        return self.here

    def with_certificates(self, axisd_tls):
        """An entrance whose section `axisd` has certificates, too; its own axisd is at a unix socket, without TLS."""
        here = self.entrance(self.one, keys=self.keys, listen="localhost:0", start=False)
        plain = here.text
        here.text = lambda: plain().replace("axisd: { server", f"axisd: {{ {axisd_tls}, server")
        here.start()
        port = wait_for(lambda: re.search(r"; port (\d+)", here.program.log()), "it tells its port")[1]
        here.address = f"localhost:{port}"
        return here

    def connect(self, name, authority=None):
        own = authority or self.authority
        client = Client(self.here.address, grpc.ssl_channel_credentials(
            self.authority.read("crt"), own.read("key", name), own.read("crt", name)))
        client.cell = cell_service_pb2_grpc.CellServiceStub(client.channel)
        self.addCleanup(client.close)
        return client

    def machines(self, client):
        answer = client.call(client.cell.ListMachines, cell_pb.ListMachinesRequest())
        return {machine.name: machine.state for machine in answer.machines}

    def test_machines_are_told_who_it_is(self):
        self.begin()
        command = self.connect("anna").to_done("Enable", "spinner")
        self.assertEqual(command.client, f"anna via {OWN_NAME}")
        client = self.connect("anna")
        self.assertEqual(client.call(client.cell.GetCell, cell_pb.GetCellRequest()).client, "anna")

    def test_whoever_has_no_role_may_look_and_stop(self):
        self.begin()
        panel = self.connect("panel")
        self.assertEqual(panel.state("spinner").axis, "spinner")
        self.refused("PERMISSION_DENIED", "ACCESS_DENIED", panel.motion, "Enable", "spinner")
        stopped = panel.call(panel.axis.Stop, axis_pb.StopRequest(axis="spinner")).command
        self.assertEqual(stopped.client, f"panel via {OWN_NAME}")
        answer = panel.call(panel.cell.StopAll, cell_pb.StopAllRequest(reason="smoke"))
        self.assertEqual([each.outcome for each in answer.machines], [cell_pb.MACHINE_OUTCOME_DONE])
        self.assertEqual(self.one.client.info().inhibited_by, f"panel via {OWN_NAME}")
        for name in ("panel", "anna"):
            client = self.connect(name)
            self.refused("PERMISSION_DENIED", "ACCESS_DENIED", client.call, client.cell.ReleaseStopAll,
                         cell_pb.ReleaseStopAllRequest())
        boss = self.connect("boss")
        answer = boss.call(boss.cell.ReleaseStopAll, cell_pb.ReleaseStopAllRequest())
        self.assertEqual([each.outcome for each in answer.machines], [cell_pb.MACHINE_OUTCOME_DONE], answer)
        self.assertFalse(self.one.client.info().inhibited)

    def test_a_release_needs_the_axisd_beside_the_entrance(self):
        self.begin()
        boss = self.connect("boss")
        boss.call(boss.cell.StopAll, cell_pb.StopAllRequest())
        self.one.daemon.kill()
        self.refused("UNAVAILABLE", "OFFLINE", boss.call, boss.cell.ReleaseStopAll, cell_pb.ReleaseStopAllRequest())
        self.assertEqual(len(boss.call(boss.cell.GetCell, cell_pb.GetCellRequest()).stop_all), 1)

    def test_nobody_speaks_for_others(self):
        self.begin()
        anna = self.connect("anna")
        for claim in ((("axisd-user", "boss"),), (("axisd-role", "maintainer"),)):
            self.refused("PERMISSION_DENIED", "ACCESS_DENIED", self.here.at, "press-1", anna.system.GetInfo,
                         system_pb.GetInfoRequest(), more=claim)

    def test_strangers_are_not_let_in(self):
        self.begin()
        with self.assertRaises(Exception):
            stranger = self.connect("stranger", self.others)
            stranger.call(stranger.cell.GetCell, cell_pb.GetCellRequest(), timeout=5)

    def test_a_name_that_no_axisd_takes(self):
        self.begin()
        client = self.connect("two words")
        self.refused("PERMISSION_DENIED", "ACCESS_DENIED", client.state, "spinner")
        client.call(client.axis.Stop, axis_pb.StopRequest(axis="spinner"))

    def test_only_entrances_exchange_what_they_know(self):
        self.begin()
        request = cell_pb.ExchangeStopAllRequest(cell="hall-1")
        for name in ("anna", "boss", "cell.hall-2"):  # the last: an entrance of another cell
            client = self.connect(name)
            self.refused("PERMISSION_DENIED", "ACCESS_DENIED", client.call, client.cell.ExchangeStopAll, request)
        entrance = self.connect("cell.hall-1")
        entrance.call(entrance.cell.ExchangeStopAll, request)
        self.refused("FAILED_PRECONDITION", "INVALID_ARGUMENT", entrance.call, entrance.cell.ExchangeStopAll,
                     cell_pb.ExchangeStopAllRequest(cell="hall-2"))

    def put(self, name, authority=None):
        """The pair that the entrance shows other machines."""
        for suffix in ("key", "crt"):
            shutil.copy((authority or self.authority).path(suffix, name), f"{self.one.directory}/own.{suffix}")

    def begin_with_another_machine(self):
        """press-2, which is reached by mutual TLS."""
        other = self.machine({"spinner": spinner()}, name="press-2")
        other.server = (f"{{ listen: 127.0.0.1:0, tls: {{ certificate: {self.path('crt', 'server')}, "
                        f"key: {self.path('key', 'server')}, client_ca: {self.authority.path('crt')} }} }}\n{ACCESS}")
        other.write_config()
        other.start_lines()
        daemon = other.start_daemon()
        port = wait_for(lambda: re.search(r"serves 'press-2' on port (\d+)", daemon.log()), "its port")[1]
        lane = re.search(r"stops are taken on port (\d+) as well", daemon.log())[1]
        own = self.one.directory
        self.put("cell.hall-1")
        self.keys += f"peers: {{ press-2: {{ axisd: localhost:{port}, stop: localhost:{lane} }} }}\n"
        self.here = self.with_certificates(
            f"tls: {{ ca: {self.authority.path('crt')}, certificate: {own}/own.crt, key: {own}/own.key }}")
        return self.here

    def test_another_machine_by_mutual_tls(self):
        self.begin_with_another_machine()
        anna = self.connect("anna")
        wait_for(lambda: self.machines(anna).get("press-2") == PRESENT, "press-2 answers")
        for _ in range(2):
            command = self.here.at("press-2", anna.axis.Stop, axis_pb.StopRequest(axis="spinner")).command
            self.assertEqual(command.client, "anna via cell.hall-1")
            self.assertEqual(pb.CommandKind.Name(command.kind), "COMMAND_KIND_STOP")
            # The same again with a certificate that was replaced meanwhile.
            self.authority.issue("cell.hall-1")
            self.put("cell.hall-1")
            wait_for(lambda: "certificates were read again" in self.here.program.log(), "they are read again")
            wait_for(lambda: self.machines(anna).get("press-2") == PRESENT, "press-2 answers")
            time.sleep(1.5)
            wait_for(lambda: self.machines(anna).get("press-2") == PRESENT, "press-2 answers")
        # One that press-2 does not accept.
        self.put("stranger", self.others)
        wait_for(lambda: self.machines(anna).get("press-2") == SILENT, "press-2 does not answer a stranger")

    def events_of_certificates(self, client):
        """What the entrance has told of certificates, a line each."""
        stream = client.cell.WatchEvents(cell_pb.WatchEventsRequest(after_sequence=0), timeout=LIMIT)
        message = next(iter(stream))
        stream.cancel()
        return [event.text for event in message.events if event.kind == cell_pb.CELL_EVENT_KIND_CERTIFICATE]

    def test_when_certificates_end_is_told(self):
        """As an event, 30 days ahead, and as a figure."""
        self.keys += f'metrics: {{ listen: "{HOST}:0" }}\n'
        here = self.begin_with_another_machine()
        anna = self.connect("anna")
        own = f"{self.one.directory}/own.crt"
        text = wait_for(lambda: [each for each in self.events_of_certificates(anna) if own in each], "it is told")[0]
        self.assertIn("the certificate expires in 1 day", text)
        port = wait_for(lambda: re.search(r"metrics at port (\d+)", here.program.log()), "it tells the port")[1]

        def left():
            found = scrape(f"http://{HOST}:{port}/metrics").named("axisd_cell_certificate_expiry_timestamp_seconds")
            return {labels["file"]: (at - time.time()) / 86400 for labels, at in found}
        days = left()
        self.assertEqual(set(days), {"tls.certificate", "tls.client_ca", "axisd.tls.certificate", "axisd.tls.ca"})
        self.assertTrue(1.9 < days["axisd.tls.certificate"] < 2.1, days)
        self.authority.issue("cell.hall-1", days=90)
        self.put("cell.hall-1")
        wait_for(lambda: left()["axisd.tls.certificate"] > 80, "the figure is that of the new one")
        self.authority.issue("server", days=-1)
        wait_for(lambda: any("what was used before stays" in each for each in self.events_of_certificates(anna)),
                 "files that cannot be used are told")

    def test_certificates_that_have_expired(self):
        """Of a caller, of the entrance before other machines, and of the entrance before its callers."""
        here = self.begin_with_another_machine()
        anna = self.connect("anna")
        wait_for(lambda: self.machines(anna).get("press-2") == PRESENT, "press-2 answers")
        self.authority.issue("late", days=-1)
        with self.assertRaises(CallFailed):
            late = self.connect("late")
            late.call(late.cell.GetCell, cell_pb.GetCellRequest(), timeout=5)

        self.authority.issue("cell.hall-1", days=-1)
        self.put("cell.hall-1")
        wait_for(lambda: self.machines(anna).get("press-2") == SILENT, "press-2 lets it in no more")
        own = f"{self.one.directory}/own.crt"
        wait_for(lambda: f"{own}: the certificate has expired" in here.program.log(), "it says why")
        self.assertEqual(self.machines(anna).get("press-1"), PRESENT)
        self.connect("anna").to_done("Enable", "spinner")
        checked = run([AXISD_CELL, "--config", here.config, "--check"])
        self.assertEqual(checked.returncode, 2, checked.stdout)
        self.assertIn(f"{own}: the certificate has expired", checked.stderr)
        self.authority.issue("cell.hall-1")
        self.put("cell.hall-1")
        wait_for(lambda: self.machines(anna).get("press-2") == PRESENT, "press-2 lets it in again")

        # What it serves with stays until there is a better one; a start refuses it.
        self.authority.issue("server", days=-1)
        wait_for(lambda: "what was used before stays" in here.program.log(), "it says so")
        self.assertEqual(self.machines(self.connect("anna")).get("press-1"), PRESENT)
        checked = run([AXISD_CELL, "--config", here.config, "--check"])
        self.assertNotEqual(checked.returncode, 0)
        self.assertIn("the certificate has expired", checked.stderr)


if __name__ == "__main__":
    unittest.main()
