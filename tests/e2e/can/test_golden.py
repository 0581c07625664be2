"""The example sequences of the YSS-C manual (chapter 6.2) as candump sees them: what is printed, byte for byte.

They are the manual's, not axisd's (tests/golden/yss-c.frames), and go past axisd to the real axisd-sim. What axisd sends
of them has to be as printed, too.
"""
import tempfile
import unittest

from harness import ROOT, CanScenario, CanSimulator, heartbeat, turntable, wait_for

NODE = 1
STATUS_WORD, POSITION, SPEED = 0x604100, 0x606400, 0x200200  # index << 8 | sub-index, as the simulator has them
FIRST_INPUT_FUNCTION, HOME, POSITIVE_LIMIT = 0x203002, 1, 2


class Exchange:
    """What the manual prints under one heading, corrected."""

    def __init__(self, section):
        self.section, self.status = section, None
        self.sent, self.answers = [], []


def golden(*chapters):
    exchanges = []
    for line in (ROOT / "tests/golden/yss-c.frames").read_text().splitlines():
        if line.startswith("# section: "):
            exchanges.append(Exchange(line.removeprefix("# section: ")))
        elif line.startswith("# status: "):
            exchanges[-1].status = line.removeprefix("# status: ")
        elif line.startswith(("> ", "< ")):
            cob_id, *data = line[2:].split()
            frames = exchanges[-1].sent if line[0] == ">" else exchanges[-1].answers
            frames.append(f"{cob_id}#{''.join(data)}")
    return [one for one in exchanges if one.section.startswith(chapters)]


class Golden(CanScenario):
    def drive(self):
        """A drive after power-up, and nobody else; `self.bus`: who speaks to it."""
        self.bus = self.peer()
        directory = tempfile.TemporaryDirectory(dir="/dev/shm")
        self.addCleanup(directory.cleanup)
        sim = CanSimulator("drive", directory.name,
                           [f"node={NODE},model=yss-c,home=3000:3400,positive_limit=9000"], "vcan0")
        self.addCleanup(sim.close)
        sim.control(f"power {NODE} off")
        sim.control(f"power {NODE} on")
        wait_for(lambda: (heartbeat(NODE), b"\0") in self.bus.received(), "the drive has booted")
        return sim

    def play(self, sim, *chapters):
        """Sends the frames of these chapters, each after the answer to the one before."""
        dump = self.candump()
        exchanges, expected = golden(*chapters), []

        def seen():  # without TPDOs, which "depend on the mapping"
            return [frame for frame in dump.frames() if frame.startswith(("000#", "581#", "601#"))]
        for one in exchanges:
            for frame in one.sent:
                cob_id, data = frame.split("#")
                self.bus.send(int(cob_id, 16), bytes.fromhex(data))
            expected += one.sent + one.answers
            wait_for(lambda: len(seen()) >= len(expected), f"{one.section}: the answer")
            if one.status:
                self.assertRegex(f"{sim.peek(STATUS_WORD):016b}", one.status.replace("x", "."), one.section)
        self.assertEqual(seen(), expected)
        return len(exchanges)

    def test_initialisation(self):
        sim = self.drive()
        self.assertEqual(self.play(sim, "6.2.2"), 5)
        self.assertEqual(sim.shaft().starts, 0)

    def test_relative_move(self):
        sim = self.drive()
        self.assertEqual(self.play(sim, "6.2.2", "6.2.4"), 5 + 8)
        sim.wait_rest()
        self.assertEqual(sim.shaft(), (5000, False, 1))

    def test_speed_mode(self):
        sim = self.drive()
        self.assertEqual(self.play(sim, "6.2.5"), 9)
        wait_for(lambda: sim.peek(SPEED) == 60, "the shaft turns at 60 r/min")
        self.assertEqual(sim.shaft().starts, 1)

    def test_homing(self):
        sim = self.drive()
        for terminal, function in enumerate((HOME, POSITIVE_LIMIT)):
            sim.poke(FIRST_INPUT_FUNCTION + terminal, function)
        self.assertEqual(self.play(sim, "6.2.6"), 11)
        sim.wait_rest()
        self.assertEqual(sim.shaft(), (3000, False, 1))
        self.assertEqual(sim.peek(POSITION), 0)

    def test_axisd_moves_by_the_same_frames(self):
        """All of 6.2.2 and 6.2.4, but these, which it never sends."""
        otherwise = {
            "6.2.2 initialisation, step 1": "it starts its own nodes, one by one",
            "6.2.2 initialisation, step 2": "a motor that nobody enabled need not be released",
            "6.2.4 relative move, step 7": "it moves to absolute positions only: what is repeated moves nothing",
            "6.2.4 relative move, step 8": "likewise",
        }
        dump = self.candump()
        machine = self.cell(axes={"table": turntable(NODE)})
        machine.client.to_done("MoveRelative", "table", distance=-45.0, velocity=72.0, acceleration_time=0.2,
                               deceleration_time=0.2)
        machine.client.to_done("MoveAbsolute", "table", position=45.0, velocity=36.0, acceleration_time=0.1,
                               deceleration_time=0.1)  # 5000 pulses, 60 r/min
        seen = [frame for frame in dump.frames() if frame.startswith(("000#", "581#", "601#"))]
        following = set(zip(seen, seen[1:]))
        for one in golden("6.2.2", "6.2.4"):
            if one.section.split(":")[0] in otherwise:
                self.assertFalse({*one.sent} & {*seen}, one.section)
            else:
                self.assertIn((one.sent[0], one.answers[0]), following, one.section)


if __name__ == "__main__":
    unittest.main()
