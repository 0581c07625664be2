"""The queries of deploy/: those of the dashboard, as Grafana would send them, and those of the alerts."""
import json
import pathlib
import re

import yaml

DEPLOY = pathlib.Path(__file__).resolve().parents[2] / "deploy"
RULES = DEPLOY / "prometheus" / "axisd.rules.yml"
DASHBOARD = DEPLOY / "grafana" / "axisd.json"
METRIC = re.compile(r"\b(?:axisd|process)_[a-z_]+\b")


def of_alerts():
    """Name to query."""
    (group,) = yaml.safe_load(RULES.read_text())["groups"]
    return {rule["alert"]: rule["expr"] for rule in group["rules"]}


def of_dashboard():
    """Title of the panel, and query, of each."""
    panels = json.loads(DASHBOARD.read_text())["panels"]
    queries = [(panel["title"], target["expr"]) for panel in panels for target in panel["targets"]]
    return [(title, query.replace("$__rate_interval", "1m").replace("$instance", ".*").replace("$bus", ".*")
             .replace("$axis", ".*")) for title, query in queries]


def metrics(query):
    return set(METRIC.findall(query))
