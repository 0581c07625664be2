"""Why an axis cannot move: axisctl explain and Axis.explain() against the fake daemon."""
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
                                      "  refused disabled: the power stage is off\n"
                                      "          -> enable the axis first: axisctl enable turntable\n"
                                      "  note    moving: the axis moves\n"
                                      "          -> the start waits for standstill\n")
        done = self.run_axisctl("explain", "feeder", "move", "500")
        self.assertIn("  refused soft limit: the target is beyond a software limit (permitted 0 to 400 mm)\n",
                      done.stdout)
        self.assertEqual(done.returncode, 4)

    def test_what_only_delays_is_no_refusal(self):
        self.assertIn("turntable: enable is permitted now\n  note    moving", self.ok("explain", "turntable", "enable"))

    def test_every_command_can_be_asked_about(self):
        for words, field in ((["disable"], "disable"), (["home"], "home"), (["reset"], "reset"),
                             (["move", "--relative", "-5"], "move_relative"), (["velocity", "-5mm/s"], "move_velocity"),
                             (["jog", "5", "--hold", "500ms"], "jog"), (["set-position", "0"], "set_position")):
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
        return self.fake.calls[-1][1]

    async def test_obstacles(self):
        self.assertEqual(await self.machine.axis("feeder").explain(), [])
        off, moving = await self.machine.axis("turntable").explain("home")
        self.assertEqual((off.blocking, off.reason, off.remedy),
                         (True, "disabled", "enable the axis first: axisctl enable turntable"))
        self.assertFalse(moving.blocking)
        (far,) = await self.machine.axis("feeder").explain("move", 500, velocity=20)
        self.assertEqual((far.permitted.minimum, far.permitted.maximum), (0, 400))
        self.assertIn("permitted 0 to 400 mm", str(far))

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
            self.assertEqual([call for call in self.fake.calls if call[0] == "Explain"][-1][1].lease_token,
                             self.fake.last_token)


if __name__ == "__main__":
    unittest.main()
