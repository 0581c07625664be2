"""The real axisctl against the daemon with simulated drives: every subcommand, its output and its exit status."""
import json
import os
import pathlib
import re
import shutil
import signal
import socket
import subprocess
import tempfile
import unittest
import unittest.mock

import canned  # makes axisd importable
from harness.programs import OWN_NAME
from support import AXISCTL, LIMIT, AxisctlTest, environment

ID = r"[0-9a-f]+-\d+"  # of a command


class Reading(AxisctlTest):
    def test_list_is_an_aligned_table_that_shows_simulated(self):
        lines = self.ok("list").splitlines()
        self.assertRegex(lines[0], r"^AXIS +STATE +POSITION")
        self.assertEqual(len(lines), 5)
        self.assertRegex(lines[1], r"^feeder +Standstill +0 +mm +0 +mm/s +homed +online +ykd2405pr +line-a +1 +simulated")
        self.assertEqual(lines[1].index("Standstill"), lines[0].index("STATE"))
        self.assertRegex(lines[3], r"^ghost +Offline .*no reply")
        self.assertNotIn("\x1b", "".join(lines))

    def test_json_of_several_axes_is_one_object(self):
        for wait in (["--wait"], []):
            (listed,) = self.json("enable", "feeder", "turntable", *wait)
            self.assertEqual([command["axis"] for command in listed["commands"]], ["feeder", "turntable"])
        done = self.run_axisctl("--json", "stop", "nobody", "feeder")
        self.assertEqual([command["axis"] for command in json.loads(done.stdout)["commands"]], ["feeder"])
        self.assertEqual(json.loads(done.stderr)["error"]["exit_status"], done.returncode)

    def test_tables_fit_the_terminal_and_are_whole_in_a_pipe(self):
        for columns in (80, 60):
            status, shown = self.on_terminal("list", env={"COLUMNS": str(columns)})
            self.assertEqual(status, 0, shown)
            lines = re.sub(r"\x1b\[\d*m", "", shown).splitlines()
            self.assertLessEqual(max(map(len, lines)), columns, shown)
            self.assertIn("simulated", shown)
            self.assertNotIn("line-a ", lines[1])
        self.assertRegex(self.run_axisctl("list", env={"COLUMNS": "60"}).stdout, r"ykd2405pr +line-a +1 +simulated")

    def test_list_as_json_keeps_the_names_of_the_proto(self):
        (response,) = self.json("list")
        feeder = response["axes"][0]
        self.assertEqual((feeder["axis"], feeder["state"], feeder["stop_held"]), ("feeder", "STATE_STANDSTILL", False))

    def test_list_names_are_for_completion(self):
        self.assertEqual(self.ok("list", "--names").split(), ["feeder", "turntable", "ghost", "sticky"])

    def test_state(self):
        text = self.ok("state", "feeder")
        self.assertRegex(text, r"axis: +feeder \(simulated\)")
        self.assertRegex(text, r"position: +0 mm \(homed, counted pulses\)")
        self.assertRegex(text, r"inputs: .*, X0 home=on, X1=off")
        self.assertRegex(self.ok("state", "ghost"), r"link error: +line-b node 9 .*: no reply; check power, wiring")
        self.assertEqual(self.json("state", "turntable")[0]["unit"], "deg")

    def test_unknown_axis(self):
        self.assertEqual(self.fails(4, "state", "fedeer"),
                         "axisctl: fedeer: there is no axis 'fedeer'; did you mean 'feeder'?")

    def test_watch_prints_a_line_per_tick_off_a_terminal(self):
        lines = self.ok("watch", "--period", "10ms", "--count", "3", "feeder", "turntable").splitlines()
        self.assertEqual([line.split()[0] for line in lines], ["1", "2", "3"])
        self.assertRegex(lines[0], r"feeder Standstill 0 mm 0 mm/s  turntable Disabled [-.0-9]+ deg 0 deg/s")
        self.assertEqual(self.server.calls("WatchAxes")[0].period.nanos, 10_000_000)
        self.assertEqual(len(self.json("watch", "--period", "10ms", "--count", "2")), 2)

    def test_watch_of_chosen_fields(self):
        words = ("watch", "--period", "10ms", "--count", "1", "--fields", "link,position,link_error.reason", "feeder", "ghost")
        self.assertEqual(self.ok(*words),
                         "1  feeder link=LINK_STATE_ONLINE position=0 link_error.reason=-"
                         "  ghost link=LINK_STATE_OFFLINE position=0 link_error.reason=REASON_NO_REPLY\n")
        self.assertEqual(list(self.server.calls("WatchAxes")[0].fields.paths), ["link", "position", "link_error.reason"])
        (batch,) = self.json(*words)
        self.assertEqual(batch["axes"][1], {"axis": "ghost", "link": "LINK_STATE_OFFLINE", "position": 0,
                                            "link_error": {"reason": "REASON_NO_REPLY"}})
        self.assertEqual(batch["tick"], "1")
        status, shown = self.on_terminal("watch", "--period", "20ms", "--fields", "unit", interrupt_at=r"turntable +deg")
        self.assertEqual(status, 0, shown)
        self.assertRegex(shown, r"(?s)AXIS.*unit.*turntable  deg")

    def test_watch_redraws_in_place_on_a_terminal_and_ends_with_ctrl_c(self):
        status, shown = self.on_terminal("watch", "--period", "20ms", interrupt_at=r"\x1b\[5A.*\x1b\[5A")
        self.assertEqual(status, 0, shown)
        self.assertIn("\x1b[?25h", shown)  # the cursor is back

    def test_watch_of_an_unknown_axis_is_refused(self):
        self.assertIn("no axis 'nobody'", self.fails(4, "watch", "nobody"))

    def test_buses(self):
        self.assertRegex(self.ok("buses"), r"line-a +sim +115200 +\d+ .*open, simulated")
        self.server.answers["ListBuses"] = canned.BUSES
        text = self.ok("buses")
        self.assertRegex(text, r"line-a +sim +115200 +1234 .*open, simulated")
        self.assertIn("closed: /dev/ttyUSB7: No such file or directory; check the adapter", text)
        self.assertIn("not cycled after bus-off: there is no link helper; enable axisd-link.socket", text)
        self.assertEqual(self.json("buses")[0]["buses"][0]["transactions"], "1234")

    def test_info(self):
        self.assertRegex(self.ok("info"), r"machine: +press-1\n(.*\n)*motion: +permitted")
        self.assertTrue(self.json("info")[0]["instance_id"])
        self.assertRegex(self.ok("info"), rf"you: +{OWN_NAME}, maintainer; operator on ghost\n")

    def test_who_am_i(self):
        self.assertEqual(self.ok("whoami"), f"client:     {OWN_NAME}\nidentity:   {OWN_NAME}\n"
                                            "role:       maintainer; operator on ghost\n")
        self.assertEqual(self.json("whoami")[0]["role"], "ROLE_MAINTAINER")

    def test_log_level(self):
        self.assertEqual(self.ok("log-level"), "info\n")
        self.assertRegex(self.ok("log-level", "debug"), r"\Adebug; info before, and at the next start")
        self.assertEqual(self.ok("log-level"), "debug\n")
        self.assertEqual(self.json("log-level", "warn")[0]["previous"], "LOG_LEVEL_DEBUG")
        self.assertIn("LEVEL", self.fails(2, "log-level", "verbose"))

    def test_whom_it_speaks_for(self):
        self.assertIn(f"client:     bert via {OWN_NAME}\n", self.ok("--as", "bert", "whoami"))
        self.assertEqual(self.ok("--as", "bert:viewer", "whoami").splitlines()[::2],
                         [f"client:     bert via {OWN_NAME}", "role:       viewer"])
        self.server.answers["GetInfo"] = canned.NOT_HEEDED
        self.assertIn("--as bert is not heeded: unix:anna may not speak for others", self.ok("--as", "bert", "whoami"))
        self.assertNotIn("not heeded", self.ok("whoami"))


