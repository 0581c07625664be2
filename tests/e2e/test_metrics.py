"""Metrics: what a scrape of a machine has, that it is documented, and that nobody suffers by scrapes."""
import concurrent.futures
import re
import threading
import time
import unittest
import urllib.error

from harness import DONE, ROOT, CallFailed, Demo, Scenario, axis_pb, spinner, system_pb, wait_for
from harness.scrape import OPENMETRICS, Scrape, address, fetch, scrape

STATES = ("Disabled", "Standstill", "Homing", "DiscreteMotion", "ContinuousMotion", "SynchronizedMotion", "Stopping",
          "ErrorStop")
ROW = re.compile(r"(?m)^\| `([a-z_]+)` \| (\w+) \| ([a-z, ]*) ?\| (.*) \|$")
#: What computers that are busy with tests may take of a stop's time beyond its bound, s.
BUSY = 1.0


class Metrics(Scenario):
    def demo(self):
        demo = Demo(metrics=True)
        self.addCleanup(demo.close)
        return demo, address(demo.daemon)

    def metered_spinner(self):
        machine = self.machine({"spinner": spinner()})
        machine.server = f'{{ listen: "unix:{machine.socket}", metrics: {{ listen: 127.0.0.1:0 }} }}'
        machine.write_config()
        machine.start()
        machine.client.to_done("Enable", "spinner")
        return machine, address(machine.daemon)

    def test_the_demo_shows_what_it_did(self):
        demo, url = self.demo()
        client = demo.client
        for state in client.states():
            client.wait_online(state.axis)
        client.to_done("Enable", "dial")
        for distance in (5.0, -5.0, 20.0):
            client.to_done("MoveRelative", "dial", distance=distance)
        client.call(client.system.StopAll, system_pb.StopAllRequest(wait_until=DONE), timeout=60)
        found = wait_for(lambda: (lambda now: now if now.value("axisd_stop_alls_total") else None)(scrape(url)),
                         "the StopAll is in the metrics")
        self.assertEqual(found.value("axisd_commands_total", kind="move_relative", state="done"), 3)
        self.assertEqual(found.value("axisd_commands_total", kind="move_relative", state="accepted"), 3)
        self.assertEqual(found.value("axisd_inhibited"), 1)
        axes = {state.axis: state for state in client.states()}
        for axis, state in axes.items():
            shown = [found.value("axisd_axis_state", axis=axis, state=name) for name in STATES]
            self.assertEqual(sum(shown), 1, axis)
            self.assertEqual(found.value("axisd_axis_link", axis=axis, state="online"), 1)
            self.assertEqual(found.value("axisd_axis_info", axis=axis, bus=state.bus, node=str(state.node),
                                         model=state.model, unit=state.unit), 1, state)
        self.assertEqual(found.value("axisd_axis_state", axis="dial", state="Standstill"), 1)
        self.assertAlmostEqual(found.value("axisd_axis_position", axis="dial", unit=axes["dial"].unit),
                               axes["dial"].position, delta=1)
        for bus in {state.bus for state in axes.values()}:
            self.assertEqual(found.value("axisd_bus_open", bus=bus), 1)
            self.assertGreater(found.value("axisd_bus_transactions_total", bus=bus, outcome="answered",
                                           **{"class": "parameters"}), 10)
            self.assertGreater(found.value("axisd_stop_frame_bound_seconds", bus=bus, scope="all"), 0)
        self.assertGreater(found.value("axisd_stop_frame_seconds_count", bus=axes["dial"].bus, scope="all"), 0)
        self.assertGreater(found.value("axisd_journal_sync_seconds_count"), 0)
        self.assertGreater(found.value("axisd_core_longest_handler_seconds"), 0)
        self.assertGreater(found.value("process_cpu_seconds_total"), 0)
        self.assertGreater(found.value("process_resident_memory_bytes"), 1 << 20)

    def test_every_metric_is_documented_as_it_is(self):
        demo, url = self.demo()
        text = fetch(url, OPENMETRICS)
        self.assertTrue(text.endswith("\n# EOF\n"))
        suffix = {"counter": "_total", "info": "_info"}
        served = Scrape(text.removesuffix("# EOF\n"))
        families = {name + suffix.get(kind, ""): (kind, words) for name, (kind, words) in served.families.items()}
        own, _, _ = (ROOT / "docs" / "metrics.md").read_text().partition("\n## A cell\n")
        rows = ROW.findall(own)
        self.assertEqual({name: (kind, words) for name, kind, _, words in rows}, families)
        for name, kind, labels, _ in rows:
            expected = {label for label in labels.strip().split(", ") if label}
            for found, _ in served.named(name + ("_count" if kind == "histogram" else "")):
                self.assertEqual(set(found), expected, name)
        plain = scrape(url)
        self.assertEqual(set(plain.families), set(families))

    def test_names_that_clients_say_are_nowhere(self):
        machine, url = self.metered_spinner()
        before = set(scrape(url).samples)

        def ask(number):
            with self.assertRaises(CallFailed):
                machine.client.call(machine.client.axis.Stop, axis_pb.StopRequest(axis=f"stranger-{number}"))

        with concurrent.futures.ThreadPoolExecutor(8) as threads:
            list(threads.map(ask, range(10_000)))
        begun = scrape(url).value("axisd_metrics_scrapes_total")
        time.sleep(2.5)  # the figures of the core, and the text, are a second old at most
        after = scrape(url)
        self.assertGreater(after.value("axisd_metrics_scrapes_total"), begun)
        self.assertEqual(set(after.samples), before)
        self.assertNotIn("stranger", fetch(url))

    def test_a_flood_of_scrapes_keeps_no_stop(self):
        machine, url = self.metered_spinner()
        flooding = threading.Event()
        flooding.set()

        def flood():
            count = 0
            while flooding.is_set():
                try:
                    fetch(url)
                    count += 1
                except (urllib.error.URLError, ConnectionError):  # the backlog may be full
                    pass
            return count

        with concurrent.futures.ThreadPoolExecutor(20) as threads:
            begun = time.monotonic()
            floods = [threads.submit(flood) for _ in range(20)]
            for _ in range(10):
                machine.client.motion("MoveVelocity", "spinner", velocity=5.0)
                machine.client.to_done("Stop", "spinner")
            flooding.clear()
            answered = sum(each.result() for each in floods)
            # One each 40 ms, on one address; what was waiting at the end is answered, too.
            self.assertLessEqual(answered, (time.monotonic() - begun) / 0.04 + 2)
            self.assertGreater(answered, 20)
        found = wait_for(lambda: (lambda now: now if now.value(
            "axisd_stop_frame_seconds_count", bus="line", scope="some") == 10 else None)(scrape(url)),
                         "all stops are counted")
        bound = found.value("axisd_stop_frame_bound_seconds", bus="line", scope="one")
        self.assertLess(found.value("axisd_stop_frame_longest_seconds", bus="line", scope="some"), bound + BUSY)

    def test_an_address_that_is_taken_is_told(self):
        machine, url = self.metered_spinner()
        other = self.machine({"spinner": spinner()})
        port = url.rsplit(":", 1)[1].removesuffix("/metrics")
        other.server = f'{{ listen: "unix:{other.socket}", metrics: {{ listen: "127.0.0.1:{port}" }} }}'
        other.write_config()
        other.start_lines()
        daemon = other.start_daemon(wait=False)
        self.assertEqual(daemon.wait(), 1)
        self.assertIn("server.metrics.listen", daemon.log())


if __name__ == "__main__":
    unittest.main()
