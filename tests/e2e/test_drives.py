"""Three models on one line with the real programs: parameters, address, scan, terminals, what must not be mixed up."""
import json
import pathlib
import unittest

from harness import AXISCTL, Axis, Scenario, run, wait_for


def drive(model, node, simulated="", **keys):
    """An axis in revolutions, 1000 pulses each, with an input that nothing else uses."""
    keys = {"model": model, "unit": "rev", "scale": "{ microstep: 1000 pulses/rev }",
            "limits": "{ velocity: 10 rev/s, acceleration_time: 150 ms }"} | keys
    return Axis(node, simulated=simulated, **keys)


def three(**keys):
    return {"ykd": drive("ykd2405pr", 1, **keys), "ssd": drive("ssd2608pr", 2, **keys),
            "ess": drive("ess42-r", 3, **keys)}


class Drives(Scenario):
    def printed(self, machine, *words):
        """JSON objects that axisctl printed, one per line."""
        done = machine.axisctl("--json", *words)
        self.assertEqual(done.returncode, 0, done)
        return [json.loads(line) for line in done.stdout.splitlines()]

    def answers(self, machine, node):
        return machine.axisctl("bus", "read", "line", str(node), "0x0000").returncode == 0

    def test_every_model_moves_and_shows_its_catalogue(self):
        machine = self.machine(three()).start()
        for name, registers in (("ykd", 148), ("ssd", 173), ("ess", 171)):
            with self.subTest(axis=name):
                machine.client.to_done("Enable", name)
                machine.client.to_done("MoveRelative", name, distance=2.5)
                (answer,) = self.printed(machine, "drive", "parameters", name)
                self.assertEqual(len(answer["parameters"]), registers)
                self.assertEqual(machine.sim.shaft(machine.axes[name].node).starts, 1)

    def test_a_written_parameter_is_in_the_drive(self):
        machine = self.machine(three()).start()
        done = machine.axisctl("drive", "write", "ess", "speed_smoothing=6", "position_proportional=17")
        self.assertEqual(done.returncode, 0, done)
        self.assertEqual([machine.sim.peek(register, node=3) for register in (0x0118, 0x0119)], [6, 17])
        for words, text in ((("ess", "speed_smoothing=1025"), "out of range"), (("ess", "start=5"), "MoveAbsolute"),
                            (("ess", "speed_smothing=7"), "speed_smoothing"), (("ess", "microstep=0"), "scale.microstep")):
            done = machine.axisctl("drive", "write", *words)
            self.assertEqual((done.returncode, done.stdout), (4, ""), done)
            self.assertIn(text, done.stderr)
        self.assertEqual(machine.sim.peek(0x0118, node=3), 6)

    def test_an_eeprom_is_saved_to_so_often_a_day_also_by_the_next_daemon(self):
        limits = "{ velocity: 10 rev/s, eeprom_saves_per_day: 3 }"
        machine = self.machine({"ykd": drive("ykd2405pr", 1, limits=limits)}).start()

        def save():
            return machine.axisctl("drive", "save", "ykd", "--confirm", "ykd")
        saves = 0
        while (done := save()).returncode == 0 and saves < 10:
            saves += 1
        self.assertIn(saves, (2, 3))  # the switch that ends saving may count, too
        for _ in range(2):
            self.assertEqual((done.returncode, done.stdout), (4, ""), done)
            self.assertIn("3 times in the last 24 h, where limits.eeprom_saves_per_day permits 3", done.stderr)
            self.assertIn("UTC", done.stderr)
            machine.daemon.terminate()
            machine.start_daemon()
            machine.client.wait_online("ykd")
            done = save()

    def test_what_an_eeprom_took_is_reported_with_its_time(self):
        machine = self.machine({"ykd": drive("ykd2405pr", 1)}).start()

        def report(*since):
            return json.loads(machine.axisctl("--json", "report", "ykd", *since).stdout)
        before = report()["eeprom_writes_total"]
        newest = json.loads(machine.axisctl("--json", "audit", "--last", "1").stdout)["number"]
        self.assertEqual(machine.axisctl("drive", "save", "ykd", "--confirm", "ykd").returncode, 0)
        whole = wait_for(lambda: next((found for found in [report()] if found["eeprom_writes"] > before), None),
                         "the writes are in the audit")
        self.assertEqual(whole["eeprom_writes"], whole["eeprom_writes_total"])
        self.assertEqual(report("--since", newest)["eeprom_writes"], whole["eeprom_writes_total"] - before)
        self.assertRegex(machine.axisctl("audit", "ykd", "--kind", "eeprom").stdout,
                         r"ykd  -  \d+ registers? saved to the drive's EEPROM, \d+ in all\n")

    def test_another_address_counts_after_a_power_cycle(self):
        machine = self.machine({"ssd": drive("ssd2608pr", 40, simulated="dip=0")}).start()
        done = machine.axisctl("drive", "readdress", "ssd", "41", "--confirm", "ssd")
        self.assertEqual(done.returncode, 0, done)
        self.assertIn("off and on", done.stdout)
        self.assertEqual(machine.sim.peek(0x0002, node=40), 40)
        machine.sim.control("power 40 off")
        machine.sim.control("power @1 on")
        wait_for(lambda: self.answers(machine, 41), "answers at 41")
        machine.client.wait_state("ssd", lambda state: state.link == 1, "offline at its old address")

    def test_the_scan_finds_other_rates_and_prints_what_loads(self):
        machine = self.machine({"ykd": drive("ykd2405pr", 1)})
        machine.axes["hidden"] = drive("ssd2608pr", 2, simulated="dip_baud=19200")
        machine.start_lines()
        del machine.axes["hidden"]
        machine.write_config()
        machine.start_daemon()
        machine.client.wait_online("ykd")
        done = machine.axisctl("bus", "scan", "line", "--nodes", "1-2", "--baud", "19200,115200", "--yaml")
        self.assertEqual(done.returncode, 0, done)
        self.assertIn("ssd2608pr", done.stdout)
        self.assertNotIn("ykd2405pr", done.stdout)
        whole = pathlib.Path(machine.path("pasted.yaml"))
        whole.write_text(pathlib.Path(machine.config).read_text() + done.stdout)
        self.assertEqual(run([AXISCTL, "check", str(whole)]).returncode, 0, whole.read_text())
        # The line's own drive was not disturbed, and its rate is the line's again.
        machine.client.to_done("Enable", "ykd")
        machine.client.to_done("MoveRelative", "ykd", distance=1)
        done = machine.axisctl("bus", "scan", "line", "--nodes", "1-2", "--baud", "19200")
        self.assertEqual(done.returncode, 4, done)
        self.assertIn("ykd", done.stderr)

    def test_the_wrong_model_is_named_with_the_right_one(self):
        machine = self.machine({"press": drive("ess42-r", 1)})
        machine.axes["press"].keys["model"] = "ssd2608pr"
        machine.start_lines()
        machine.axes["press"].keys["model"] = "ess42-r"
        machine.start_daemon()
        state = machine.client.wait_state("press", lambda now: "answers where" in now.link_error.message, "an error")
        self.assertIn("ssd2608pr", state.link_error.message)
        self.assertIn("ess42-r", state.link_error.message)

    def test_two_drives_on_one_address_are_reported_as_such(self):
        machine = self.machine({"press": drive("ykd2405pr", 1)})
        machine.axes["twin"] = drive("ykd2405pr", 1)
        machine.start_lines()
        del machine.axes["twin"]
        machine.start_daemon()
        state = machine.client.wait_state("press", lambda now: "address" in now.link_error.message, "an error")
        self.assertEqual(state.link_error.node, 1)
        for address in (1, 2):
            self.assertEqual(machine.sim.control(f"shaft @{address}").split()[-1], "starts=0")

    def test_an_edge_is_told_with_its_interval(self):
        machine = self.machine(three(inputs="{ X0: { function: home, active: low } }")).start()
        machine.sim.control("input 2 X1 on")
        machine.client.wait_state("ssd", lambda now: now.inputs[1].active, "X1 active")
        text = json.dumps(self.printed(machine, "events", "ssd", "--kind", "terminal"))
        self.assertIn("X1", text)
        self.assertIn("before", text)


if __name__ == "__main__":
    unittest.main()
