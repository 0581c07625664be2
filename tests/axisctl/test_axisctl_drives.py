"""The real axisctl against the daemon with simulated drives: drives, buses, devices, events."""
import pathlib
import re
import signal
import tempfile
import unittest

import canned  # makes axisd importable
from between import Open
from support import AxisctlTest
from axisd.v1 import drive_service_pb2


class Drives(AxisctlTest):
    def test_statistics_of_each_kind_of_bus(self):
        self.assertRegex(self.ok("bus", "statistics"), r"(?m)^ +1  feeder +\d")
        self.server.answers["GetBusStatistics"] = canned.STATISTICS
        text = self.ok("bus", "statistics")
        self.assertIn("line-a: occupied 25 % of the last 10 s", text)
        self.assertRegex(text, r"(?m)^motion +10 +0 +0 +0\.1 ms +0\.1 ms +0\.1 ms")
        self.assertRegex(text, r"(?m)^ +1  feeder +0 % +9 +1")
        self.assertRegex(text, r"(?m)^ +5 +0 +0 +3 +0 +40")
        self.assertRegex(text, r"(?m)^ +1  feeder .* for 1 min 15 s, 4 probes, next in 250 ms")
        self.assertIn("3 requests are held back", text)
        self.assertEqual(self.json("bus", "statistics")[0]["buses"][0]["classes"][0]["sent"], "10")

    def test_statistics_again_and_again(self):
        self.server.answers["WatchBusStatistics"] = canned.WATCHED_STATISTICS
        watch = ("bus", "statistics", "line-a", "--watch", "--count", "3")
        self.assertEqual(self.ok(*watch).count("line-a: occupied 25 % of the last 10 s"), 3)
        ticks = self.json(*watch, "--period", "500ms")
        self.assertEqual([tick["buses"][0]["utilisation"] for tick in ticks], [0.25] * 3)
        self.assertEqual([call.period.ToMilliseconds() for call in self.server.calls("WatchBusStatistics")], [1000, 500])
        self.fails(2, "bus", "statistics", "--count", "3")

    def test_a_trace_as_text_candump_and_json(self):
        trace = ("trace", "can0", "--for", "1s")
        self.server.answers |= {"ListBuses": canned.BUSES, "TraceBus": canned.TRACE}
        self.assertEqual(self.ok(*trace).splitlines(), ["# 3 frames were lost here",
                                                        "5 can0 tx 605#4041600000000000  # read 6041h:00",
                                                        "6 can0 link bus_off"])
        self.assertIn("\n5 can0 tx 605#4041600000000000\n", self.ok(*trace, "--plain"))
        done = self.run_axisctl(*trace, "--format", "candump")
        self.assertEqual((done.stdout, done.stderr), ("(1700000000.123456) can0 605#4041600000000000\n",
                                                      "can0: 1 frames, 3 were lost\n"))
        first, second = self.json(*trace)
        self.assertEqual((first["lost"], second["frames"][0]["why"]), ("3", "bus_off"))
        self.assertIn("candump is a format for CAN", self.fails(2, "trace", "line-a", "--format", "candump"))
        self.assertIn("there is no bus", self.fails(2, "trace", "nowhere"))
        self.assertEqual(self.fails(2, "trace", "line_a"), "axisctl: there is no bus 'line_a'; did you mean 'line-a'?")
        self.assertIn("cannot be written", self.fails(2, *trace, "--output", "/no/such/directory/file"))

    def test_flight_records(self):
        written = self.ok("bus", "record-now", "line-a").strip()
        self.assertRegex(written, r"^line-a-\S+\.wire$")
        self.assertIn("# bus: line-a\n", self.ok("bus", "record", written))
        self.server.answers["ListFlightRecords"] = canned.FLIGHT_RECORDS
        self.assertRegex(self.ok("bus", "records"), r"line-a-1\.wire +line-a +2023-11-14T22:13:20Z +77 +feeder: Error")

    def test_info(self):
        text = self.ok("drive", "info", "feeder")
        self.assertRegex(text, r"model: +ykd2405pr \(YAKO YKD2405PR, open-loop")
        self.assertRegex(text, r"inputs: +PU DR X0 X1 .*: none, home, positive_limit")
        self.assertRegex(text, r"alarm 2: +overvoltage \(clears itself, then reset\): check the supply")
        self.assertRegex(text, r"EEPROM: +\d+ register")
        self.assertEqual(self.json("drive", "info", "feeder")[0]["model_code"], 0x301)
        self.assertIn("no axis 'nobody'", self.fails(4, "drive", "info", "nobody"))

    def test_parameters_may_be_named_by_address(self):
        self.assertRegex(self.ok("drive", "read", "turntable", "0x0010"), r"current +0x0010 +\d")
        self.ok("drive", "write", "turntable", "0x10=7")
        self.assertEqual(self.server.calls("WriteParameters")[0].values[0].name, "current")
        self.assertIn("no parameter at 2006h:00", self.fails(2, "drive", "read", "feeder", "2006h:00"))
        self.assertIn("write index", self.fails(2, "drive", "read", "feeder", "206h:00"))

    def test_parameters_are_a_table_without_touching_the_bus(self):
        lines = self.ok("drive", "parameters", "feeder").splitlines()
        self.assertRegex(lines[0], r"^NAME +ADDRESS +RANGE +DEFAULT +ACCESS +UNIT +OWNER$")
        rows = {line.split()[0]: line for line in lines}
        self.assertRegex(rows["microstep"], r"^microstep +0x0011 +0\.\.15 +8 +saved +scale\.microstep$")
        self.assertRegex(rows["stop"], r"^stop +0x0028 +0\.\.2 +trigger +use AxisService\.Stop$")
        self.assertEqual(self.server.calls("ReadParameters"), [])

    def test_parameters_by_pattern_with_values(self):
        lines = self.ok("drive", "parameters", "feeder", "*m_speed", "--read", "--describe").splitlines()
        self.assertEqual(len(lines), 2)
        self.assertRegex(lines[1], r"^maximum_speed +0x0023 +-?\d+ +-3000\.\.3000 +60 +read/write +r/min +limits\.velocity +Speed of")
        self.assertEqual(list(self.server.calls("ReadParameters")[0].names), ["maximum_speed"])
        names = [line.split()[0] for line in self.ok("drive", "parameters", "feeder", "speed").splitlines()[1:]]
        self.assertLess({"start_speed", "maximum_speed", "segment_1_speed"}, set(names))
        self.assertEqual(len(self.ok("drive", "parameters", "feeder", "m*").splitlines()), 6)
        self.assertIn("no parameter of ykd2405pr fits 'xyz'; without a pattern all are listed",
                      self.fails(2, "drive", "parameters", "feeder", "xyz"))
        self.assertIn("fits 'sped'; did you mean 'speed'?", self.fails(2, "drive", "parameters", "feeder", "sped"))
        # What cannot be read is not asked for.
        self.ok("drive", "parameters", "feeder", "--read")
        self.assertNotIn("stop", self.server.calls("ReadParameters")[-1].names)
        (listed,) = self.json("drive", "parameters", "feeder", "start_speed", "--read")
        self.assertEqual((len(listed["parameters"]), listed["values"][0]["value"]), (1, "5"))

    def test_read_and_write(self):
        self.assertRegex(self.ok("drive", "read", "feeder", "start_speed"), r"start_speed +0x0020 +5 +r/min")
        text = self.ok("drive", "write", "turntable", "current=0x7", "lock_current=0")
        self.assertRegex(text, r"(?s)current +0x0010 +7.*lock_current +0x0012 +0")
        (request,) = self.server.calls("WriteParameters")
        self.assertEqual([(v.name, v.value) for v in request.values], [("current", 7), ("lock_current", 0)])
        self.assertEqual(self.json("drive", "read", "turntable", "current")[0]["values"][0]["value"], "7")
        self.assertEqual(self.fails(4, "drive", "read", "feeder", "curent"),
                         'axisctl: feeder: ykd2405pr has no parameter "curent"; did you mean current?')
        self.assertEqual(self.fails(4, "drive", "write", "turntable", "stop=1"),
                         "axisctl: turntable: line-a node 2 register 0x0028: stop triggers an action; use axisctl stop")
        self.assertIn("maximum_speed is decided by limits.velocity; change it there",
                      self.fails(4, "drive", "write", "turntable", "maximum_speed=-100"))
        self.assertIn("disable the axis first", self.fails(4, "drive", "write", "feeder", "current=7"))

    def test_bad_assignments_reach_nothing(self):
        for text in ("current", "=3", "current=", "current=six", "current=0x", "current=--3"):
            self.fails(2, "drive", "write", "feeder", text)
        self.fails(2, "drive", "write", "feeder")
        self.assertEqual(self.server.calls("WriteParameters"), [])

    def test_save_and_restore_need_the_name_again(self):
        self.assertIn("--confirm", self.fails(2, "drive", "save", "feeder"))
        self.assertIn("repeat the axis's name", self.fails(4, "drive", "restore", "feeder", "--confirm", "yes"))
        self.assertIn("saved", self.ok("drive", "save", "turntable", "--confirm", "turntable"))
        self.server.answers["RestoreFactory"] = canned.RESTORED
        self.assertIn("next power-up: node by its switches, 9600 8N1",
                      self.ok("drive", "restore", "feeder", "--confirm", "feeder"))

    def test_segments(self):
        self.ok("disable", "feeder", "--wait")
        self.assertEqual(self.ok("drive", "segments", "feeder"), "no segments\n")
        text = self.ok("drive", "segments", "feeder", "--position", "2:-50mm:24mm/s", "--position",
                       "1:50mm:24mm/s:100ms", "--velocity", "2:8mm/s")
        self.assertRegex(text, r"1 +50 mm +24 mm/s +100 ms\n +2 +-50 mm +24 mm/s +8 mm/s")
        (request,) = self.server.calls("WriteSegments")
        self.assertEqual([(r.number, r.target, r.velocity) for r in request.segments.positions],
                         [(2, -50, 24), (1, 50, 24)])
        with tempfile.TemporaryDirectory() as directory:
            path = pathlib.Path(directory) / "table.json"
            path.write_text(self.ok("--json", "drive", "segments", "feeder"))
            self.ok("drive", "segments", "feeder", "--clear")
            self.assertEqual(self.ok("drive", "segments", "feeder"), "no segments\n")
            self.ok("drive", "segments", "feeder", "--set", str(path))
            again = self.server.calls("WriteSegments")[-1].segments
            self.assertEqual([(r.number, r.target, r.velocity) for r in again.positions], [(1, 50, 24), (2, -50, 24)])
            self.assertEqual([(r.number, r.velocity) for r in again.velocities], [(2, 8)])
            path.write_text("{")
            self.assertIn("not a segment table", self.fails(2, "drive", "segments", "feeder", "--set", str(path)))
        for text in ("1:5mm", "0:5mm:1mm/s", "1:5deg:1mm/s", "1:2:3:4ms:5"):
            self.fails(2, "drive", "segments", "feeder", "--position", text)
        self.assertIn("give one of", self.fails(2, "drive", "segments", "feeder", "--clear", "--absolute"))

    def test_readdress_says_what_is_left_to_do(self):
        self.assertIn("confirm", self.fails(4, "drive", "readdress", "feeder", "7", "--confirm", "x"))
        self.server.answers["Readdress"] = canned.changed("Readdress")
        lines = self.ok("drive", "readdress", "feeder", "7", "--confirm", "feeder").splitlines()
        self.assertIn("switch the drive off and on. SW1 to SW5 must be off", lines[0])
        self.assertIn("'node: 7' under 'axes: feeder:'", lines[-1])
        self.server.answers["Readdress"] = canned.changed("Readdress", verified=True)
        text = self.ok("drive", "readdress", "feeder", "7", "--confirm", "feeder", "--verify", "60s")
        self.assertRegex(text, r"(?s)saved in the drive.*waiting.*found\. it answers.*the configuration must say so")
        self.assertEqual(self.server.calls("Readdress")[2].verify.seconds, 60)

    def test_set_serial(self):
        self.server.answers["SetSerial"] = canned.changed("SetSerial")
        text = self.ok("drive", "set-serial", "feeder", "--baud", "9600", "--format", "8E1", "--confirm", "feeder")
        self.assertIn("'baud: 9600, format: 8E1' of its bus", text)
        (request,) = self.server.calls("SetSerial")
        self.assertEqual((request.baud, request.format), (9600, "8E1"))
        self.ok("drive", "set-serial", "feeder", "--format", "8N1", "--confirm", "feeder")
        self.assertFalse(self.server.calls("SetSerial")[1].HasField("baud"))
        self.assertIn("--baud", self.fails(2, "drive", "set-serial", "feeder", "--confirm", "feeder"))

    def test_ctrl_c_ends_the_looking(self):
        self.server.answers["Readdress"] = Open(canned.changed("Readdress", verified=True)[:2])
        status, shown = self.on_terminal("drive", "readdress", "feeder", "7", "--confirm", "feeder", "--verify",
                                         "600s", interrupt_at=r"waiting")
        self.assertEqual(status, 130, shown)
        self.assertIn("what was saved in the drive stays", shown)

    def test_state_shows_cause_drift_and_wear(self):
        self.server.answers |= {"GetAxis": canned.DRIFTED, "ListAxes": canned.LISTED}
        text = self.ok("state", "turntable")
        self.assertRegex(text, r"(?s)drift: +X1 has no function.*motion: +started by a terminal.*EEPROM: +12 registers")
        self.assertRegex(self.ok("list"), r"turntable .*started by a terminal, drift: X1 has no function")


