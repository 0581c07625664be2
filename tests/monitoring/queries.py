"""The queries of deploy/: those of the dashboards, as Grafana would send them, and those of the alerts. `axisd` is for the
daemon of one machine, `axisd-cell` for a cell."""
import json
import pathlib
import re

import yaml

DEPLOY = pathlib.Path(__file__).resolve().parents[2] / "deploy"
METRIC = re.compile(r"\b(?:axisd|process|etcd)_[a-z_]+\b")


def rules(what="axisd"):
    return DEPLOY / "prometheus" / f"{what}.rules.yml"


def of_alerts(what="axisd"):
    """Name to query."""
    (group,) = yaml.safe_load(rules(what).read_text())["groups"]
    return {rule["alert"]: rule["expr"] for rule in group["rules"]}


def of_dashboard(what="axisd"):
    """Title of the panel, and query, of each."""
    panels = json.loads((DEPLOY / "grafana" / f"{what}.json").read_text())["panels"]
    queries = [(panel["title"], target["expr"]) for panel in panels for target in panel["targets"]]
    return [(title, query.replace("$__rate_interval", "1m").replace("$instance", ".*").replace("$bus", ".*")
             .replace("$axis", ".*").replace("$cell", ".*")) for title, query in queries]


def metrics(query):
    return set(METRIC.findall(query))
