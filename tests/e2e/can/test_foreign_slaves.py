"""axisd against drives that nobody of this project wrote: a CANopen library from npm with data sheets of makers, and CiA 402
by its text (tests/foreign). What these drives do is compared with their own shafts."""
import pathlib
import re
import shutil
import unittest

from harness import Axis, CanScenario, error_pb, pb
from harness.foreign import ForeignSlave, makers_file

NODE, LIMITS = 5, (-2, 60)  # revolutions; 10 mm each
HOME_AT = 5.0                # mm: what the negative limit switch is called
RPM = 1 / 60


def slide(eds, counts, drive=""):
    """A slide on a spindle, with limit switches."""
    return Axis(NODE, "can0", model="cia402", reboot_guard="250 ms", unit="mm",
                scale=f"{{ microstep: {counts} pulses/rev, travel: 10 mm/rev }}",
                limits="{ position: [0, 600], velocity: 100 mm/s, acceleration_time: 150 ms }", jog_travel="10 mm",
                homing=f"{{ method: negative_limit, velocity: 50 mm/s, search_velocity: 5 mm/s, position: {HOME_AT}, "
                       "backoff: 5 mm, timeout: 60 s }",
                inputs="{ NEG: negative_limit, POS: positive_limit }",
                drive=f"{{ eds: {eds}{', ' if drive else ''}{drive} }}")