class Buses(AxisctlTest):
    def test_a_scan_finds_the_drives(self):
        self.assertRegex(self.ok("bus", "scan", "line-a", "--nodes", "1-3"), r"\n +2 +115200 +8N1 +ykd2405pr +V1\.0 +10000 +turntable\n")

    def test_scan_ends_with_lines_for_the_configuration(self):
        self.server.answers["Scan"] = canned.SCAN
        text = self.ok("bus", "scan", "line-a", "--nodes", "1-10", "--baud", "9600,115200", "--format", "8N1,8E1",
                       "--reply-timeout", "20ms")
        self.assertRegex(text, r"\n +1 +115200 +8N1 +ykd2405pr +V1\.0 +10000 +feeder\n")
        self.assertRegex(text, r"\n +8 +115200 +8N1 +unknown +garbled replies")
        self.assertTrue(text.endswith("  axis-5:\n    bus: line-a\n    node: 5\n    model: ykd2405pr\n    unit: rev\n"
                                      "    scale: { microstep: 2000 pulses/rev }\n    limits: { velocity: 1 rev/s }\n"))
        (request,) = self.server.calls("Scan")
        self.assertEqual((request.first_node, request.last_node, list(request.bauds), list(request.formats),
                          request.reply_timeout.nanos), (1, 10, [9600, 115200], ["8N1", "8E1"], 20_000_000))

    def test_yaml_only_loads(self):
        self.server.answers["Scan"] = canned.SCAN
        fragment = self.ok("bus", "scan", "line-a", "--yaml")
        with tempfile.TemporaryDirectory() as directory:
            path = pathlib.Path(directory) / "machine.yaml"
            path.write_text("machine: press-1\nbuses:\n  line-a:\n    modbus_rtu: { port: sim }\naxes:\n" + fragment)
            self.assertIn("axes: 1", self.ok("check", str(path)))

    def test_scan_shows_progress_on_a_terminal(self):
        self.server.answers["Scan"] = canned.SCAN
        status, shown = self.on_terminal("bus", "scan", "line-a")
        self.assertEqual(status, 0, shown)
        self.assertRegex(shown, r"line-a  \d+ of 127  \[#* *\]  \d found")

    def test_an_interrupted_scan_shows_what_was_found(self):
        self.server.answers["Scan"] = Open(canned.SCAN_BEGUN)
        status, shown = self.on_terminal("bus", "scan", "line-a", interrupt_at=r"1 found")
        self.assertEqual(status, 130, shown)
        self.assertRegex(shown, r"9 +9600 +8N1 +\S*unknown")

    def test_nothing_found_and_bad_ranges(self):
        self.assertEqual(self.ok("bus", "scan", "line-a", "--nodes", "20"), "line-a: no node answered\n")
        self.assertEqual(self.server.calls("Scan")[0].last_node, 20)
        done = self.run_axisctl("bus", "scan", "line-a", "--nodes", "20", "--yaml")
        self.assertEqual((done.returncode, done.stdout, done.stderr), (0, "", "line-a: no node answered\n"))
        for nodes in ("0-5", "1-", "a", "1-300"):
            self.fails(2, "bus", "scan", "line-a", "--nodes", nodes)

    def test_read_and_write(self):
        self.assertRegex(self.ok("bus", "read", "line-a", "1", "0x10", "2"), r"0x0010 +0x000\d +\d +\d\n0x0011 +0x000")
        self.assertIn("node 1 belongs to axis 'feeder'", self.fails(4, "bus", "write", "line-a", "1", "0", "1"))
        self.server.between.calls.clear()
        self.server.answers["Transact"] = canned.REGISTERS
        text = self.ok("bus", "read", "line-a", "9", "0x10", "2")
        self.assertRegex(text, r"0x0010 +0xFFFF +65535 +-1\n0x0011 +0xFFFE +65534 +-2\n")
        self.assertEqual(self.server.calls("Transact")[0].address, 16)
        self.assertIn("3 registers written", self.ok("bus", "write", "line-a", "9", "16", "-5", "0xFF", "7"))
        self.assertEqual(list(self.server.calls("Transact")[1].write.values), [65531, 255, 7])
        self.assertIn("permitted: -32768 to 65535", self.fails(2, "bus", "write", "line-a", "9", "0", "65536"))

    def test_objects_of_a_can_network(self):
        self.server.answers |= {"ListBuses": canned.BUSES, "Transact": canned.OBJECT}
        for command in (("read", "can0", "5", "6041h:00"), ("transact", "can0", "5", "read", "6041h:00")):
            self.assertRegex(self.ok("bus", *command), r"6041h:00 +37 02 +567\n")
        self.assertEqual(self.server.calls("Transact")[0].address, 0x604100)
        self.ok("bus", "read", "can0", "5", "6041h:00", "--type", "i16")
        self.assertEqual(self.server.calls("Transact")[2].read_object.type, drive_service_pb2.ParameterType.Value("PARAMETER_TYPE_INT16"))
        self.assertEqual(self.ok("bus", "write", "can0", "9", "6200h:01", "-3", "--type", "i8"),
                         "can0 node 9: 6200h:01 written\n")
        number = self.server.calls("Transact")[3].write_object.number
        self.assertEqual((number.value, number.type), (-3, drive_service_pb2.ParameterType.Value("PARAMETER_TYPE_INT8")))
        self.ok("bus", "transact", "can0", "9", "write", "6200h:01", "0x10", "--type", "u8")
        self.assertIn("give --type", self.fails(2, "bus", "write", "can0", "9", "6200h:01", "1"))
        self.assertIn("6041h:00", self.fails(2, "bus", "read", "can0", "9", "620h:01"))
        self.assertRegex(self.ok("bus", "read", "can0", "5", "6041h"), r"6041h:00 +37 02 +567\n")
        self.assertIn("give the sub-index to write, such as 6200h:00",
                      self.fails(2, "bus", "write", "can0", "9", "6200h", "1", "--type", "u8"))
        self.assertIn("permitted: u8", self.fails(2, "bus", "read", "can0", "9", "6200h:01", "--type", "u9"))
        self.server.answers["Transact"] = canned.REGISTERS
        self.assertIn("2 registers written", self.ok("bus", "transact", "line-a", "9", "write", "16", "1", "2"))
        self.assertRegex(self.ok("bus", "transact", "line-a", "9", "read", "0x10"), r"0x0010 +0xFFFF")

    def test_a_scan_of_a_can_network_shows_identities(self):
        self.server.answers |= {"ListBuses": canned.BUSES, "Scan": canned.CAN_SCAN}
        text = self.ok("bus", "scan", "can0")
        self.assertRegex(text, r"NODE +BIT/S +MODEL +PROFILE +VENDOR +PRODUCT")
        self.assertRegex(text, r"5 +500000 +ykd2405pr +402 +0x00000100 +0x00000003 +4000\n")
        self.assertRegex(text, r"9 +500000 +unknown +401 +valves\n")
        self.assertRegex(text, r"22 +500000 +unknown +it sends, but answers no SDO\n")
        self.assertIn("  axis-5:\n    bus: can0\n    node: 5\n", text)

    def test_a_scan_as_json_is_one_object(self):
        self.server.answers["Scan"] = canned.SCAN
        (scan,) = self.json("bus", "scan", "line-a", "--nodes", "1-10")
        self.assertEqual([node["node"] for node in scan["found"]], [1, 5, 8])

    def test_list_and_status(self):
        self.server.answers["ListBuses"] = canned.BUSES
        text = self.ok("bus", "list")
        self.assertEqual(text, self.ok("buses"))
        self.assertRegex(text, r"line-a +sim +115200 +1234 .*open, simulated\n")
        self.assertRegex(text, r"can0 +can0 +500000 +1001 +2002 +7 +505 +6 +7 +808 +9 +10 +22 23 +error passive, ")
        details = self.ok("bus", "status", "can0")
        self.assertIn("SYNC:          every 10 ms, running; 808 sent, 9 missed", details)
        self.assertIn("foreign nodes: 22 23\n", details)
        self.assertNotIn("line-a", details)
        self.assertIn("RS-485 line", self.ok("bus", "status"))
        self.assertIn("there is no bus 'can7'", self.fails(2, "bus", "status", "can7"))
        self.assertEqual([bus["name"] for bus in self.json("bus", "status", "can0")[0]["buses"]], ["can0"])

    def test_devices(self):
        self.server.answers |= {"ListDevices": canned.DEVICES, "WriteDevice": canned.WRITTEN}
        self.assertRegex(self.ok("device", "list"), r"valves +line-a +40 +pressure +2\.5 +bar +read/write +online\n")
        self.assertEqual(self.ok("device", "write", "valves", "pressure", "3.04bar"), "valves pressure = 3 bar\n")
        self.assertEqual(self.server.calls("WriteDevice")[0].value, 3.04)
        self.assertIn("bar", self.fails(2, "device", "write", "valves", "pressure", "3mm"))