class Motion(AxisctlTest):
    def test_move_prints_id_state_and_what_was_granted_differently(self):
        text = self.ok("move", "feeder", "120mm", "--velocity", "50mm/s", "--acceleration-time", "150ms",
                       "--deceleration-time", "0.2s")
        self.assertRegex(text, rf"^{ID}  feeder  MoveAbsolute  (Accepted|Active)  "
                               r"granted velocity 48 mm/s \(asked 50 mm/s\)\n$")
        (request,) = self.server.calls("MoveAbsolute")
        self.assertEqual((request.position, request.velocity), (120, 50))
        self.assertEqual((request.acceleration_time.nanos, request.deceleration_time.nanos),
                         (150_000_000, 200_000_000))
        self.assertRegex(request.options.request_id, r"^[0-9a-f]{8}-[0-9a-f]{4}-4[0-9a-f]{3}-[89ab][0-9a-f]{3}-")

    def test_negative_values(self):
        self.ok("set-position", "feeder", "50", "--wait")
        self.ok("move", "feeder", "--relative", "-10mm", "--wait")
        self.ok("move", "feeder", "-.5", "--relative", "--wait")
        self.assertEqual([r.distance for r in self.server.calls("MoveRelative")], [-10, -0.5])
        self.ok("velocity", "feeder", "-20mm/s", "--hold", "300ms")
        self.assertEqual(self.server.calls("MoveVelocity")[0].velocity, -20)

    def test_wait_ends_with_the_result(self):
        lines = self.ok("move", "feeder", "30", "--wait").splitlines()
        self.assertEqual(len(lines), 2)
        self.assertRegex(lines[1], rf"^{ID}  feeder  MoveAbsolute  Done after \d+(\.\d+)? m?s$")
        (command,) = self.json("move", "feeder", "0", "--wait")
        self.assertEqual(command["state"], "COMMAND_STATE_DONE")

    def test_wait_shows_progress_on_a_terminal(self):
        status, shown = self.on_terminal("move", "feeder", "300", "--velocity", "320", "--wait")
        self.assertEqual(status, 0, shown)
        self.assertRegex(shown, r"feeder  \d+(\.\d+)? mm  320 mm/s  \[#+ *\]  \d+ %  \d\.\d s")
        self.assertRegex(shown.splitlines()[-1], r"Done after")

    def test_a_motion_that_ends_otherwise_has_status_1(self):
        self.daemon.simulate("block", "sticky", "on")
        done = self.run_axisctl("move", "sticky", "--relative", "90", "--wait")
        self.daemon.simulate("block", "sticky", "off")
        self.assertEqual(done.returncode, 1)
        self.assertIn("Error after", done.stdout)
        self.assertRegex(done.stdout, "the drive came to rest at .* mm, .* from its target; check what holds or loads the shaft")
        self.assertRegex(self.ok("list"), r"sticky +ErrorStop")
        self.ok("reset", "sticky", "--wait")
        self.assertRegex(self.ok("list"), r"sticky +Standstill")

    def test_refusals_are_one_line_with_range_and_remedy(self):
        self.assertEqual(self.fails(4, "move", "feeder", "500"),
                         "axisctl: feeder: target 500 mm is beyond a software limit (permitted 0 to 400 mm); "
                         "choose a target within the limits")
        self.assertRegex(self.fails(4, "move", "ghost", "1"), r"^axisctl: ghost: line-b node 9\b.*: .*; ")
        self.assertEqual(self.fails(4, "home", "turntable"),
                         "axisctl: turntable: line-a node 2: the power stage is off; enable the axis first: axisctl enable "
                         "turntable")

    def test_units_must_be_those_of_the_axis(self):
        self.assertIn("mm", self.fails(2, "move", "feeder", "10deg"))
        self.assertIn("mm/s", self.fails(2, "move", "feeder", "10", "--velocity", "5mm"))
        self.assertIn("--acceleration-time", self.fails(2, "move", "feeder", "10", "--acceleration-time", "150"))
        self.assertIn("position", self.fails(2, "move", "feeder", "nan"))
        self.assertEqual(self.server.calls("MoveAbsolute"), [])

    def test_other_units_of_the_same_measure_are_converted(self):
        self.ok("move", "feeder", "12cm", "--velocity", "3m/min")
        self.assertEqual([(r.position, r.velocity) for r in self.server.calls("MoveAbsolute")], [(120, 50)])
        self.ok("enable", "turntable", "--wait")
        self.ok("velocity", "turntable", "30 rpm", "--hold", "300ms")
        self.ok("velocity", "turntable", "1 rev/s", "--hold", "300ms")
        self.assertEqual([r.velocity for r in self.server.calls("MoveVelocity")], [180, 360])
        self.assertEqual(self.fails(2, "move", "feeder", "1rev"),
                         "axisctl: position: unit 'rev' does not fit here; write it in mm, cm, m, um or in")

    def test_request_id_repeats_without_moving_twice(self):
        first = self.json("move", "feeder", "--relative", "5", "--wait", "--request-id", "abc")
        second = self.json("move", "feeder", "--relative", "5", "--wait", "--request-id", "abc")
        self.assertEqual(first[0]["id"], second[0]["id"])
        self.assertIn("one axis", self.fails(2, "home", "turntable", "feeder", "--request-id", "abc"))
        self.assertEqual(self.server.calls("Home"), [])

    def test_options_reach_the_daemon(self):
        token = self.daemon.take("feeder")
        self.ok("move", "feeder", "1", "--buffered", "--valid-for", "5s", "--lease-token", str(token))
        options = self.server.calls("MoveAbsolute")[0].options
        self.assertEqual((options.buffer_mode, options.lease_token, options.HasField("not_after")), (2, token, True))

    def test_power_home_reset_set_position(self):
        self.assertRegex(self.ok("enable", "turntable", "--wait"), rf"(?m)^{ID}  turntable  Enable  Done")
        self.assertRegex(self.ok("home", "turntable", "feeder", "--wait"), r"(?s)turntable  Home  Done.*feeder  Home  Done")
        self.assertRegex(self.ok("set-position", "turntable", "90deg", "--wait"), r"SetPosition  Done")
        self.assertEqual(self.json("state", "turntable")[0]["position"], 90)
        self.assertRegex(self.ok("disable", "turntable", "--wait"), r"Disable  Done")

    def test_ctrl_c_while_waiting_leaves_the_command_alone(self):
        status, shown = self.on_terminal("move", "feeder", "390", "--velocity", "9", "--wait", interrupt_at=r" %")
        self.assertEqual(status, 130, shown)
        self.assertRegex(shown, f"command {ID} goes on; 'axisctl halt feeder' ends it")
        self.assertEqual(self.server.calls("Halt"), [])

    def test_halt_on_interrupt_halts_on_a_connection_of_its_own(self):
        status, shown = self.on_terminal("move", "feeder", "390", "--velocity", "9", "--wait", "--halt-on-interrupt",
                                         interrupt_at=r" %")
        self.assertEqual(status, 130, shown)
        self.assertNotEqual(self.server.peers("Halt"), self.server.peers("MoveAbsolute"))

    def test_velocity_runs_out_with_its_hold(self):
        done = self.run_axisctl("velocity", "feeder", "30", "--hold", "300ms", "--wait")
        self.assertEqual(done.returncode, 1)
        self.assertRegex(done.stdout, "MoveVelocity  Aborted after .*: the hold was not renewed in time")


