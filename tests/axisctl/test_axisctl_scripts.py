"""axisctl run, plot and man, against the daemon with simulated drives."""
import pathlib
import re
import signal
import socket
import subprocess
import tempfile
import unittest
import xml.etree.ElementTree as ElementTree

from support import AXISCTL, LIMIT, AxisctlTest, environment


class FileTest(AxisctlTest):
    def setUp(self):
        super().setUp()
        folder = tempfile.TemporaryDirectory()
        self.addCleanup(folder.cleanup)
        self.folder = pathlib.Path(folder.name)

    def script(self, *lines):
        path = self.folder / "moves.txt"
        path.write_text("".join(f"{line}\n" for line in lines))
        return str(path)

    def calls(self):
        return [name for name, _, _ in self.server.between.calls if name not in ("GetAxis", "WatchCommand")]


class Run(FileTest):
    def test_line_by_line_until_the_end(self):
        path = self.script("# to and fro", "move feeder 20mm --velocity 200 --wait", "", "axisctl move feeder -5 --relative --wait",
                           "list   # where are they?")
        shown = self.ok("run", path)
        self.assertRegex(shown, r"(?s)\A2: move feeder 20mm --velocity 200 --wait\n.*Done.*\n4: .*MoveRelative.*\n5: list\nAXIS")
        self.assertEqual(self.calls(), ["MoveAbsolute", "MoveRelative", "ListAxes"])
        self.assertEqual([line["kind"] for line in self.json("run", self.script("halt feeder"))], ["COMMAND_KIND_HALT"])

    def test_ends_at_the_first_line_that_does_not_succeed(self):
        self.daemon.simulate("block", "sticky", "on")
        path = self.script("move sticky 90 --relative --velocity 500 --wait", "move feeder 1")
        self.assertEqual(self.fails(1, "run", path),
                         f"axisctl: {path}:1: did not succeed; the lines behind it were not executed")
        self.daemon.simulate("block", "sticky", "off")
        path = self.script("list --names", "move feeder 9000mm", "move feeder 1")
        self.assertRegex(self.fails(4, "run", path), rf"^axisctl: {path}:2: feeder: .*permitted")
        self.assertEqual(self.calls().count("MoveRelative"), 1)
        self.assertEqual(len(self.server.calls("MoveAbsolute")), 1)

    def test_nothing_is_executed_before_all_lines_are_right(self):
        for line, why in (("move feeder", "VALUE is required"), ("fly feeder", "see 'axisctl --help'"),
                          ("move feeder 1 --velcity 2", "did you mean '--velocity'?"),
                          ("run x", "cannot run another"), ("move --help", "no place in a script"), ("move 'feeder 1", "a quotation has no end")):
            path = self.script("enable feeder", line)
            for words in (("run", path), ("run", path, "--check")):
                complaint = self.fails(2, *words)
                self.assertIn(f"{path}:2: ", complaint)
                self.assertIn(why, complaint)
        self.assertEqual(self.calls(), [])
        self.assertRegex(self.fails(2, "run", str(self.folder / "none")),
                         r"cannot read the script '.*/none': No such file or directory")
        self.assertIn("there is no command in ", self.fails(2, "run", self.script("# nothing yet")))

    def test_check_executes_nothing(self):
        path = self.script("enable feeder --wait", "move feeder 20mm")
        self.assertEqual(self.ok("run", "--check", path), f"{path}: ok, 2 commands\n")
        self.assertEqual(self.calls(), [])

    def test_its_lines_stop_at_the_lane_that_it_was_given(self):
        with socket.create_server(("127.0.0.1", 0)) as lane:
            lane.settimeout(LIMIT)
            self.ok("--stop-server", f"127.0.0.1:{lane.getsockname()[1]}", "run", self.script("halt feeder"))
            lane.accept()[0].close()

    def test_a_stop_goes_to_no_lane_of_another_machine(self):
        with socket.create_server(("127.0.0.1", 0)) as other:
            other.setblocking(False)
            subprocess.run([AXISCTL, "--server", self.server.address, "halt", "feeder"], timeout=LIMIT, check=True,
                           env=environment() | {"AXISD_STOP_SERVER": f"127.0.0.1:{other.getsockname()[1]}"},
                           capture_output=True)
            self.assertRaises(BlockingIOError, other.accept)
        self.assertEqual(self.calls(), ["Halt"])

    def test_from_standard_input(self):
        done = subprocess.run([AXISCTL, "--server", self.server.address, "run", "-"], input="halt feeder\n", text=True,
                              capture_output=True, timeout=LIMIT, env=environment(), check=False)
        self.assertEqual((done.returncode, done.stderr), (0, ""), done.stdout)
        self.assertEqual(self.calls(), ["Halt"])

    def test_ctrl_c_halts_what_it_started_and_nothing_else(self):
        self.ok("move", "sticky", "300", "--relative", "--velocity", "6")  # somebody else's
        path = self.script("move feeder 30 --velocity 6", "enable turntable --wait",
                           "move turntable 300 --relative --velocity 9 --wait", "move feeder 0")
        status, shown = self.on_terminal("run", path, interrupt_at=r"\n3: .* %")
        self.assertEqual(status, 130, shown)
        self.assertEqual({request.axis for request in self.server.calls("Halt")}, {"feeder", "turntable"})
        self.assertIn(f"axisctl: {path}: interrupted", shown)
        self.assertEqual(len(self.server.calls("MoveAbsolute")), 1, "the last line was not executed")

    def test_ctrl_c_in_a_jog_ends_the_script(self):
        path = self.script("jog feeder 6", "move feeder 0")
        status, shown = self.on_terminal("run", path, interrupt_at=r"Jog")
        self.assertEqual(status, 130, shown)
        self.assertEqual(self.server.calls("MoveAbsolute"), [])


