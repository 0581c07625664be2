"""What axisd tells of its buses agrees with its wire log: statistics, traces, flight records."""
import json
import pathlib
import struct
import time
import unittest

from harness import Scenario, crc, frame_bytes, pb, wait_for

USER0 = 147


def pcap_packets(data):
    """(ns since 1970, bytes) of a file in libpcap's format with nanoseconds, and its link type."""
    magic, major, minor, zone, figures, longest, link = struct.unpack_from("<IHHiIII", data)
    assert (magic, major, minor, zone, figures) == (0xA1B23C4D, 2, 4, 0, 0), data[:24].hex()
    packets, at = [], 24
    while at < len(data):
        seconds, nanoseconds, captured, original = struct.unpack_from("<IIII", data, at)
        assert captured == original <= longest, at
        packets.append((seconds * 10 ** 9 + nanoseconds, data[at + 16:at + 16 + captured]))
        at += 16 + captured
    return link, packets


class Traces(Scenario):
    def json(self, machine, *words):
        done = machine.axisctl("--json", *words)
        self.assertEqual(done.returncode, 0, done)
        return json.loads(done.stdout)

    def node(self, machine):
        """The counters of node 1, and when they were asked for: between two times of CLOCK_MONOTONIC."""
        before = time.monotonic_ns()
        (bus,) = self.json(machine, "bus", "statistics", "line")["buses"]
        (node,) = bus["nodes"]
        return node["line"], bus, before, time.monotonic_ns()

    def logged(self, machine, until):
        """The lines of the wire log, once it has come past this time."""
        def lines():
            all_of_them = machine.wire.text().splitlines()
            return all_of_them if all_of_them and int(all_of_them[-1].split()[0]) > until else None
        return wait_for(lines, "the wire log goes on")

    def test_statistics_agree_with_the_wire_log(self):
        machine = self.ready_feeder()
        first, _, first_begin, first_end = self.node(machine)
        machine.client.to_done("MoveAbsolute", "feeder", position=20.0)
        second, bus, second_begin, second_end = self.node(machine)
        replies = int(second["replies"]) - int(first["replies"])
        times = [int(line.split()[0]) for line in self.logged(machine, second_end) if line.split()[2] == "rx"]
        # A reply is counted once it is complete: within 100 ms of its first byte even on a busy computer.
        slack = 100_000_000
        self.assertGreaterEqual(replies, sum(first_end <= t < second_begin - slack for t in times))
        self.assertLessEqual(replies, sum(first_begin - slack <= t < second_end for t in times))
        self.assertGreater(replies, 10)
        self.assertEqual(second["corrupt_replies"], "0")
        self.assertGreater(bus["utilisation"], 0)
        motion = next(c for c in bus["classes"] if c["transaction_class"] == "TRANSACTION_CLASS_MOTION")
        for histogram in ("queueing", "exchange"):
            self.assertEqual(sum(map(int, motion[histogram]["counts"])), int(motion["sent"]))
        table = machine.axisctl("bus", "statistics")
        self.assertEqual(table.returncode, 0, table)
        self.assertIn("feeder", table.stdout)

    def test_a_trace_is_what_the_wire_log_says(self):
        machine = self.ready_feeder()
        text, pcap = machine.path("trace.txt"), machine.path("trace.pcap")
        for words in (("--output", text), ("--format", "pcap", "--output", pcap)):
            done = machine.axisctl("trace", "line", "--node", "1", "--for", "1s", *words)
            self.assertEqual(done.returncode, 0, done)
            self.assertIn("frames", done.stderr)
        lines = pathlib.Path(text).read_text().splitlines()
        log = self.logged(machine, time.monotonic_ns())
        self.assertGreater(len(lines), 5)
        begin = log.index(lines[0])
        self.assertEqual(lines, log[begin:begin + len(lines)])

        link, packets = pcap_packets(pathlib.Path(pcap).read_bytes())
        self.assertEqual(link, USER0)
        self.assertGreater(len(packets), 5)
        on_wire = [frame_bytes(line) for line in log if line.split()[2] in ("tx", "rx")]
        for _, frame in packets:
            self.assertEqual(frame[-2:], crc(frame[:-2]), frame.hex())
        frames = [frame for _, frame in packets]
        self.assertTrue(any(on_wire[i:i + len(frames)] == frames for i in range(len(on_wire))), frames)
        self.assertLess(abs(packets[-1][0] - time.time_ns()), 60 * 10 ** 9)
        refused = machine.axisctl("trace", "line", "--format", "candump")
        self.assertEqual(refused.returncode, 2, refused)

    def test_an_alarm_in_mid_move_leaves_a_flight_record(self):
        machine = self.ready_feeder()
        self.assertEqual(self.json(machine, "bus", "records")["records"], [])
        self.move_under_way(machine)
        machine.sim.control("alarm 1 2")
        machine.client.wait_state("feeder", lambda s: s.state == pb.STATE_ERROR_STOP, "the alarm")
        record = wait_for(lambda: self.json(machine, "bus", "records")["records"], "a flight record")[0]
        self.assertEqual(record["bus"], "line")
        self.assertIn("feeder: ErrorStop", record["reason"])
        events = machine.axisctl("events", "feeder", "--kind", "flight")
        self.assertIn(record["name"], events.stdout)
        text = machine.axisctl("bus", "record", record["name"]).stdout
        self.assertEqual(len(text), int(record["size"]))
        self.assertEqual(text, (pathlib.Path(machine.state_directory) / "flight" / record["name"]).read_text())
        lines = [line for line in text.splitlines() if not line.startswith("#")]
        log = self.logged(machine, time.monotonic_ns())
        self.assertEqual(lines, log[:len(lines)])  # the ring holds more than there was
        self.assertRegex(text, r"tx 01 06 00 28 00 00 .. .. @stop\n")  # the one that followed
        asked = machine.axisctl("bus", "record-now", "line")
        self.assertEqual(asked.returncode, 0, asked)
        self.assertEqual(len(self.json(machine, "bus", "records")["records"]), 2)


if __name__ == "__main__":
    unittest.main()