class Jogging(AxisctlTest):
    def test_jog_renews_and_halts_when_its_time_is_over(self):
        text = self.ok("jog", "feeder", "30mm/s", "--hold", "300ms", "--for", "1s")
        self.assertRegex(text, r"(?s)feeder  Jog  .*feeder  Halt  Done")
        calls = self.server.calls("Jog")
        self.assertGreaterEqual(len(calls), 3)
        self.assertEqual(len({call.options.request_id for call in calls}), 1)  # a repeat extends the hold
        self.assertEqual(calls[0].hold.nanos, 300_000_000)
        # One connection, on which no renewal overtakes the halt, and which nothing else uses.
        self.assertEqual(set(self.server.peers("Halt")), set(self.server.peers("Jog")))
        self.assertNotEqual(self.server.peers("Halt")[0], self.server.peers("GetAxis")[0])

    def test_ctrl_c_halts(self):
        status, shown = self.on_terminal("jog", "feeder", "30", "--hold", "2s", interrupt_at=r"Jog")
        self.assertEqual(status, 0, shown)
        self.assertEqual(len(self.server.calls("Halt")), 1)

    def test_a_jog_that_a_stop_ended_is_not_started_again(self):
        jog = subprocess.Popen([AXISCTL, "--server", self.server.address, "jog", "feeder", "30", "--hold", "600ms"],
                               stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True, env=environment())
        self.addCleanup(jog.kill)
        self.wait_for_call("Jog")
        self.ok("stop", "feeder", "--wait")
        text, _ = jog.communicate(timeout=LIMIT)
        self.assertEqual(jog.returncode, 1, text)
        self.assertIn("Jog  Aborted", text)
        self.assertFalse(self.json("state", "feeder")[0]["moving"])

    def test_hold_has_a_range(self):
        self.assertIn("permitted 30ms to 2s", self.fails(2, "jog", "feeder", "1", "--hold", "3s"))


