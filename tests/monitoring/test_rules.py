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
    def passes(self, *words):
        done = promtool(*words)
        self.assertEqual(done.returncode, 0, done.stdout + done.stderr)

    def test_alerts_are_rules(self):
        self.passes("check", "rules", str(queries.RULES))

    def test_alerts_fire_where_they_should(self):
        self.passes("test", "rules", str(HERE / "alerts.yml"))

    def test_each_alert_is_tried(self):
        wrong = yaml.safe_load((HERE / "alerts.yml").read_text())["tests"][0]
        fired = [sample["labels"] for sample in wrong["promql_expr_test"][0]["exp_samples"]]
        self.assertEqual(sorted(fired), sorted(f'{{alertname="{name}"}}' for name in queries.of_alerts()))

    def test_each_alert_says_what_to_do(self):
        (group,) = yaml.safe_load(queries.RULES.read_text())["groups"]
        for rule in group["rules"]:
            self.assertIn(rule["labels"]["severity"], ("critical", "warning"), rule["alert"])
            self.assertEqual(sorted(rule["annotations"]), ["remedy", "summary"], rule["alert"])

    def test_queries_of_the_dashboard_are_queries(self):
        rules = [{"record": f"panel:{number}", "expr": query} for number, (_, query) in enumerate(queries.of_dashboard())]
        self.assertGreater(len(rules), 20)
        for _, query in queries.of_dashboard():
            self.assertNotIn("$", query)
        with tempfile.NamedTemporaryFile("w", suffix=".yml") as file:
            json.dump({"groups": [{"name": "panels", "rules": rules}]}, file)  # which is YAML
            file.flush()
            self.passes("check", "rules", file.name)


if __name__ == "__main__":
    unittest.main()
