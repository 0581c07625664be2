"""Roles: by certificates, by the user of a unix socket, and of those whom a delegate speaks for."""
import pathlib
import re
import unittest

import grpc

from certificates import Certificates
from harness import AXISCTL, LIMIT, OWN_NAME, CallFailed, Client, Scenario, axis_pb, feeder, run, system_pb, wait_for
from harness.client import audit_pb
from axisd.v1.access_pb2 import Role  # noqa: E402  (made by the harness)

ROLES = "roles: { shift-a: operator, panel: viewer, service: maintainer }, delegates: { web.press-1: operator }"


class Roles(Scenario):
    def setUp(self):
        super().setUp()
        self.subject = self.machine({"feeder": feeder()})
        self.authority = Certificates(self.subject.directory, "authority")
        for name in ("server", "shift-a", "panel", "service", "web.press-1", "guest"):
            self.authority.issue(name)
        self.tls = (f"{{ listen: 127.0.0.1:0, tls: {{ certificate: {self.authority.path('crt', 'server')}, "
                    f"key: {self.authority.path('key', 'server')}, client_ca: {self.authority.path('crt')} }} }}")
        self.configure(ROLES)
        self.subject.start_lines()
        daemon = self.subject.start_daemon()
        self.port = wait_for(lambda: re.search(r"serves 'e2e' on port (\d+)", daemon.log()), "the port's number")[1]
        self.lane = re.search(r"stops are taken on port (\d+) as well", daemon.log())[1]

    def configure(self, access):
        self.subject.server = f"{self.tls}\naccess: {{ {access} }}"
        self.subject.write_config()

    def connect(self, name, port=None):
        client = Client(f"127.0.0.1:{port or self.port}", grpc.ssl_channel_credentials(
            self.authority.read("crt"), self.authority.read("key", name), self.authority.read("crt", name)))
        self.addCleanup(client.close)
        return client

    def denied(self, what, *arguments, **fields):
        """The message of a call that needs another role."""
        with self.assertRaises(CallFailed) as refused:
            what(*arguments, **fields)
        self.assertEqual((refused.exception.code, refused.exception.reason),
                         (grpc.StatusCode.PERMISSION_DENIED, "REASON_ACCESS_DENIED"))
        return refused.exception.detail.message

    def test_each_may_do_what_its_role_says(self):
        shift, panel, service, guest = (self.connect(name) for name in ("shift-a", "panel", "service", "guest"))
        panel.wait_online("feeder")
        refusals = audit_pb.ListAuditRequest(kinds=[audit_pb.AUDIT_KIND_REFUSAL])
        self.assertEqual(self.denied(panel.motion, "Enable", "feeder"),
                         "Enable needs the role operator on feeder; panel has viewer")
        (denied,) = wait_for(lambda: panel.call(panel.audit.ListAudit, refusals).records, "the refusal is told")
        self.assertEqual((denied.client, denied.role, denied.axis, denied.rpc),
                         ("panel", "viewer", "feeder", "AxisService.Enable"))
        self.assertRegex(denied.peer, r"^ipv4:127\.0\.0\.1:\d+$")
        self.denied(guest.call, guest.audit.ListAudit, refusals)
        self.assertEqual(self.denied(guest.state, "feeder"), "GetAxis needs the role viewer on feeder; guest has none")
        self.assertEqual(shift.to_done("Enable", "feeder").client, "shift-a")
        reload = system_pb.ReloadConfigRequest(dry_run=True)
        self.assertEqual(self.denied(shift.call, shift.system.ReloadConfig, reload),
                         "ReloadConfig needs the role maintainer; shift-a has operator")
        service.call(service.system.ReloadConfig, reload)
        for client in (shift, panel, guest):  # a stop is refused to nobody
            client.to_done("Stop", "feeder")
        guest.call(guest.system.StopAll, system_pb.StopAllRequest())
        self.denied(shift.call, shift.system.ReleaseStopAll, system_pb.ReleaseStopAllRequest())
        service.call(service.system.ReleaseStopAll, system_pb.ReleaseStopAllRequest())
        self.assertEqual(Role.Name(guest.info().role), "ROLE_NONE")

    def test_the_stop_lane_asks_the_same(self):
        panel = self.connect("panel")
        panel.wait_online("feeder")
        lane = self.connect("panel", self.lane)
        stub = lane.channel.unary_unary("/axisd.v1.StopService/Disable",
                                        request_serializer=axis_pb.DisableRequest.SerializeToString,
                                        response_deserializer=axis_pb.DisableResponse.FromString)
        self.assertIn("Disable needs the role operator", self.denied(lane.call, stub, axis_pb.DisableRequest(axis="feeder")))

    def test_whom_a_delegate_speaks_for(self):
        web, shift = self.connect("web.press-1"), self.connect("shift-a")
        shift.wait_online("feeder")

        def enable(client, **names):
            request = axis_pb.EnableRequest(axis="feeder", options={"request_id": "once"})
            try:
                return client.axis.Enable(request, timeout=LIMIT,
                                          metadata=[(f"axisd-{key}", value) for key, value in names.items()]).command
            except grpc.RpcError as error:
                raise CallFailed(error) from None
        first = enable(web, user="anna")
        self.assertEqual(first.client, "anna via web.press-1")
        shift.wait_ended(first)
        self.assertEqual(enable(web, user="anna").id, first.id)
        self.assertNotEqual(enable(web, user="bert").id, first.id, "each has its own request ids")
        self.assertIn("bert via web.press-1 has viewer", self.denied(enable, web, user="bert", role="viewer"))
        self.assertIn("may not speak for others", self.denied(enable, shift, user="anna"))

    def test_a_reload_changes_roles_at_once(self):
        panel, service = self.connect("panel"), self.connect("service")
        panel.wait_online("feeder")
        self.denied(panel.motion, "Enable", "feeder")
        self.configure("roles: { service: maintainer, panel: viewer }, axes: { feeder: { roles: { panel: operator } } }")
        self.assertTrue(service.call(service.system.ReloadConfig, system_pb.ReloadConfigRequest()).applied)
        panel.to_done("Enable", "feeder")
        words = [AXISCTL, "--server", f"127.0.0.1:{self.port}", "--tls-ca", self.authority.path("crt"), "--tls-cert",
                 self.authority.path("crt", "panel"), "--tls-key", self.authority.path("key", "panel"), "whoami"]
        self.assertEqual(run(words).stdout,
                         "client:     panel\nidentity:   panel\nrole:       viewer; operator on feeder\n")


class UnixSocket(Scenario):
    def test_the_user_has_the_role(self):
        subject = self.machine({"feeder": feeder()})
        subject.server = f"{{ listen: \"unix:{subject.socket}\", plaintext: unix }}\naccess: {{ roles: {{ {OWN_NAME}: viewer }} }}"
        subject.write_config()
        subject.start_lines()
        subject.start_daemon()
        client = subject.client
        client.wait_online("feeder")
        self.refused("PERMISSION_DENIED", "ACCESS_DENIED", client.motion, "Enable", "feeder")
        self.assertEqual(client.to_done("Stop", "feeder").client, OWN_NAME)
        self.assertEqual(client.info().program, pathlib.Path("/proc/self/comm").read_text().strip())
        done = subject.axisctl("enable", "feeder")
        self.assertEqual(done.returncode, 4, done)
        self.assertIn("needs the role operator", done.stderr)


if __name__ == "__main__":
    unittest.main()