class Stopping(AxisctlTest):
    def test_stops_ask_nothing_before(self):
        for words, method in ((["halt"], "Halt"), (["stop"], "Stop"), (["quick-stop"], "QuickStop")):
            self.assertRegex(self.ok(*words, "feeder"), rf"feeder  {method}  (Active|Done)")
        self.assertEqual([name for name, _, _ in self.server.between.calls], ["Halt", "Stop", "QuickStop"])

    def test_hold_and_release(self):
        self.assertIn("held until 'axisctl release-stop feeder'", self.ok("stop", "feeder", "--hold"))
        self.assertTrue(self.server.calls("Stop")[0].hold)
        self.assertEqual(self.server.calls("Stop")[0].options.request_id, "")
        self.assertRegex(self.ok("state", "feeder"), rf"stop held by all of: {OWN_NAME} since 20\d\d-\d\d-\d\dT\d\d:\d\d:\d\dZ")
        self.assertIn(f"stop held by {OWN_NAME}", self.ok("list"))
        self.assertIn("feeder: released; a new command can move it", self.ok("release-stop", "feeder"))
        self.assertNotIn("stop held", self.ok("state", "feeder"))
        self.assertIn("no stop is held; nothing needs to be released", self.fails(4, "release-stop", "feeder"))

    def test_whose_holds_are_released(self):
        self.assertIn("release-stop feeder --request-id door'",
                      self.ok("stop", "feeder", "--hold", "--request-id", "door"))
        self.ok("stop", "feeder", "--hold")
        self.daemon.hold("feeder", "r7", user="panel")
        shown = self.ok("release-stop", "feeder")
        self.assertRegex(shown, rf"still held by .*{OWN_NAME} \(request door\) since 20\S+Z")
        self.assertRegex(shown, rf"panel via {OWN_NAME} \(request r7\)")
        self.assertIn("still held by panel", self.ok("release-stop", "feeder", "--request-id", "door"))
        token = self.daemon.take("feeder")
        self.assertEqual(self.json("release-stop", "feeder", "--everybody", "--lease", str(token)),
                         [{"command": unittest.mock.ANY, "holds": []}])
        self.assertEqual(self.server.calls("ReleaseStop")[-1].lease_token, token)
        self.fails(2, "release-stop", "feeder", "--everybody", "--mine")
        self.ok("group", "stop", "transfer", "--hold")
        self.assertIn("turntable: released; a new command can move it", self.ok("group", "release-stop", "transfer"))
        again = self.run_axisctl("group", "release-stop", "transfer")
        self.assertEqual(again.returncode, 1)
        self.assertIn("turntable: no stop is held; nothing needs to be released", again.stdout)
        self.ok("group", "stop", "transfer", "--hold", "--request-id", "door")
        self.ok("group", "release-stop", "transfer", "--mine")

    def test_a_release_of_several_axes_as_json_is_one_object(self):
        self.ok("stop", "feeder", "turntable", "--hold")
        self.assertEqual(self.json("release-stop", "feeder", "turntable"),
                         [{"results": [{"name": "feeder", "holds": []}, {"name": "turntable", "holds": []}]}])
        done = self.run_axisctl("--json", "release-stop", "feeder", "turntable")
        self.assertEqual(json.loads(done.stdout), {"results": []})
        self.assertEqual(len(done.stderr.splitlines()), 2)

    def test_one_refused_stop_does_not_keep_the_others(self):
        done = self.run_axisctl("stop", "nobody", "feeder", "--wait")
        self.assertEqual(done.returncode, 4)
        self.assertIn("axisctl: nobody: ", done.stderr)
        self.assertIn("feeder  Stop  Done", done.stdout)

    def test_axes_may_have_commas_between(self):
        self.assertRegex(self.ok("halt", "feeder,turntable", "--wait"), r"(?s)feeder +Halt +Done.*\n.*turntable +Halt +Done")
        self.assertEqual([request.axis for request in self.server.calls("Halt")], ["feeder", "turntable"])
        done = self.run_axisctl("stop", "nobody,feeder", "--wait")
        self.assertEqual(done.returncode, 4)
        self.assertIn("feeder  Stop  Done", done.stdout)

    def test_stop_all_reports_each_axis_and_holds_until_released(self):
        done = self.run_axisctl("stop", "--all", "--wait")
        self.assertEqual(done.returncode, 1)  # ghost cannot be confirmed
        self.assertRegex(done.stdout, "ghost  Stop  Unknown after .*: line-b node 9: the stop was not acknowledged: .*; look at")
        self.assertIn("feeder  Stop  Done", done.stdout)
        self.assertIn("release-stop --all", self.ok("info"))
        self.assertIn("axisctl release-stop --all", self.fails(4, "move", "feeder", "1"))
        self.assertIn("released", self.ok("release-stop", "--all"))
        self.ok("move", "feeder", "1", "--wait")

    def test_axes_or_all(self):
        self.assertIn("name an axis, or use --all", self.fails(2, "stop"))
        self.assertIn("not both", self.fails(2, "stop", "feeder", "--all"))