class ForeignSlaves(CanScenario):
    def bring_up(self, name, counts, velocity, acceleration, drive=""):
        eds = makers_file(name)
        if not eds.exists():
            self.skipTest(f"{eds} is not there; name the folder of makers' files in AXISD_EDS_FOLDER")
        machine = self.idle_cell({"slide": slide(eds, counts, drive)}, sync_period="50 ms")
        slave = ForeignSlave(machine.directory, "vcan0", NODE, eds, counts, velocity, acceleration, LIMITS)
        self.addCleanup(slave.close)
        machine.start_daemon()
        machine.client.wait_online("slide")
        return machine, slave

    def cruising(self, slave, turns_per_second):
        """The true speed comes within 1 % of this, and stays there; nothing is ever faster."""
        most = abs(turns_per_second) * 1.01

        def reached(shaft):
            self.assertLessEqual(abs(shaft["speed"]), most)
            return abs(shaft["speed"] - turns_per_second) <= 0.01 * abs(turns_per_second)
        slave.wait(reached, f"the shaft turns at {turns_per_second} r/s")
        self.assertTrue(reached(slave.shaft), slave.shaft)

    def rests(self, machine, slave, starts):
        slave.wait(lambda shaft: not shaft["moving"], "the shaft rests")
        self.assertEqual(slave.shaft["starts"], starts)
        state = machine.client.wait_state("slide", lambda s: not s.moving, "it is known to rest")
        self.assertEqual(slave.shaft["starts"], starts)
        return state

    def true_position(self, slave):
        return HOME_AT + (slave.shaft["turns"] - LIMITS[0]) * 10

    def homed(self, machine, slave, starts):
        """Enabled and homed at the switch, which takes one start."""
        client = machine.client
        client.to_done("Enable", "slide")
        self.assertEqual(slave.shaft["starts"], starts)
        client.to_done("Home", "slide")
        state = self.rests(machine, slave, starts + 1)
        self.assertEqual(state.trust, pb.POSITION_TRUST_HOMED, state)
        self.assertAlmostEqual(slave.shaft["turns"], LIMITS[0], delta=0.1)
        self.assertAlmostEqual(state.position, HOME_AT, delta=0.2)

    def everything(self, *drive, **keys):
        machine, slave = self.bring_up(*drive, **keys)
        self.assertEqual((slave.shaft["starts"], slave.shaft["state"]), (0, "disabled"))
        self.homed(machine, slave, 0)
        self.moves_and_stops(machine, slave)
        self.another_master(machine, slave)
        self.faults(machine, slave)
        self.restarts(machine, slave)

    def moves_and_stops(self, machine, slave):
        client = machine.client
        move = client.motion("MoveAbsolute", "slide", position=120.0, velocity=60.0)
        self.cruising(slave, 6)
        self.assert_command(client.wait_ended(move), "DONE")
        state = self.rests(machine, slave, 2)
        self.assertAlmostEqual(self.true_position(slave), 120, delta=1)  # home is where the switch let go of it
        self.assertAlmostEqual(state.position, 120, delta=0.1)
        client.motion("MoveVelocity", "slide", velocity=-30.0)
        self.cruising(slave, -3)
        client.to_done("Halt", "slide")
        self.rests(machine, slave, 3)
        client.motion("MoveVelocity", "slide", velocity=30.0)
        self.cruising(slave, 3)
        client.to_done("Stop", "slide")
        self.assert_state(self.rests(machine, slave, 4), "STANDSTILL")
        for start, name in ((5, "Halt"), (6, "Stop"), (7, "QuickStop")):
            client.motion("MoveAbsolute", "slide", position=20.0 if start == 6 else 500.0, velocity=90.0)
            self.cruising(slave, -9 if start == 6 else 9)
            client.to_done(name, "slide")
            self.rests(machine, slave, start)
        state = client.state("slide")
        self.assertAlmostEqual(self.true_position(slave), state.position, delta=1)

    def another_master(self, machine, slave):
        """What it starts is stopped, and both it and the stop are events."""
        client = machine.client
        if not client.state("slide").enabled:  # a quick stop may end with a released shaft
            client.to_done("Enable", "slide")
        client.to_done("MoveAbsolute", "slide", position=100.0, velocity=60.0)
        before = slave.shaft["starts"]
        client.wait_state("slide", lambda s: not s.moving, "it is known to rest")
        self.write(0x607A, (0).to_bytes(4, "little"))
        self.write(0x6040, (0x1F).to_bytes(2, "little"))
        slave.wait(lambda shaft: shaft["starts"] == before + 1, "the other master starts it")
        self.rests(machine, slave, before + 1)
        self.assertGreater(self.true_position(slave), HOME_AT + 20, "it was left to go on")
        told = self.done(machine, "events", "slide")
        self.assertRegex(told, "another master writes [0-9A-F]{4}h:00 by SDO")
        # The drive does not hold what axisd wrote: it counts as restarted.
        state = client.wait_state(
            "slide", lambda s: s.trust == pb.POSITION_TRUST_UNKNOWN and s.link == pb.LINK_STATE_ONLINE, "it is set up anew")
        if state.state == pb.STATE_ERROR_STOP:
            client.to_done("Reset", "slide")
        self.homed(machine, slave, before + 1)

    def write(self, index, value):
        """By SDO, as another master: expedited, sub-index 0."""
        command = 0x23 | (4 - len(value)) << 2
        self.peer().send(0x600 + NODE, bytes([command, index & 0xFF, index >> 8, 0]) + value.ljust(4, b"\0"))

    def faults(self, machine, slave):
        client = machine.client
        if not client.state("slide").enabled:  # a quick stop may end with a released shaft
            client.to_done("Enable", "slide")
        before = slave.shaft["starts"]
        move = client.motion("MoveAbsolute", "slide", position=100.0, velocity=60.0)
        slave.wait(lambda shaft: shaft["moving"], "it moves")
        slave.hand("fault 8976")  # 2310h
        ended = self.ended(machine, move)
        self.assertEqual(ended.cause.reason, error_pb.REASON_ALARM, ended)
        state = client.wait_state("slide", lambda s: s.alarm_code == 0x2310, "the alarm is shown")
        self.assert_state(state, "ERROR_STOP")
        self.rests(machine, slave, before + 1)
        client.to_done("Stop", "slide")  # ends with the one that the alarm began
        slave.hand("mend")
        client.to_done("Reset", "slide")
        state = client.state("slide")
        self.assertEqual((state.alarm_code, state.enabled), (0, False), state)
        self.assertIn(slave.shaft["state"], ("disabled", "ready"))
        self.homed(machine, slave, before + 1)

    def restarts(self, machine, slave):
        """By another master in mid-move, and by its supply at rest: it stays as it is until a client enables it."""
        client = machine.client
        before = client.state("slide").drive_reboots
        move = client.motion("MoveAbsolute", "slide", position=300.0, velocity=60.0)
        slave.wait(lambda shaft: shaft["moving"], "it moves")
        self.peer().send(0x000, bytes([0x81, NODE]))
        self.ended(machine, move)
        self.new_life(machine, slave, reboots=before + 1)
        slave.cut()
        self.offline(machine, "slide")
        slave.start()
        self.new_life(machine, slave, reboots=before + 2)

    def new_life(self, machine, slave, reboots):
        state = machine.client.wait_state(
            "slide", lambda s: s.drive_reboots == reboots and s.link == pb.LINK_STATE_ONLINE, "the restart is reported")
        self.assertEqual((state.trust, state.enabled), (pb.POSITION_TRUST_UNKNOWN, False), state)
        self.assertEqual((slave.shaft["starts"], slave.shaft["turns"]), (0, 0))
        if state.state == pb.STATE_ERROR_STOP:
            machine.client.to_done("Reset", "slide")
        self.homed(machine, slave, 0)
        machine.client.to_done("MoveRelative", "slide", distance=20.0)
        self.rests(machine, slave, 2)

    def test_maxon(self):
        """r/min, by 60A9h and 60AAh; no 6067h."""
        self.everything("maxon-epos4.eds", 4096, velocity=RPM, acceleration=RPM)

    def test_nanotec(self):
        """Positions in 0.1 degrees (60A8h), r/min (60A9h)."""
        self.everything("nanotec-cl4-e-1-12.eds", 3600, velocity=RPM, acceleration=RPM)

    def test_elmo(self):
        """Counts per second."""
        self.everything("elmo.eds", 4096, velocity=1 / 4096, acceleration=1 / 4096, drive="velocity_unit: pulses_per_second")

    def test_faulhaber(self):
        """r/min, ramps in r/s per second: nothing in the file tells it; no 603Fh."""
        self.everything("faulhaber-605-3150-67-b.eds", 3000, velocity=RPM, acceleration=1,
                        drive="velocity_unit: rpm, acceleration_unit: rev_per_second")

    def test_trinamic(self):
        """Of those that are part of the project: runs everywhere."""
        self.everything("trinamic-tmcm-1636.eds", 4096, velocity=1 / 4096, acceleration=1 / 4096,
                        drive="velocity_unit: pulses_per_second")

    def test_never_seen_before(self):
        """As docs/any-drive.md says: scan, what the scan prints, the maker's file as it is, check, reload, move."""
        machine = self.machine({}, networks={"can0": {"interface": "vcan0", "sync_period": "50 ms"}})
        sheet = makers_file("trinamic-tmcm-1636.eds")
        slave = ForeignSlave(machine.directory, "vcan0", NODE, sheet, 4096, 1 / 4096, 1 / 4096, LIMITS)
        self.addCleanup(slave.close)
        machine.start_daemon()
        scan = self.done(machine, "bus", "scan", "can0", "--yaml")
        self.assertIn("node: 5\n    model: cia402\n", scan)
        name = re.search(r"eds: (\S+)", scan)[1]
        shutil.copy(sheet, machine.path(name))
        config = pathlib.Path(machine.config)
        config.write_text(config.read_text() + scan.replace("4000 pulses/rev", "4096 pulses/rev"))
        missing = machine.axisctl("check", machine.config)
        self.assertEqual(missing.returncode, 2, missing)
        self.assertIn("velocity_unit", missing.stderr)
        config.write_text(config.read_text().replace("# velocity_unit: UNIT", "velocity_unit: pulses_per_second"))
        self.done(machine, "check", machine.config)
        self.done(machine, "config", "reload")
        machine.client.wait_online("axis-5")
        self.assertIn("axis-5", self.done(machine, "list"))
        self.done(machine, "enable", "axis-5", "--wait")
        self.done(machine, "move", "axis-5", "--relative", "2.5rev", "--velocity", "1rev/s", "--wait")
        slave.wait(lambda shaft: not shaft["moving"], "the shaft rests")
        self.assertAlmostEqual(slave.shaft["turns"], 2.5, delta=0.01)
        self.assertEqual(slave.shaft["starts"], 1)

    def done(self, machine, *words):
        """What axisctl printed; it has to succeed."""
        done = machine.axisctl(*words)
        self.assertEqual(done.returncode, 0, done)
        return done.stdout


if __name__ == "__main__":
    unittest.main()