class Plot(FileTest):
    def record(self, *words):
        process = subprocess.Popen([AXISCTL, "--server", self.server.address, "plot", *words], env=environment(),
                                   text=True, stdout=subprocess.PIPE, stderr=subprocess.PIPE, cwd=self.folder)
        self.addCleanup(process.kill)
        self.wait_for_call("WatchAxes")
        return process

    def test_draws_the_next_motion(self):
        process = self.record("feeder")
        self.ok("move", "feeder", "30mm", "--velocity", "100", "--wait")
        shown, complaint = process.communicate(timeout=LIMIT)
        self.assertEqual((process.returncode, complaint), (0, ""))
        self.assertRegex(shown, r"^feeder.svg: \d+ samples within ")
        picture = ElementTree.parse(self.folder / "feeder.svg")
        texts = [element.text for element in picture.iter("{http://www.w3.org/2000/svg}text")]
        self.assertIn("position, mm", texts)
        self.assertIn("velocity, mm/s", texts)
        self.assertTrue(any(re.search(r"from 0 mm to 30 mm, at most 98\.6667 mm/s$", text) for text in texts), texts)
        paths = [(path.get("class"), path.get("d")) for path in picture.iter("{http://www.w3.org/2000/svg}path")]
        for line in ("position", "velocity"):  # and not only in the legend
            self.assertTrue(any(name == line and way.count("L") > 10 for name, way in paths), paths)

    def test_ctrl_c_draws_what_there_is(self):
        self.ok("move", "feeder", "390", "--velocity", "9")
        process = self.record("feeder", "--output", "-")
        while not self.daemon.client.state("feeder").position > 3:
            self.assertIsNone(process.poll())
        process.send_signal(signal.SIGINT)
        self.assertIn("</svg>", process.communicate(timeout=LIMIT)[0])
        self.assertEqual(process.returncode, 0)

    def test_without_a_motion_nothing_is_written(self):
        process = self.record("feeder")
        process.send_signal(signal.SIGINT)
        self.assertIn("it did not move", process.communicate(timeout=LIMIT)[1])
        self.assertEqual((process.returncode, list(self.folder.iterdir())), (130, []))

    def test_unknown_axis(self):
        self.assertIn("no axis 'nobody'", self.fails(4, "plot", "nobody"))

    def test_a_file_that_cannot_be_written_costs_no_motion(self):
        complaint = self.fails(2, "plot", "feeder", "--output", "/nonexistent/x.svg")
        self.assertIn("cannot write '/nonexistent/x.svg'", complaint)
        self.assertEqual(list(self.folder.iterdir()), [])


class Manual(AxisctlTest):
    def test_is_sound_roff(self):
        done = subprocess.run(["groff", "-man", "-ww", "-Tutf8"], input=self.ok("man"), text=True, capture_output=True,
                              check=True)
        self.assertEqual(done.stderr, "")
        self.assertIn("--halt-on-interrupt", re.sub(".\b|\x1b\\[\\d+m", "", done.stdout))


if __name__ == "__main__":
    signal.alarm(600)  # a hang names itself instead of blocking a test run
    unittest.main()
