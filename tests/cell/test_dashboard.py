"""A real Prometheus scrapes machines, entrances and etcd of a cell: every query of deploy/ for a cell works on that."""
import json
import pathlib
import re
import shutil
import sys
import unittest
import urllib.error
import urllib.parse
import urllib.request

from harness import ROOT, Program, wait_for
from harness.scrape import scrape
from rig import CellClient, CellScenario

sys.path.insert(0, str(ROOT / "tests" / "monitoring"))
import queries  # noqa: E402

ROW = re.compile(r"^\| `(axisd_\w+)` \| (\w+) \| ([^|]*) \| (.*) \|$", re.MULTILINE)


class Dashboard(CellScenario):
    def setUp(self):
        super().setUp()
        if shutil.which("prometheus") is None:
            self.fail("no prometheus: install the package of that name (deploy/install-packages.sh test)")
        self.one = self.cell().start_all()
        config = pathlib.Path(self.one.path("prometheus.yml"))
        pki = self.one.path("pki")

        def job(name, port, **more):
            targets = [f"{self.one.address(machine)}:{port}" for machine in self.one.machines]
            return {"job_name": name, "static_configs": [{"targets": targets}], **more}
        config.write_text(json.dumps({
            "global": {"scrape_interval": "1s", "evaluation_interval": "1s"},
            "rule_files": [str(queries.rules("axisd")), str(queries.rules("axisd-cell"))],
            "scrape_configs": [job("axisd", 9464), job("axisd-cell", 9465), job("axisd-etcd", 2379, scheme="https", tls_config={
                "ca_file": f"{pki}/ca.crt", "cert_file": f"{pki}/shift-a.crt", "key_file": f"{pki}/shift-a.key"})]}))
        # This process has a network of its own: the port is nobody else's.
        self.program = Program("prometheus", ["prometheus", f"--config.file={config}",
                                              f"--storage.tsdb.path={self.one.path('tsdb')}",
                                              "--web.listen-address=127.0.0.1:9090"], self.one.directory)
        self.addCleanup(self.program.terminate)

    def ask(self, path, **words):
        url = f"http://127.0.0.1:9090/api/v1/{path}?{urllib.parse.urlencode(words)}"
        try:
            with urllib.request.urlopen(url, timeout=60) as answer:
                return json.load(answer)["data"]
        except urllib.error.HTTPError as refused:
            self.fail(f"{words}: {refused.read().decode()}")

    def query(self, text):
        return self.ask("query", query=text)["result"]

    def value(self, text):
        (found,) = self.query(text)
        return float(found["value"][1])

    def scraped(self, times):
        try:
            found = self.query("min(count_over_time(up[10m])) and count(up) == 9")
        except (urllib.error.URLError, ConnectionError):  # it does not listen yet
            return False
        return bool(found) and float(found[0]["value"][1]) >= times

    def test_each_metric_is_on_the_page(self):
        client = CellClient(self.one, "press-1")
        wait_for(lambda: client.states() == dict.fromkeys(self.one.machines, "PRESENT"), "all are present")
        CellClient(self.one, "press-1", "press-2").info()
        url = f"http://{self.one.address('press-1')}:9465/metrics"
        # Its text is made once a second.
        wait_for(lambda: len(scrape(url).named("axisd_cell_machine_round_trip_seconds")) == 3, "all have answered")
        wait_for(lambda: len(scrape(url).named("axisd_cell_machine_clock_offset_seconds")) == 2, "the others' clocks are known")
        served = scrape(url)
        _, _, page = (ROOT / "docs" / "metrics.md").read_text().partition("\n## A cell\n")
        rows = {name: (kind, labels, words) for name, kind, labels, words in ROW.findall(page)}
        self.assertEqual({name: words for name, (_, _, words) in rows.items()},
                         {name: words for name, (_, words) in served.families.items()})
        for name, (kind, labels, _) in rows.items():
            expected = {label for label in labels.strip().split(", ") if label}
            found = served.named(name + ("_count" if kind == "histogram" else ""))
            self.assertTrue(found, name)
            for sample, _ in found:
                self.assertEqual(set(sample), expected, name)

    def test_it_answers_what_deploy_asks_and_misses_a_machine(self):
        client = CellClient(self.one, "press-1")
        wait_for(lambda: client.states() == dict.fromkeys(self.one.machines, "PRESENT"), "all are present")
        for machine in self.one.machines:
            other = CellClient(self.one, "press-1", machine)
            wait_for(lambda c=other: c.info().machine, f"{machine} answers through press-1")
        wait_for(lambda: self.scraped(3), "Prometheus scrapes")
        self.assertEqual(self.value("sum(up)"), 9, self.ask("targets")["activeTargets"])
        served = {name for name in self.ask("label/__name__/values")}
        for title, query in [*queries.of_dashboard("axisd-cell"), *queries.of_alerts("axisd-cell").items()]:
            missing = queries.metrics(query) - served
            self.assertEqual(missing, set(), f"{title}: nobody tells that")
        for title, query in queries.of_dashboard("axisd-cell"):
            wait_for(lambda q=query: self.query(q), f"{title}: {query}")
        self.assertEqual(self.value('max(axisd_cell_machines{state="present"})'), 3)
        # All of them are on one computer, and have one clock.
        wait_for(lambda: len(self.query("axisd_cell_machine_clock_offset_seconds")) == 6, "each knows both others' clocks")
        self.assertEqual(self.query("abs(axisd_cell_machine_clock_offset_seconds) > axisd_cell_machine_clock_error_seconds"), [])

        (rules,) = [group for group in self.ask("rules")["groups"] if group["name"] == "axisd-cell"]
        self.assertEqual({rule["name"] for rule in rules["rules"]}, set(queries.of_alerts("axisd-cell")))
        for rule in rules["rules"]:
            self.assertEqual(rule["health"], "ok", rule.get("lastError"))
        silent = queries.of_alerts("axisd-cell")["AxisdCellMachineSilent"]
        self.assertEqual(self.query(silent), [])
        self.one.kill("press-3", "axisd")
        (found,) = wait_for(lambda: self.query(silent), "the silent machine is missed")
        self.assertEqual(found["metric"], {"cell": "demo", "machine": "press-3"})


if __name__ == "__main__":
    unittest.main()
