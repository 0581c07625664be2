"""The stop lane: stops reach the drives whatever happens at the main address."""
import asyncio
import os
import socket
import unittest

import grpc

from harness import AXISCTL, DONE, OWN_NAME, STOP, CallFailed, Client, Scenario, axis_pb, pb, run, system_pb

import axisd  # noqa: E402  (made by the harness)
from axisd.v1 import stop_service_pb2_grpc  # noqa: E402


class StopLane(Scenario):
    def lane(self, machine):
        client = Client(f"unix:{machine.socket}.stop")
        self.addCleanup(client.close)
        return stop_service_pb2_grpc.StopServiceStub(client.channel)

    def turning(self, machine):
        machine.client.motion("MoveVelocity", "spinner", velocity=5.0)
        machine.client.wait_state("spinner", lambda state: state.velocity > 4, "the spinner turns")

    def stands(self, machine):
        self.assert_state(machine.client.state("spinner"), "STANDSTILL")
        self.assertFalse(machine.lines["line"].shaft(1).moving)

    def test_takes_every_stop_and_nothing_else(self):
        machine = self.ready_spinner()
        lane = self.lane(machine)
        for method, request in ((lane.Halt, axis_pb.HaltRequest), (lane.Stop, axis_pb.StopRequest),
                                (lane.QuickStop, axis_pb.QuickStopRequest)):
            self.turning(machine)
            response = machine.client.call(method, request(axis="spinner", options={"wait_until": DONE}))
            self.assert_command(response.command, "DONE")
            self.stands(machine)
        self.assertEqual(response.command.client, OWN_NAME)
        self.turning(machine)
        machine.client.call(lane.StopAll, system_pb.StopAllRequest(wait_until=DONE))
        self.stands(machine)
        self.assertTrue(machine.client.info().inhibited)
        self.refused("NOT_FOUND", "UNKNOWN_AXIS", machine.client.call, lane.Stop, axis_pb.StopRequest(axis="nobody"))
        here = Client(f"unix:{machine.socket}.stop")
        self.addCleanup(here.close)
        with self.assertRaises(CallFailed) as caught:
            here.state("spinner")
        self.assertIs(caught.exception.code, grpc.StatusCode.UNIMPLEMENTED)

    def test_clients_go_there_by_themselves_and_to_the_main_address_without_it(self):
        machine = self.ready_spinner()
        here, nowhere = f"unix:{machine.socket}", f"unix:{machine.path('nobody')}"
        for server, lane in ((nowhere, here + ".stop"), (here, nowhere), (here, None)):
            self.turning(machine)
            arguments = [AXISCTL, "--server", server] + (["--stop-server", lane] if lane else [])
            done = run([*arguments, "stop", "spinner"])  # it would follow the command at the main address
            self.assertEqual(done.returncode, 0, done.stderr)
            machine.client.wait_state("spinner", lambda state: state.state == pb.STATE_STANDSTILL, "it stands")

            async def stop():
                async with axisd.connect(server, stop_server=lane) as connected:
                    return await connected.axis("spinner").stop()

            self.turning(machine)
            self.assertEqual(asyncio.run(stop()).state.value, "Done")
            self.stands(machine)

    def test_a_jog_is_kept_going_and_ended_there(self):
        machine = self.ready_spinner()
        done = run([AXISCTL, "--server", f"unix:{machine.socket}", "jog", "spinner", "2", "--hold", "500ms", "--for", "2s"])
        self.assertEqual(done.returncode, 0, done.stderr)
        machine.client.wait_state("spinner", lambda state: state.state == pb.STATE_STANDSTILL, "the jog has ended")

    def test_files_that_never_end_hold_up_nobody(self):
        machine = self.ready_spinner()
        pipe = machine.path("pipe.eds")
        os.mkfifo(pipe)
        for device in ("ptmx", "zero"):
            os.symlink(f"/dev/{device}", machine.path(device))
        self.turning(machine)
        served = machine.client.call(machine.client.system.GetConfig, system_pb.GetConfigRequest()).yaml
        for path, why in ((pipe, "no regular file"), (machine.path("ptmx"), "no regular file"),
                          (machine.path("zero"), "no regular file"), ("/dev/ptmx", "is not below"), ("/dev/zero", "is not below")):
            yaml = served.replace("model: ykd2405pr", f"model: cia402\n    drive: {{ eds: {path} }}")
            self.assertIn(path, yaml)
            answer = machine.client.call(machine.client.system.CheckConfig, system_pb.CheckConfigRequest(yaml=yaml))
            self.assertTrue([found for found in answer.findings if why in found.message], answer)
        machine.client.to_done("Stop", "spinner")
        self.stands(machine)

    def test_crowds_keep_nobody_out(self):
        machine = self.ready_spinner()
        lane = self.lane(machine)
        self.turning(machine)
        crowd = []
        for path in [machine.socket] * 300 + [machine.socket + ".stop"] * 300:
            silent = socket.socket(socket.AF_UNIX)
            self.addCleanup(silent.close)
            silent.connect(path)
            crowd.append(silent)
        machine.client.call(lane.Stop, axis_pb.StopRequest(axis="spinner", options={"wait_until": DONE}))
        self.stands(machine)
        done = run([AXISCTL, "--server", f"unix:{machine.socket}", "stop", "--all", "--wait"])
        self.assertEqual(done.returncode, 0, done.stderr)
        self.assertTrue(machine.wire.writes(STOP, 0, node=1))


if __name__ == "__main__":
    unittest.main()