class Commands(AxisctlTest):
    def test_get_watch_cancel(self):
        moved = self.json("move", "feeder", "390", "--velocity", "9")[0]["id"]
        self.assertRegex(self.ok("command", "get", moved), rf"^{moved}  feeder  MoveAbsolute  Active")
        self.assertRegex(self.ok("command", "cancel", moved), "feeder  MoveAbsolute")
        watched = self.run_axisctl("command", "watch", moved)
        self.assertEqual(watched.returncode, 1)
        self.assertRegex(watched.stdout, "Aborted after .*cancel")
        moved = self.json("move", "feeder", "10", "--velocity", "60")[0]["id"]
        self.assertEqual(self.json("command", "watch", moved)[-1]["state"], "COMMAND_STATE_DONE")

    def test_unknown(self):
        self.assertIn("axisctl: c-9: there is no command 'c-9' (any more); ", self.fails(4, "command", "get", "c-9"))
        self.assertIn("no command", self.fails(4, "command", "watch", "c-9"))


class Connecting(AxisctlTest):
    def test_unix_socket_and_environment(self):
        done = subprocess.run([AXISCTL, "list", "--names"], capture_output=True, text=True, timeout=LIMIT,
                              env=environment() | {"AXISD_SERVER": self.daemon.server}, check=False)
        self.assertEqual((done.returncode, done.stdout.split()[0]), (0, "feeder"), done.stderr)

    def test_a_proxy_of_the_environment_is_ignored(self):
        done = self.run_axisctl("list", env={"http_proxy": "http://127.0.0.1:9", "grpc_proxy": "http://127.0.0.1:9"})
        self.assertEqual(done.returncode, 0, done.stderr)

    def test_unreachable(self):
        with socket.socket() as taken:  # bound, not listening: nobody else can get this port meanwhile
            taken.bind(("127.0.0.1", 0))
            address = f"127.0.0.1:{taken.getsockname()[1]}"
            self.assertRegex(self.fails(3, "list", server=address),
                             rf"cannot reach axisd at {address}: .*refused; is the daemon running")
            self.assertIn(f"cannot reach axisd at {address}", self.fails(3, "--timeout", "300ms", "stop", "--all",
                                                                            server=address))
        self.assertIn("cannot reach axisd at unix:/nonexistent/s", self.fails(3, "list", server="unix:/nonexistent/s"))

    def test_errors_are_json_on_standard_error_with_json(self):
        def error(*words, **arguments):
            done = self.run_axisctl("--json", *words, **arguments)
            self.assertEqual(done.stdout, "")
            (line,) = done.stderr.splitlines()
            error = json.loads(line)["error"]
            self.assertEqual(error["exit_status"], done.returncode)
            return error
        refused = error("move", "feeder", "500")
        self.assertEqual((refused["reason"], refused["remedy"], refused["permitted"]["maximum"]),
                         ("REASON_SOFT_LIMIT", "choose a target within the limits", 400))
        self.assertIn("feeder: target 500 mm", refused["text"])
        usage = error("move", "feeder", "10deg")
        self.assertEqual((usage["reason"], usage["remedy"]), ("USAGE", "write it in mm, cm, m, um or in"))
        self.assertEqual(error("mov", "feeder", "1")["remedy"], "did you mean 'move'?")
        lost = error("list", server="127.0.0.1:1")
        self.assertEqual((lost["reason"], lost["outcome"], lost["exit_status"]), ("UNREACHABLE", "OUTCOME_NOT_SENT", 3))

    def test_a_host_alone_means_the_usual_port(self):
        self.assertIn("axisd at nowhere.invalid:7443", self.fails(3, "list", server="nowhere.invalid"))

    def test_a_silent_daemon_ends_with_the_time_limit(self):
        with socket.create_server(("127.0.0.1", 0)) as silent:
            self.fails(3, "--timeout", "300ms", "list", server=f"127.0.0.1:{silent.getsockname()[1]}")

    def test_a_daemon_that_goes_away_while_waiting(self):
        move = subprocess.Popen([AXISCTL, "--server", self.server.address, "move", "feeder", "390", "--velocity", "9",
                                 "--wait"], stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True,
                                env=environment())
        self.addCleanup(move.kill)
        self.wait_for_call("WatchCommand")
        self.server.__exit__()
        _, error = move.communicate(timeout=LIMIT)
        self.assertEqual(move.returncode, 3, error)
        self.assertIn(f"lost axisd at {self.server.address}", error)
        self.assertRegex(error, f"command {ID} may go on")

    def test_certificates(self):
        self.assertIn("--tls-ca: cannot read '/nonexistent': No such file or directory; ",
                      self.fails(2, "--tls-ca", "/nonexistent", "list"))
        self.assertIn("--tls-ca: cannot read '/dev/null'; it must be a PEM file",
                      self.fails(2, "--tls-ca", "/dev/null", "list"))
        self.assertIn("belong together", self.fails(2, "--tls-cert", "/nonexistent", "list"))


