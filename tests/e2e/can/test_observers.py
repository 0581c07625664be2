"""Others on the bus, which were not written for axisd, see what the daemon's log says: python3-can and candump."""
import unittest

import can
from harness import CanScenario, heartbeat, turntable, wait_for

SYNC, TPDO1, STARTED = 0x080, 0x180, 0x05


class Observers(CanScenario):
    def python_can(self):
        bus = can.Bus(interface="socketcan", channel="vcan0")
        reader = can.BufferedReader()
        notifier = can.Notifier(bus, [reader])
        self.addCleanup(bus.shutdown)
        self.addCleanup(notifier.stop)
        return reader

    def test_nmt_sync_heartbeat_and_pdos(self):
        reader = self.python_can()
        dump = self.candump()
        machine = self.cell(axes={"table": turntable()}, sync_period="20 ms")
        machine.client.to_done("MoveAbsolute", "table", position=90.0)
        wait_for(lambda: any(f.data == b"\x05" for f in machine.frames.frames("rx", cob_id=heartbeat(5))),
                 "a heartbeat of a started node")
        machine.sim.close()  # first: then nothing is on the bus that only some have seen
        machine.lines.clear()
        machine.daemon.terminate()
        messages = []
        while (message := reader.get_message(timeout=0.2)) is not None:
            messages.append(message)

        def of(cob_id):
            return [bytes(message.data) for message in messages if message.arbitration_id == cob_id]
        self.assertFalse([m for m in messages if m.is_error_frame or m.is_extended_id or m.is_remote_frame])
        self.assertIn(b"\x01\x05", of(0x000))  # NMT: start node 5, and never all nodes
        self.assertEqual([data for data in of(0x000) if data[1] == 0], [])
        self.assertGreater(len(of(SYNC)), 5)
        self.assertEqual(set(of(SYNC)), {b""})
        self.assertIn(bytes([STARTED]), of(heartbeat(5)))
        # TPDO1: status word, position, speed. The last one shows the target: 90 deg are 10000 pulses.
        last = of(TPDO1 + 5)[-1]
        self.assertEqual(int.from_bytes(last[2:6], "little", signed=True), 10000)
        self.assertEqual(int.from_bytes(last[6:8], "little", signed=True), 0)

        # Frame by frame, what the daemon says that it sent is what was on the bus, in that order, no more and no less.
        said = [f"{f.id:03X}#{f.data.hex().upper()}" for f in machine.frames.frames("tx")]
        mine = [frame for frame in dump.frames() if self.is_masters(int(frame.split("#")[0], 16))]
        self.assertEqual(mine, said)
        self.assertEqual([f"{m.arbitration_id:03X}#{bytes(m.data).hex().upper()}" for m in messages
                          if self.is_masters(m.arbitration_id)], said)

    @staticmethod
    def is_masters(cob_id):
        return cob_id in (0x000, SYNC) or cob_id >> 7 in (0x200 >> 7, 0x300 >> 7, 0x400 >> 7, 0x500 >> 7, 0x600 >> 7)


if __name__ == "__main__":
    unittest.main()
