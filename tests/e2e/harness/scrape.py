"""The metrics of a daemon, as a scrape has them."""
import re
import urllib.request

from .programs import wait_for

ADDRESS = re.compile(r"metrics at (http://\S+)")
SAMPLE = re.compile(r'([a-z_]+)(?:\{(.*)\})? (\S+)')
LABEL = re.compile(r'([a-z_]+)="((?:[^"\\]|\\.)*)"')
OPENMETRICS = "application/openmetrics-text;version=1.0.0,*/*;q=0.1"
#: What samples of a histogram have behind its name.
PARTS = ("_bucket", "_sum", "_count")


def address(daemon):
    """Where a daemon has its metrics, once it has."""
    return wait_for(lambda: ADDRESS.search(daemon.log()), "the daemon tells where its metrics are")[1]


def fetch(url, accept="text/plain"):
    with urllib.request.urlopen(urllib.request.Request(url, headers={"Accept": accept}), timeout=60) as answer:
        return answer.read().decode()


class Scrape:
    """`families`: name to (type, help); `samples`: (name, labels as a set of pairs) to value."""

    def __init__(self, text):
        self.families, self.samples = {}, {}
        helps = {}
        for line in text.splitlines():
            if line.startswith("# HELP "):
                _, _, name, words = line.split(" ", 3)
                helps[name] = words
            elif line.startswith("# TYPE "):
                _, _, name, kind = line.split(" ")
                self.families[name] = (kind, helps[name])
            elif not line.startswith("#"):
                name, labels, value = SAMPLE.fullmatch(line).groups()
                key = (name, frozenset(LABEL.findall(labels or "")))
                assert key not in self.samples, line
                self.samples[key] = float(value)

    def value(self, name, **labels):
        """Of the only sample; None: there is none."""
        return self.samples.get((name, frozenset(labels.items())))

    def named(self, name):
        """Labels as a dictionary, and value, of each sample of this name."""
        return [(dict(labels), value) for (found, labels), value in self.samples.items() if found == name]

    def names(self):
        """Everything that a query may name."""
        parts = {name + part for name, (kind, _) in self.families.items() if kind == "histogram" for part in PARTS}
        return set(self.families) | parts


def scrape(url):
    return Scrape(fetch(url))
