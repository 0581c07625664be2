"""axisctl --cell against a fake cell of machines with simulated drives: names, selections, stops, and what it says of silent machines."""
import asyncio
import json
import os
import re
import signal
import subprocess
import sys
import tempfile
import time
import unittest

from support import AXISCTL, LIMIT, environment, on_terminal
import canned
import fake_cell
from axisd.v1 import error_pb2

MACHINES = ("press-1", "press-2", "press-3")


class CellTest(unittest.TestCase):
    def setUp(self):
        self.fake = self.enterContext(fake_cell.ThreadedCell(MACHINES))
        self.cell = self.fake.cell

    def command(self, *words):
        return [AXISCTL, "--cell", self.fake.address, *words]

    def run_axisctl(self, *words, env=None):
        return subprocess.run(self.command(*words), capture_output=True, text=True, timeout=LIMIT,
                              env=environment() | (env or {}), check=False)

    def ok(self, *words):
        done = self.run_axisctl(*words)
        self.assertEqual((done.returncode, done.stderr), (0, ""), done.stdout)
        return done.stdout

    def fails(self, code, *words):
        done = self.run_axisctl(*words)
        self.assertEqual(done.returncode, code, done.stdout + done.stderr)
        self.assertRegex(done.stderr, r"\Aaxisctl: [^\n]+\n\Z")
        return done.stderr.removeprefix("axisctl: ").strip()

    def start(self, *words):
        running = subprocess.Popen(self.command(*words), env=environment(), text=True, bufsize=1,
                                   stdout=subprocess.PIPE, stderr=subprocess.PIPE)
        self.addCleanup(running.stderr.close)
        self.addCleanup(running.stdout.close)
        self.addCleanup(running.wait)
        self.addCleanup(running.kill)
        return running

    def read_until(self, stream, pattern):
        for line in stream:
            if re.search(pattern, line):
                return line
        self.fail(f"the output ended without {pattern}")

    def wait_until(self, condition, running):
        while not condition():
            self.assertIsNone(running.poll(), "axisctl ended")
            time.sleep(0.01)

    def forwarded(self, method):
        return [machine for machine, name in self.cell.forwarded if name == method]


