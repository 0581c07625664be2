"""A real Prometheus scrapes the demo: it takes what it gets, and every query of deploy/ works on that."""
import json
import pathlib
import shutil
import socket
import unittest
import urllib.error
import urllib.parse
import urllib.request

import queries
from harness import Demo, Scenario, wait_for
from harness.programs import Program
from harness.scrape import address, scrape

#: What the demo has none of, or has by the grace of a model.
EMPTY = {"Certificate expires in", "Following error"}


def free_port():
    with socket.socket() as found:
        found.bind(("127.0.0.1", 0))
        return found.getsockname()[1]


class Prometheus(Scenario):
    def setUp(self):
        super().setUp()
        if shutil.which("prometheus") is None:
            self.fail("no prometheus: install the package of that name (deploy/install-packages.sh test)")
        self.demo = Demo(metrics=True)
        self.addCleanup(self.demo.close)
        self.url = address(self.demo.daemon)
        target = urllib.parse.urlparse(self.url).netloc
        directory = pathlib.Path(self.demo.directory)
        config = directory / "prometheus.yml"
        config.write_text(json.dumps({
            "global": {"scrape_interval": "1s", "evaluation_interval": "1s"}, "rule_files": [str(queries.rules())],
            "scrape_configs": [{"job_name": "axisd", "static_configs": [{"targets": [target]}]}]}))
        self.api = f"http://127.0.0.1:{free_port()}/api/v1"
        self.program = Program("prometheus", [
            "prometheus", f"--config.file={config}", f"--storage.tsdb.path={directory / 'tsdb'}",
            f"--web.listen-address={urllib.parse.urlparse(self.api).netloc}"], directory)
        self.addCleanup(self.program.terminate)

    def ask(self, path, **words):
        url = f"{self.api}/{path}?{urllib.parse.urlencode(words)}"
        try:
            with urllib.request.urlopen(url, timeout=60) as answer:
                return json.load(answer)["data"]
        except urllib.error.HTTPError as refused:
            self.fail(f"{words}: {refused.read().decode()}")

    def query(self, text):
        return self.ask("query", query=text)["result"]

    def scraped(self, times):
        """Whether it has taken so many scrapes."""
        try:
            found = self.query('count_over_time(up{job="axisd"}[10m])')
        except (urllib.error.URLError, ConnectionError):  # it does not listen yet
            return False
        return bool(found) and float(found[0]["value"][1]) >= times

    def test_it_answers_what_deploy_asks(self):
        client = self.demo.client
        client.wait_online("dial")
        wait_for(lambda: self.scraped(2), "Prometheus scrapes")
        client.to_done("Enable", "dial")
        client.to_done("MoveRelative", "dial", distance=10.0)
        client.to_done("Stop", "dial")
        wait_for(lambda: self.query('axisd_commands_total{kind="stop",state="done"} > 0'), "Prometheus saw the stop")
        wait_for(lambda: self.query('rate(axisd_stop_frame_seconds_count{scope="some"}[1m]) > 0'), "as a rate, too")
        (up,) = self.query('up{job="axisd"}')
        (target,) = self.ask("targets")["activeTargets"]
        self.assertEqual(up["value"][1], "1", target["lastError"])
        served = scrape(self.url).names()
        for title, query in [*queries.of_dashboard(), *queries.of_alerts().items()]:
            self.assertLessEqual(queries.metrics(query), served, title)
        for title, query in queries.of_dashboard():
            if title not in EMPTY:
                self.assertTrue(self.query(query), f"{title}: {query}")
        for query in queries.of_alerts().values():
            self.query(query)
        (group,) = self.ask("rules")["groups"]
        self.assertEqual({rule["name"] for rule in group["rules"]}, set(queries.of_alerts()))
        for rule in group["rules"]:
            self.assertEqual(rule["health"], "ok", rule.get("lastError"))


if __name__ == "__main__":
    unittest.main()