class Offline(AxisctlTest):
    def setUp(self):
        """No daemon needed."""
        self.server = type("Nobody", (), {"address": "unix:/nonexistent/s"})

    def test_check_prints_every_diagnostic(self):
        with tempfile.TemporaryDirectory() as directory:
            path = pathlib.Path(directory) / "bad.yaml"
            path.write_text("machine: demo\nbusses: {}\naxes: 7\n")
            done = self.run_axisctl("check", str(path))
            self.assertEqual(done.returncode, 2)
            self.assertGreaterEqual(len(done.stderr.splitlines()), 3)
            for line in done.stderr.splitlines()[:-1]:
                self.assertRegex(line, rf"^{path}:\d+:\d+: ")
            self.assertRegex(done.stderr.splitlines()[-1], r"^axisctl: .*: \d+ errors?$")
            listed = self.run_axisctl("--json", "check", str(path))
            self.assertEqual(listed.returncode, 2)
            self.assertIn('"valid":false', listed.stdout)

    def test_schema(self):
        self.assertTrue(self.ok("schema").startswith("{"))

    def test_usage(self):
        for words in ([], ["move"], ["move", "feeder"], ["fly"], ["move", "feeder", "1", "--colour", "2"],
                      ["completion", "tcsh"], ["command"]):
            self.assertRegex(self.fails(2, *words), r"see 'axisctl.* --help'$")
        self.assertIn("--timeout", self.fails(2, "--timeout", "5", "list"))

    def test_help_documents_exit_status(self):
        self.assertIn("the daemon cannot be reached", self.ok("--help"))
        self.assertIn("--acceleration-time", self.ok("move", "--help"))
        self.assertRegex(self.ok("--version"), r"^axisctl \d")


