"""Traces of a network in the formats of can-utils, which read them back."""
import pathlib
import re
import struct
import subprocess
import unittest

from harness import CanScenario, turntable, wait_for

CAN_SOCKETCAN = 227


class Traces(CanScenario):
    def test_a_trace_is_what_candump_saw_and_canplayer_plays_it(self):
        machine = self.cell(axes={"table": turntable()}, sync_period="20 ms")
        files = {name: machine.path(f"trace.{name}") for name in ("candump", "pcap")}
        seen = self.candump()
        for name, file in files.items():
            done = machine.axisctl("trace", "can0", "--format", name, "--output", file, "--for", "1s")
            self.assertEqual(done.returncode, 0, done)
        lines = pathlib.Path(files["candump"]).read_text().splitlines()
        self.assertGreater(len(lines), 50)
        for line in lines:
            self.assertRegex(line, r"^\(\d{10}\.\d{6}\) vcan0 [0-9A-F]{3}#([0-9A-F]{2})*$")
        frames = [line.split()[2] for line in lines]
        others = [frame for frame in seen.frames() if int(frame.split("#")[0], 16) >> 7 == 0x580 >> 7]
        for frame in [frame for frame in frames if frame.startswith("585#")]:
            self.assertIn(frame, others)

        data = pathlib.Path(files["pcap"]).read_bytes()
        self.assertEqual(struct.unpack_from("<I", data, 20)[0], CAN_SOCKETCAN)
        at, packets = 24, 0
        while at < len(data):
            size = struct.unpack_from("<I", data, at + 8)[0]
            identifier, length = struct.unpack_from(">IB", data, at + 16)
            self.assertLess(identifier, 0x800)
            self.assertEqual(size, 8 + length)
            at, packets = at + 16 + size, packets + 1
        self.assertGreater(packets, 50)

        classes, nodes = machine.axisctl("bus", "statistics", "can0").stdout.split("\n\n")
        self.assertRegex(classes, r"can0: occupied (?!0 %)\d")
        self.assertRegex(classes, r"(?m)^parameters +[1-9]")  # each that was brought up was asked
        self.assertTrue(re.search(r"5 +table", nodes), nodes)
        machine.sim.close()
        machine.lines.clear()
        machine.daemon.terminate()
        replayed = self.candump("vcan1")
        done = subprocess.run(["canplayer", "-t", "-I", files["candump"], "vcan1=vcan0"], capture_output=True,
                              check=False, timeout=60)
        self.assertEqual(done.returncode, 0, done)
        wait_for(lambda: len(replayed.frames()) == len(frames), "all of them")
        self.assertEqual(replayed.frames(), frames)


if __name__ == "__main__":
    unittest.main()