class Names(CellTest):
    def test_the_machine_is_split_off_and_put_before_the_answer(self):
        self.assertRegex(self.ok("move", "press-2/feeder", "30", "--velocity", "300", "--wait"),
                         r"(?s)press-2/feeder .*press-2/feeder .*Done")
        (request,) = self.fake.calls("press-2", "MoveAbsolute")
        self.assertEqual((request.axis, request.position), ("feeder", 30))
        self.assertEqual(self.fake.calls("press-1", "MoveAbsolute"), [])
        self.assertIn("press-2/feeder", self.ok("state", "press-2/feeder"))
        self.assertIn("press-2/line-a", self.ok("bus", "statistics", "press-2/line-a"))

    def test_a_command_is_found_again(self):
        command = json.loads(self.ok("--json", "move", "press-3/feeder", "5"))
        self.assertRegex(command["id"], r"\Apress-3/[0-9a-f]+-\d+\Z")
        self.assertIn("press-3/feeder", self.ok("command", "watch", command["id"]))
        self.assertEqual(set(self.forwarded("GetAxis")), {"press-3"})

    def test_errors_name_the_machine_once(self):
        self.assertRegex(self.fails(4, "move", "press-2/feeder", "500"), r"\Apress-2/feeder: target 500 mm is")
        self.assertEqual(self.fails(4, "state", "press-2/feder"),
                         "press-2/feder: no such axis; 'axisctl list press-2' shows those of the machine")
        self.assertEqual(self.fails(4, "enable", "press-9/feeder"),
                         "press-9/feeder: there is no machine 'press-9'; axisctl machines shows those of the cell")
        self.assertIn("the cell has no machine 'pres-2'; did you mean 'press-2'?", self.fails(2, "list", "pres-2"))

    def test_nothing_is_guessed(self):
        self.assertEqual(self.fails(2, "stop", "feeder"),
                         "'feeder' names no machine of the cell; write MACHINE/feeder")
        self.assertEqual(self.fails(2, "enable", "press-1/feeder", "turntable"),
                         "'turntable' names no machine of the cell; write MACHINE/turntable")
        self.assertIn("name it with --machine", self.fails(2, "buses"))
        self.assertIn("are two machines", self.fails(2, "group", "halt", "--axis", "press-1/feeder", "--axis", "press-2/feeder"))
        self.assertIn("no machine's name", self.fails(2, "stop", "Press 2/feeder"))
        self.assertEqual([method for _, method in self.cell.forwarded if method not in ("GetAxis",)], [])

    def test_machine_for_what_has_no_name(self):
        self.assertIn("line-a", self.ok("--machine", "press-2", "buses"))
        self.ok("--machine", "press-3", "enable", "turntable")
        self.assertEqual((self.forwarded("ListBuses"), self.forwarded("Enable")), (["press-2"], ["press-3"]))
        done = self.run_axisctl("state", "turntable", env={"AXISD_MACHINE": "press-3"})
        self.assertNotIn("press-3/", done.stdout)
        alone = subprocess.run([AXISCTL, "--machine", "press-2", "list"], env=environment(), capture_output=True,
                               text=True, timeout=LIMIT, check=False)
        self.assertEqual((alone.returncode, alone.stderr),
                         (2, "axisctl: --machine names one of a cell: --cell says where its entrance is\n"))

    def test_a_server_that_is_named_goes_before_the_cell_of_the_environment(self):
        nowhere = {"AXISD_CELL": "127.0.0.1:1", "AXISD_MACHINE": "press-2"}
        done = subprocess.run([AXISCTL, "--server", self.fake.address, "list"], env=environment() | nowhere,
                              capture_output=True, text=True, timeout=LIMIT, check=False)
        self.assertEqual(done.returncode, 0, done.stderr)
        self.assertIn("\nfeeder ", done.stdout)
        self.assertIn("give one of them", self.fails(2, "--server", "x:1", "list"))

    def test_a_lease_of_one_machine_and_its_token(self):
        show = "import os, subprocess; subprocess.run([*os.environ['CTL'].split(), 'move', 'press-2/feeder', '3'])"
        done = self.run_axisctl("lease", "hold", "press-2/feeder", "--ttl", "3s", "--", sys.executable, "-c", show,
                                env={"CTL": AXISCTL})
        self.assertEqual((done.returncode, done.stderr), (0, ""), done.stdout)
        self.assertEqual([request.options.lease_token for request in self.fake.calls("press-2", "MoveAbsolute")],
                         [self.fake.calls("press-2", "ReleaseLease")[0].lease_token])
        self.assertEqual(self.forwarded("ReleaseLease"), ["press-2"])
        self.assertRegex(self.ok("--machine", "press-1", "lease", "acquire", "feeder"), r"^\d+\n$")

    def test_a_token_is_of_one_machine(self):
        token = self.ok("lease", "acquire", "press-3/feeder").strip()
        self.assertRegex(token, r"^press-3/\d+$")
        self.assertIn("press-3/feeder: leased for another", self.ok("lease", "renew", token))
        for name in ("press-2/feeder", "press-3/feeder"):  # press-2 may have given the same number to somebody
            self.assertEqual(self.run_axisctl("move", name, "3", env={"AXISD_LEASE": token}).returncode, 0)
        self.assertEqual([self.fake.calls(name, "MoveAbsolute")[0].options.lease_token for name in ("press-2", "press-3")],
                         [0, int(token.removeprefix("press-3/"))])
        self.assertEqual(self.ok("lease", "release", token), "released\n")
        self.assertEqual(self.forwarded("ReleaseLease"), ["press-3"])
        alone = subprocess.run([AXISCTL, "--server", "x:1", "lease", "renew", token], env=environment(),
                               capture_output=True, text=True, timeout=LIMIT, check=False)
        self.assertIn("--cell is missing", alone.stderr)

    def test_lines_for_a_configuration_have_no_machine(self):
        self.cell.machines["press-2"].answers["Scan"] = canned.SCAN
        self.assertIn("    bus: line-a\n", self.ok("bus", "scan", "press-2/line-a", "--yaml"))

    def test_a_script(self):
        script = os.path.join(self.enterContext(tempfile.TemporaryDirectory()), "script")
        with open(script, "w", encoding="utf-8") as file:
            file.write("enable press-1/turntable press-2/turntable\nmove press-2/feeder 10mm --wait\n")
        self.ok("run", script)
        self.assertEqual(self.forwarded("Enable"), ["press-1", "press-2"])

    def test_completion(self):
        def words(*typed):
            return self.run_axisctl("complete-words").stdout if not typed else subprocess.run(
                [AXISCTL, "complete-words", "--cell", self.fake.address, *typed], env=environment(),
                capture_output=True, text=True, timeout=LIMIT, check=True).stdout.split()
        self.assertIn("press-3/feeder", words("move", ""))
        self.assertEqual(words("move", "press-2/f"), ["press-2/feeder"])
        self.assertEqual(words("--machine", "press-"), list(MACHINES))
        self.assertEqual(words("list", "press-1"), ["press-1"])
        self.assertIn("press-2/line-a", words("trace", "press-2/"))
        self.assertIn("feeder", words("--machine", "press-2", "move", ""))
        self.assertIn("current=", [word.split("\t")[0] for word in words("drive", "write", "press-2/feeder", "cur")])