class Completion(AxisctlTest):
    def complete(self, *words):
        script = ('eval "$("$AXISCTL" completion bash)"; COMP_WORDS=("$AXISCTL" "$@"); COMP_CWORD=$#; _axisctl; '
                  'printf "%s\\n" "${COMPREPLY[@]}"')
        done = subprocess.run(["bash", "-c", script, "bash", *words], capture_output=True, text=True, timeout=LIMIT,
                              env=environment() | {"AXISCTL": AXISCTL, "AXISD_SERVER": self.server.address},
                              check=False)
        self.assertEqual(done.stderr, "")
        return done.stdout.split()

    def test_subcommands_options_axes(self):
        self.assertEqual(self.complete("sto"), ["stop"])
        self.assertEqual(sorted(self.complete("command", "")), ["cancel", "get", "list", "watch"])
        self.assertIn("--relative", self.complete("move", "feeder", "--re"))
        self.assertIn("--json", self.complete("list", "--j"))
        self.assertEqual(self.complete("move", "fe"), ["feeder"])
        self.assertEqual(self.complete("stop", "feeder", "t"), ["turntable"])
        self.assertEqual(self.complete("--timeout", "2s", "state", "gh"), ["ghost"])
        self.assertEqual(self.complete("state", "acc"), ["accept"])
        self.assertEqual(self.complete("state", "feeder", ""), [])
        self.assertEqual(self.complete("state", "accept", ""), [])
        self.assertEqual(self.complete("move", "feeder", ""), [])
        self.assertEqual(sorted(self.complete("bus", "")),
                         ["list", "read", "record", "record-now", "records", "scan", "statistics", "status",
                          "transact", "write"])
        self.assertEqual(self.complete("drive", "info", "fe"), ["feeder"])
        self.assertEqual(self.complete("--json", "drive", "read", "tu"), ["turntable"])
        self.assertIn("--verify", self.complete("drive", "readdress", "feeder", "--v"))
        self.assertEqual(self.complete("events", "feeder", "gh"), ["ghost"])
        self.assertEqual(self.complete("command", "get", ""), [])

    def test_names_from_the_daemon(self):
        self.assertIn("line-a", self.complete("trace", ""))
        self.assertIn("line-a", self.complete("bus", "status", "li"))
        self.assertEqual(self.complete("drive", "read", "feeder", "start_sp"), ["start_speed"])
        self.assertEqual(self.complete("drive", "write", "feeder", "start_sp"), ["start_speed="])
        self.assertEqual(self.complete("drive", "write", "feeder", "start_speed", "=", "5", "start_sp"), ["start_speed="])
        self.assertEqual(self.complete("group", "move", "t"), ["transfer", "turntable="])
        self.assertEqual(self.complete("group", "stop", "--axis", "tu"), ["turntable"])
        self.assertEqual(self.complete("--server", self.server.address, "move", "fe"), ["feeder"])
        self.assertEqual(self.complete("--server", "localhost:1", "move", "fe"), [])

    def test_values_of_options(self):
        self.assertEqual(self.complete("events", "--kind", "term"), ["terminal-edge"])
        self.assertEqual(self.complete("events", "--kind", "terminal,axis"), ["terminal,axis-fault"])
        self.assertEqual(self.complete("events", "--kind=term"), ["terminal-edge"])
        self.assertEqual(self.complete("completion", ""), ["bash", "zsh", "fish"])
        self.assertIn("home", self.complete("explain", "feeder", ""))

    def run_shell(self, *words):
        if shutil.which(words[0]) is None:
            self.skipTest(f"there is no {words[0]}: deploy/install-packages.sh test")
        with tempfile.TemporaryDirectory() as folder:
            os.symlink(AXISCTL, f"{folder}/axisctl")
            done = subprocess.run(
                words, capture_output=True, text=True, timeout=LIMIT, check=False,
                env=environment() | {"AXISD_SERVER": self.server.address, "HOME": folder,
                                     "PATH": f"{folder}:{os.environ['PATH']}"})
        self.assertEqual(done.stderr, "")
        return [line.split("\t")[0] for line in done.stdout.splitlines()]

    def test_fish(self):
        def complete(line):
            return self.run_shell("fish", "--no-config", "-c", f"axisctl completion fish | source; complete -C '{line}'")
        self.assertEqual(complete("axisctl move fe"), ["feeder"])
        self.assertEqual(complete("axisctl sto"), ["stop"])
        self.assertEqual(complete("axisctl stop feeder tu"), ["turntable"])

    def test_zsh(self):
        def complete(*words):
            shown = "_describe() { local list=$2; print -rl -- ${(P)list}; }; compdef() { :; }; "
            quoted = " ".join(f"'{word}'" for word in words)
            return self.run_shell("zsh", "-f", "-c", f'{shown} eval "$(axisctl completion zsh)"; words=({quoted}); '
                                                     "CURRENT=$#words; PREFIX=$words[-1]; _axisctl")
        self.assertEqual(complete("axisctl", "move", "fe"), ["feeder"])
        self.assertEqual([line.split(":")[0] for line in complete("axisctl", "sto")], ["stop"])
        self.assertEqual(complete("axisctl", "group", "move", "tu"), ["turntable="])


if __name__ == "__main__":
    signal.alarm(600)  # a hang names itself instead of blocking a test run
    unittest.main()