class Events(AxisctlTest):
    def test_all_that_are_kept(self):
        self.server.answers["WatchEvents"] = canned.EVENTS
        lines = self.ok("events").splitlines()
        self.assertEqual(lines, [
            "2023-11-14T22:13:20.123Z  1  feeder  Standstill -> DiscreteMotion, started by a terminal",
            "2023-11-14T22:13:20.124Z  2  feeder  X0 home on (within 20 ms)",
            "2023-11-14T22:13:20.125Z  3  ghost  offline: no reply",
            "2023-11-14T22:13:20.126Z  4  turntable  drift: X1 has no function"])

    def test_filters_and_since(self):
        def axes(*words):
            return {line.split()[2] for line in self.ok("events", *words).splitlines()}
        self.assertEqual(axes("feeder", "ghost"), {"feeder", "ghost"})
        self.assertEqual(axes("--kind", "link"), {"feeder", "turntable", "ghost", "sticky"})
        self.assertNotIn("StopAll", self.ok("events", "--kind", "terminal,link"))
        first, *_, last = self.ok("events").splitlines()
        self.assertEqual(first.split()[1], "1")
        self.assertEqual(self.ok("events", "--since", str(int(last.split()[1]) - 1)), f"{last}\n")
        self.assertIn(f"{last}\n", self.ok("events", "--since", "10min"))
        self.assertEqual(self.ok("events", "--since", "now"), "")
        self.assertIn("permitted: terminal, state", self.fails(2, "events", "--kind", "noise"))
        self.assertIn("'yesterday' is neither a number nor a time", self.fails(2, "events", "--since", "yesterday"))
        self.assertEqual({event["axis"] for event in self.json("events", "feeder")}, {"feeder"})

    def test_follow_until_ctrl_c(self):
        status, shown = self.on_terminal("events", "--follow", interrupt_at=r"turntable")
        self.assertEqual(status, 0, shown)


class Help(AxisctlTest):
    def test_every_command_has_help(self):
        for group in ("drive", "bus", "device"):
            text = self.ok(group, "--help")
            self.assertIn("Example", text)
            for name in re.findall(r"(?m)^  ([a-z-]+) {2,}[A-Z]", text.partition("Subcommands:")[2]):
                self.assertIn("Usage: axisctl", self.ok(group, name, "--help"))


if __name__ == "__main__":
    signal.alarm(600)  # a hang names itself instead of blocking a test run
    unittest.main()