class Groups(CellTest):
    def test_axes_of_several_machines_move_from_one_moment_on(self):
        shown = self.ok("group", "move", "press-1/feeder=10mm", "press-2/feeder=20mm@5mm/s", "press-1/turntable=90deg",
                        "--clock-tolerance", "0.5ms", "--request-id", "r1", "--lease", "press-2/77", "--wait")
        self.assertRegex(shown, r"(?s)\Adone\n.*press-1/feeder .*Done.*press-2/feeder .*Done.*\+3 ms")
        self.assertIn("start skew 2 ms, off by 0.1 ms at most", shown)
        (request,) = self.cell.moves
        self.assertEqual([(part.machine, [target.axis for target in part.targets], part.lease_token)
                          for part in request.machines],
                         [("press-1", ["feeder", "turntable"], 0), ("press-2", ["feeder"], 77)])
        self.assertEqual((request.machines[1].targets[0].position, request.machines[1].targets[0].velocity), (20, 5))
        self.assertEqual((request.options.request_id, request.options.lease_token, request.clock_tolerance.nanos),
                         ("r1", 0, 500_000))
        self.assertEqual(self.forwarded("MoveGroup"), [])

    def test_those_of_one_machine_move_there(self):
        self.ok("enable", "press-2/turntable", "--wait")
        self.ok("set-position", "press-2/turntable", "0", "--wait")
        self.ok("group", "move", "press-2/feeder=10mm", "press-2/turntable=20deg", "--wait")
        self.assertEqual((self.forwarded("MoveGroup"), self.cell.moves), (["press-2"], []))

    def test_what_ended_otherwise_is_told_with_its_machine(self):
        done = self.run_axisctl("group", "move", "press-1/feeder=10mm", "press-2/sticky=20mm", "--wait")
        self.assertEqual(done.returncode, 1, done.stderr)
        self.assertIn("error: press-2: sticky: it did not arrive", done.stdout)
        shown = json.loads(self.run_axisctl("--json", "group", "move", "press-1/feeder=10mm", "press-2/sticky=20mm").stdout)
        self.assertEqual(shown["machines"][1]["move"]["members"][0]["command"]["axis"], "press-2/sticky")

    def test_what_is_not_for_several_machines_is_refused(self):
        two = ("press-1/feeder=10mm", "press-2/feeder=20mm")
        self.assertIn("--together", self.fails(2, "group", "move", *two, "--together"))
        self.assertIn("names no machine", self.fails(2, "group", "move", two[0], "feeder=20mm"))
        self.assertIn("whose lease", self.fails(2, "group", "move", *two, "--lease", "77"))
        self.assertEqual(self.cell.moves, [])


