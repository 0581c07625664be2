"""Why an axis cannot move: axisctl explain and Axis.explain() against the daemon with simulated drives."""
import unittest

from support import AxisctlTest, PythonTest


class Axisctl(AxisctlTest):
    def test_nothing_in_the_way(self):
        self.assertEqual(self.ok("explain", "feeder"), "feeder: motion is permitted now\n")
        self.assertEqual(self.ok("explain", "feeder", "move", "120mm", "--velocity", "50mm/s"),
                         "feeder: move is permitted now\n")
        request = self.server.calls("Explain")[-1]
        self.assertEqual((request.move_absolute.position, request.move_absolute.velocity), (120, 50))

    def test_what_is_in_the_way_with_what_to_do(self):
        done = self.run_axisctl("explain", "turntable", "home")
        self.assertEqual((done.returncode, done.stderr), (4, ""))
        self.assertEqual(done.stdout, "turntable: home is refused now\n"
                                      "  refused disabled: line-a node 2: the power stage is off\n"
                                      "          -> enable the axis first: axisctl enable turntable\n")
        done = self.run_axisctl("explain", "feeder", "move", "500")
        self.assertIn("  refused soft limit: target 500 mm is beyond a software limit (permitted 0 to 400 mm)\n"
                      "          -> choose a target within the limits\n", done.stdout)
        self.assertEqual(done.returncode, 4)

    def test_what_only_delays_is_no_refusal(self):
        self.ok("move", "feeder", "390", "--velocity", "30")
        self.assertIn("feeder: move is permitted now\n  note    moving", self.ok("explain", "feeder", "move", "5"))

    def test_every_command_can_be_asked_about(self):
        for words, field in ((["disable"], "disable"), (["home"], "home"), (["reset"], "reset"),
                             (["move", "--relative", "5"], "move_relative"), (["velocity", "30mm/s"], "move_velocity"),
                             (["jog", "30", "--hold", "500ms"], "jog"), (["set-position", "0"], "set_position")):
            with self.subTest(words):
                self.ok("explain", "feeder", *words)
                self.assertEqual(self.server.calls("Explain")[-1].WhichOneof("command"), field)
        self.assertEqual(self.server.calls("Explain")[-2].jog.hold.nanos, 500_000_000)

    def test_json_and_lease(self):
        done = self.run_axisctl("--json", "explain", "turntable", "--lease", "7")
        self.assertIn('"reason":"REASON_DISABLED"', done.stdout)
        self.assertEqual(self.server.calls("Explain")[0].lease_token, 7)

    def test_bad_words(self):
        self.assertIn("needs a VALUE", self.fails(2, "explain", "feeder", "move"))
        self.fails(2, "explain", "feeder", "fly")
        self.assertIn("no axis 'nobody'", self.fails(4, "explain", "nobody"))


class Python(PythonTest):
    def question(self):
        return self.calls("Explain")[-1]

    async def test_obstacles(self):
        self.assertEqual(await self.machine.axis("feeder").explain(), [])
        (off,) = await self.machine.axis("turntable").explain("home")
        self.assertEqual((off.blocking, off.reason, off.remedy),
                         (True, "disabled", "enable the axis first: axisctl enable turntable"))
        (far,) = await self.machine.axis("feeder").explain("move", 500, velocity=20)
        self.assertEqual((far.permitted.minimum, far.permitted.maximum), (0, 400))
        self.assertIn("permitted 0 to 400 mm", str(far))
        await self.machine.axis("feeder").move(390, velocity=30, wait=False)
        (moving,) = await self.machine.axis("feeder").explain("move", 5)
        self.assertEqual((moving.blocking, moving.reason), (False, "moving"))

    async def test_every_command_can_be_asked_about(self):
        feeder = self.machine.axis("feeder")
        for command, value, field in (("enable", None, "enable"), ("disable", None, "disable"), ("reset", None, "reset"),
                                      ("move", 1, "move_absolute"), ("move_relative", 1, "move_relative"),
                                      ("velocity", 1, "move_velocity"), ("jog", 1, "jog"),
                                      ("set_position", 1, "set_position")):
            await feeder.explain(command, value)
            self.assertEqual(self.question().WhichOneof("command"), field)
        await feeder.explain("jog", -2, hold=0.5, acceleration_time=0.1)
        self.assertEqual((self.question().jog.velocity, self.question().jog.hold.nanos), (-2, 500_000_000))
        with self.assertRaisesRegex(ValueError, "is no command; there are disable, enable"):
            await feeder.explain("fly")

    async def test_it_is_asked_under_the_lease(self):
        async with self.machine.lease("feeder") as lease:
            await lease.axis("feeder").explain("home")
            self.assertEqual(self.question().lease_token, lease.token)


if __name__ == "__main__":
    unittest.main()
