"""How far the clocks of other computers are from an entrance's own, as its metrics tell."""
import os
import re
import unittest

from harness import wait_for
from harness.scrape import scrape
from support import HOST, CellScenario

OFFSET, ERROR = "axisd_cell_machine_clock_offset_seconds", "axisd_cell_machine_clock_error_seconds"
HOUR = 3600


def ahead(seconds):
    """A computer that was started so much earlier than this one."""
    return ("/usr/bin/unshare", "-T" if os.geteuid() == 0 else "-rT", "--boottime", str(seconds), "--monotonic",
            str(seconds))


class Clocks(CellScenario):
    def setUp(self):
        super().setUp()
        here, there = self.press(1), self.press(2)
        self.there = self.entrance(there, start=False)
        self.there.before = ahead(HOUR)
        self.there.start()
        self.here = self.entrance(here, keys=f"""metrics: {{ listen: "{HOST}:0" }}
peers: {{ press-2: {{ axisd: "unix:{there.socket}", cell: "{self.there.address}" }} }}""")
        port = wait_for(lambda: re.search(r"metrics at port (\d+)", self.here.program.log()), "it tells the port")[1]
        self.url = f"http://{HOST}:{port}/metrics"

    def known(self):
        """Machine to (offset, error)."""
        page = scrape(self.url)
        errors = {labels["machine"]: value for labels, value in page.named(ERROR)}
        return {labels["machine"]: (value, errors[labels["machine"]]) for labels, value in page.named(OFFSET)}

    def expect(self, seconds):
        def found():
            known = self.known().get("press-2")
            return known if known and abs(known[0] - seconds) < HOUR / 2 else None
        offset, error = wait_for(found, f"press-2 is about {seconds} s ahead")
        self.assertTrue(0 < error < 1, error)
        self.assertLessEqual(abs(offset - seconds), error)
        print(f"offset {offset - seconds:+.9f} s beside the truth, off by {error:.9f} s at most")

    def test_they_are_told_with_what_they_may_be_off_by(self):
        self.expect(HOUR)
        self.assertEqual(set(self.known()), {"press-2"}, "its own is no other's")

    def test_a_computer_that_was_started_anew(self):
        self.expect(HOUR)
        self.there.kill()
        wait_for(lambda: not self.known(), "whoever does not answer has no clock")
        self.there.before = ahead(3 * HOUR)
        self.there.start()
        self.expect(3 * HOUR)


if __name__ == "__main__":
    unittest.main()