class Across(CellTest):
    def test_list_of_all_and_of_some(self):
        self.assertEqual(self.ok("list", "--names").split(),
                         [f"{machine}/{axis}" for machine in MACHINES
                          for axis in ("feeder", "turntable", "ghost", "sticky")])
        self.assertNotIn("press-1/", self.ok("list", "press-2", "press-3/*"))
        states = json.loads(self.ok("--json", "list", "press-2"))["axes"]
        self.assertEqual([state["axis"] for state in states][0], "press-2/feeder")

    def test_a_silent_machine_is_told_and_the_others_are_shown(self):
        self.cell.silent.add("press-3")
        done = self.run_axisctl("list")
        self.assertIn("press-2/feeder", done.stdout)
        self.assertEqual((done.returncode, done.stderr),
                         (3, "axisctl: press-3: does not answer: connection refused; look at the machine\n"))

    def test_a_machine_that_is_gone_is_left_out_and_told_once(self):
        self.cell.silent.add("press-3")
        self.cell.gone.add("press-3")
        told = "axisctl: left out, as gone: press-3; neither registered nor answering, 'axisctl machines' tells since when\n"
        for words in (("list",), ("state",), ("events",), ("watch", "--period", "20ms", "--count", "2")):
            done = self.run_axisctl(*words)
            self.assertEqual((done.returncode, done.stderr), (0, told), words)
        following = self.start("events", "--follow")
        self.assertEqual(following.stderr.readline(), told)
        following.send_signal(signal.SIGINT)
        self.assertEqual((following.wait(LIMIT), following.stderr.read()), (0, ""))
        self.assertEqual(self.fails(3, "list", "press-3"),
                         "press-3: does not answer: connection refused; look at the machine")

    def test_state_of_machines(self):
        shown = self.ok("state", "press-2")
        self.assertEqual(re.findall(r"^axis: +(\S+)", shown, re.MULTILINE),
                         [f"press-2/{axis}" for axis in ("feeder", "turntable", "ghost", "sticky")])
        kept = self.ok("state")
        self.assertEqual(re.findall(r"^(press-\d):$", kept, re.MULTILINE), list(MACHINES))
        self.assertEqual([json.loads(line)["machine"] for line in self.ok("--json", "state").splitlines()],
                         list(MACHINES))

    def test_watch_joins_the_machines(self):
        watching = self.start("watch", "press-1", "press-2/feeder", "--period", "50ms")
        first = self.read_until(watching.stdout, "press-2/feeder")
        self.assertNotIn("turntable", first)
        self.assertIn("press-1/turntable", self.read_until(watching.stdout, "press-1/feeder"))
        watching.send_signal(signal.SIGINT)
        self.assertEqual(watching.wait(LIMIT), 0)
        self.assertEqual(len(self.ok("watch", "--period", "20ms", "--count", "5").splitlines()), 5)

    def test_watch_goes_on_when_a_machine_comes_back(self):
        self.cell.silent.add("press-2")
        watching = self.start("watch", "press-1/feeder", "press-2/feeder", "--period", "50ms")
        self.assertIn("press-2: does not answer", self.read_until(watching.stderr, "press-2"))
        self.read_until(watching.stdout, "press-1/feeder")
        self.fake.do(self.cell.come_back("press-2"))
        self.read_until(watching.stdout, "press-2/feeder")
        self.fake.do(self.cell.fall_silent("press-2"))
        self.read_until(watching.stderr, "press-2: does not answer")
        watching.send_signal(signal.SIGINT)
        self.assertEqual(watching.wait(LIMIT), 0)

    def test_watch_on_a_terminal_is_one_table_of_all(self):
        self.cell.silent.add("press-3")
        status, shown = on_terminal(self, self.command("watch", "--period", "50ms"),
                                    interrupt_at=r"press-1/feeder.*press-2/feeder.*press-3: does not answer.*\x1b\[\d+A")
        self.assertEqual(status, 0, shown)
        self.assertEqual(on_terminal(self, self.command("machines", "--watch"), interrupt_at="press-3 .*silent")[0], 0)

    def test_watch_ends_where_a_machine_that_was_named_refuses(self):
        self.assertIn("no axis 'nobody'", self.fails(4, "watch", "press-2/nobody"))

    def test_events_of_the_cell_and_of_all_machines(self):
        self.fake.do(self.cell.fall_silent("press-3"))
        self.fake.do(self.cell.come_back("press-3"))
        lines = self.ok("events").splitlines()
        self.assertEqual(sum("press-3  silent -> present" in line for line in lines), 1)
        self.assertTrue(all(any(f"  {machine}/" in line for line in lines) for machine in MACHINES), lines)
        times = [line.split()[0].rstrip("Z") for line in lines]  # a whole second has no fraction
        self.assertEqual(times, sorted(times))
        self.assertEqual(len(self.ok("events", "--kind", "cell").splitlines()), 2)
        self.assertNotIn("press-1/", self.ok("events", "press-2"))
        told = [json.loads(line) for line in self.ok("--json", "events", "press-2").splitlines()]
        self.assertEqual({event["machine"] for event in told}, {"press-2"})
        self.assertIn("each machine counts its own", self.fails(2, "events", "--since", "7"))

    def test_events_without_a_silent_machine(self):
        self.cell.silent.add("press-2")
        for _ in range(5):  # what ends the stream must not be taken for its own end
            done = self.run_axisctl("events")
            self.assertEqual((done.returncode, done.stderr),
                             (3, "axisctl: press-2: does not answer: connection refused; look at the machine\n"))
            self.assertIn("press-3/", done.stdout)

    def test_events_as_they_come(self):
        following = self.start("events", "--follow", "--since", "now")
        self.wait_until(lambda: self.cell.readers and all(self.fake.calls(name, "WatchEvents") for name in MACHINES),
                        following)
        self.cell.machines["press-2"].daemon.simulate("input", "feeder", "X0", "off")
        self.assertIn("press-2/feeder", self.read_until(following.stdout, "X0 home off"))
        self.cell.machines["press-2"].daemon.simulate("input", "feeder", "X0", "auto")
        self.fake.do(self.cell.fall_silent("press-3"))
        self.read_until(following.stdout, "press-3  present -> silent")
        following.send_signal(signal.SIGINT)
        self.assertEqual(following.wait(LIMIT), 0)


