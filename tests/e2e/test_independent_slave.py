"""axisd against pymodbus, which shares no code with its simulator: frames, CRC and function codes are Modbus."""
import os
import pathlib
import pty
import select
import sys
import threading
import tty
import unittest

from harness import DONE, Program, Scenario, spinner, wait_for


class Bridge(threading.Thread):
    """Two pseudo terminals, back to back."""

    def __init__(self, directory):
        super().__init__(daemon=True)
        self._masters, self._slaves = zip(pty.openpty(), pty.openpty())
        for end in (*self._masters, *self._slaves):
            tty.setraw(end)
        self.ports = [os.ttyname(slave) for slave in self._slaves]
        os.symlink(self.ports[0], os.path.join(directory, "line"))
        self._end, self._ended = os.pipe()
        self.start()

    def run(self):
        first, second = self._masters
        while True:
            ready = select.select([first, second, self._end], [], [])[0]
            if self._end in ready:
                return
            for master in ready:
                os.write(second if master == first else first, os.read(master, 4096))

    def close(self):
        os.close(self._ended)
        self.join()
        for descriptor in (*self._masters, *self._slaves, self._end):
            os.close(descriptor)


class Pymodbus(Scenario):
    def writes(self):
        """What arrived at the bank: (address, [values]). Parameters may come twice where a reply was late."""
        lines = [line.split() for line in self.log.read_text().splitlines()]
        writes = [(int(address, 16), [int(value) for value in values]) for address, *values in lines]
        return [write for before, write in zip([None, *writes], writes) if write != before or write[0] == 0x0027]

    def test_enable_and_move(self):
        machine = self.machine({"motor": spinner(limits="{ velocity: 50 rev/s, acceleration_time: 150 ms }")})
        bridge = Bridge(machine.directory)
        self.addCleanup(bridge.close)
        self.log = pathlib.Path(machine.path("bank"))
        script = pathlib.Path(__file__).parent / "harness" / "pymodbus_slave.py"
        slave = Program("pymodbus", [sys.executable, "-B", str(script), bridge.ports[1], str(self.log)],
                        machine.directory)
        self.addCleanup(slave.kill)
        wait_for(lambda: "ready" in slave.output() or not slave.running(), "pymodbus ready")
        machine.start_daemon()
        state = machine.client.wait_online("motor")
        self.assertEqual((state.drive_version, state.enabled), ("V1.1", False))
        configuration = self.writes()
        self.assertIn((0x0016, [1]), configuration)  # nothing is saved in its EEPROM
        self.assertIn((0x0011, [8]), configuration)  # 1000 pulses/rev
        self.assertFalse([w for w in configuration if w[0] in (0x0027, 0x0029, 0x0030)])

        machine.client.to_done("Enable", "motor")
        self.assertEqual(self.writes()[len(configuration):], [(0x0029, [1])])
        before = len(self.writes())
        # 2.5 rev at 5 rev/s = 300 r/min.
        machine.client.to_done("MoveRelative", "motor", distance=2.5, velocity=5.0, acceleration_time=0.2,
                               deceleration_time=0.1)
        self.assertEqual(self.writes()[before:], [(0x0020, [5, 200, 100, 300, 0, 2500]), (0x0027, [5])])
        before = len(self.writes())
        machine.client.to_done("MoveRelative", "motor", distance=-100.0, velocity=50.0)
        # -97500 pulses, high word first, two's complement.
        self.assertEqual(self.writes()[before:], [(0x0020, [5, 150, 150, 3000, 0xFFFE, 0x8324]), (0x0027, [5])])
        self.assertEqual(machine.client.state("motor").position, -97.5)
        self.assert_command(machine.client.motion("Stop", "motor", wait=DONE), "DONE")
        self.assertEqual(self.writes()[-1], (0x0028, [0]))
        machine.client.to_done("Disable", "motor")
        self.assertEqual(self.writes()[-1], (0x0029, [0]))
        (bus,) = machine.client.buses()
        self.assertEqual((bus.corrupt_replies, bus.exceptions), (0, 0), bus)


if __name__ == "__main__":
    unittest.main()
