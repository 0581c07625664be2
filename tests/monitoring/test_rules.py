"""The alerts by promtool: each fires where it should, and none where all is well. The dashboard's queries are such."""
import json
import pathlib
import shutil
import subprocess
import tempfile
import unittest

import queries
import yaml

HERE = pathlib.Path(__file__).resolve().parent


def promtool(*words):
    if shutil.which("promtool") is None:
        raise AssertionError("no promtool: install the package prometheus (deploy/install-packages.sh test)")
    return subprocess.run(["promtool", *words], capture_output=True, text=True, check=False)


class Rules(unittest.TestCase):
    #: What the rules are of, and where their tests are.
    of = {"axisd": "alerts.yml", "axisd-cell": "cell_alerts.yml"}

    def passes(self, *words):
        done = promtool(*words)
        self.assertEqual(done.returncode, 0, done.stdout + done.stderr)

    def each(self):
        for what, tests in self.of.items():
            with self.subTest(what):
                yield what, HERE / tests

    def test_alerts_are_rules(self):
        for what, _ in self.each():
            self.passes("check", "rules", str(queries.rules(what)))

    def test_alerts_fire_where_they_should(self):
        for _, tests in self.each():
            self.passes("test", "rules", str(tests))

    def test_each_alert_is_tried(self):
        for what, tests in self.each():
            wrong = yaml.safe_load(tests.read_text())["tests"][0]
            fired = [sample["labels"] for sample in wrong["promql_expr_test"][0]["exp_samples"]]
            self.assertEqual(sorted(fired), sorted(f'{{alertname="{name}"}}' for name in queries.of_alerts(what)))

    def test_each_alert_says_what_to_do(self):
        for what, _ in self.each():
            (group,) = yaml.safe_load(queries.rules(what).read_text())["groups"]
            for rule in group["rules"]:
                self.assertIn(rule["labels"]["severity"], ("critical", "warning"), rule["alert"])
                self.assertEqual(sorted(rule["annotations"]), ["remedy", "summary"], rule["alert"])

    def test_queries_of_the_dashboard_are_queries(self):
        for what, _ in self.each():
            found = queries.of_dashboard(what)
            rules = [{"record": f"panel:{number}", "expr": query} for number, (_, query) in enumerate(found)]
            self.assertGreater(len(rules), 20)
            for _, query in found:
                self.assertNotIn("$", query)
            with tempfile.NamedTemporaryFile("w", suffix=".yml") as file:
                json.dump({"groups": [{"name": "panels", "rules": rules}]}, file)  # which is YAML
                file.flush()
                self.passes("check", "rules", file.name)


if __name__ == "__main__":
    unittest.main()