class Machines(CellTest):
    def test_the_table(self):
        self.cell.silent.add("press-3")
        lines = self.ok("machines").splitlines()
        self.assertRegex(lines[0], r"^MACHINE +STATE +AXES +VERSION +SINCE +ROUND TRIP +STOPALL")
        self.assertRegex(lines[1], r"^press-1 +present +4 +0.1.0 +2027-01-15T08:00:00Z +0.4 ms +- .*this entrance's")
        self.assertRegex(lines[3], r"^press-3 +silent .* - +- .*connection refused")
        self.assertEqual(json.loads(self.ok("--json", "machines"))["machines"][1]["name"], "press-2")

    def test_changes(self):
        watching = self.start("machines", "--watch")
        self.read_until(watching.stdout, r"^press-3  present, since .*, 4 axes")
        self.fake.do(self.cell.fall_silent("press-2"))
        self.read_until(watching.stdout, r"^press-2  silent, since .*: connection refused")
        watching.send_signal(signal.SIGINT)
        self.assertEqual(watching.wait(LIMIT), 0)

    def test_the_cell_itself(self):
        shown = self.ok("info")
        self.assertIn("cell:       hall-1\nentrance:   press-1", shown)
        self.assertIn("machine:    press-2", self.ok("--machine", "press-2", "info"))

    def test_only_of_a_cell(self):
        done = subprocess.run([AXISCTL, "machines"], env=environment(), capture_output=True, text=True, timeout=LIMIT,
                              check=False)
        self.assertEqual((done.returncode, done.stderr),
                         (2, "axisctl: machines are those of a cell; --cell says where its entrance is\n"))

    def test_an_entrance_that_is_not_there(self):
        done = subprocess.run([AXISCTL, "--cell", "127.0.0.1:1", "machines"], env=environment(), capture_output=True,
                              text=True, timeout=LIMIT, check=False)
        self.assertEqual(done.returncode, 3)
        self.assertRegex(done.stderr, r"\Aaxisctl: cannot reach axisd-cell at 127.0.0.1:1: .*; is it running there\? "
                                      r"--cell HOST:PORT or AXISD_CELL names another entrance, --server a machine itself\n\Z")


class Stops(CellTest):
    def test_of_all_machines(self):
        lines = self.ok("stop", "--all").splitlines()
        self.assertEqual([line.split(":")[0] for line in lines[:3]], list(MACHINES))
        self.assertRegex(lines[1], r"^press-2: stopped and latched, answered in 2 ms$")
        self.assertTrue(all(machine.inhibited for machine in self.cell.machines.values()))
        self.assertEqual(self.cell.forwarded, [])
        self.assertIn("all machines stopped by anna through press-1", self.ok("machines"))
        self.assertIn("release-stop --all", self.fails(4, "move", "press-2/feeder", "1"))
        self.assertEqual(self.ok("release-stop", "--all").splitlines()[:3], [f"{name}: released" for name in MACHINES])
        self.ok("stop", "press-2/feeder", "--wait")
        self.ok("move", "press-2/feeder", "1")

    def test_a_silent_machine_makes_the_status(self):
        self.cell.silent.add("press-2")
        done = self.run_axisctl("stop", "--all")
        self.assertEqual((done.returncode, done.stderr), (1, ""))
        self.assertRegex(done.stdout, r"press-2: SILENT, not confirmed: .*does not answer: connection refused; look at the")
        done = self.run_axisctl("release-stop", "--all")
        self.assertEqual(done.returncode, 1)
        self.assertIn("'axisctl --machine press-2 release-stop --all' releases it", done.stdout)

    def test_waits_for_standstill(self):
        done = self.run_axisctl("stop", "--all", "--wait")
        self.assertEqual(done.returncode, 1, done.stdout)  # a ghost of each machine is offline
        self.assertEqual(sorted(self.forwarded("StopAll")), list(MACHINES))
        self.assertRegex(done.stdout, r"press-3/feeder.* Done")

    def test_a_latch_that_others_do_not_know_is_told(self):
        self.cell.not_shared = error_pb2.ErrorDetail(reason=error_pb2.REASON_OFFLINE, message="etcd does not answer",
                                                     remedy="look at etcd")
        done = self.run_axisctl("stop", "--all")
        self.assertEqual((done.returncode, done.stderr), (0, "axisctl: etcd does not answer; look at etcd\n"))

    def test_of_one_machine(self):
        self.run_axisctl("--machine", "press-2", "stop", "--all")
        self.assertEqual([machine.inhibited for machine in self.cell.machines.values()], [False, True, False])

    def test_axes_of_several_machines_none_waits_for_another(self):
        self.cell.holding["press-1", "Stop"] = asyncio.Event()
        stopping = self.start("--timeout", "20s", "stop", "press-1/feeder", "press-2/feeder", "press-3/feeder")
        self.wait_until(lambda: all(self.fake.calls(name, "Stop") for name in ("press-2", "press-3")), stopping)
        self.assertIsNone(stopping.poll())  # press-1 has its 20 s still

    def test_a_stop_is_repeated_until_the_machine_is_back(self):
        self.cell.silent.add("press-2")
        stopping = self.start("stop", "press-2/feeder", "press-3/feeder")
        self.wait_until(lambda: self.forwarded("Stop").count("press-2") >= 2, stopping)
        self.cell.silent.clear()
        self.assertEqual(stopping.wait(LIMIT), 0)
        self.assertEqual(len(self.fake.calls("press-3", "Stop")), 1)

    def test_a_machine_that_stays_silent(self):
        self.cell.silent.add("press-2")
        done = self.run_axisctl("--timeout", "300ms", "halt", "press-2/feeder", "press-3/feeder")
        self.assertEqual(done.returncode, 3)
        self.assertRegex(done.stderr, r"\Aaxisctl: press-2/feeder: does not answer: .*; the stop was repeated for 300 ms: "
                                      r"it never arrived\n\Z")
        self.assertIn("press-3/feeder", done.stdout)

    def test_a_move_to_a_silent_machine_was_not_sent(self):
        self.cell.silent.add("press-2")
        done = self.run_axisctl("--json", "move", "press-2/feeder", "1")
        error = json.loads(done.stderr)["error"]
        self.assertEqual((done.returncode, error["reason"], error["outcome"]),
                         (3, "REASON_OFFLINE", "OUTCOME_NOT_SENT"))


if __name__ == "__main__":
    signal.alarm(900)  # a hang names itself instead of blocking a test run
    unittest.main()
