"""A person at the terminal of axisctl commission: reads what it says on a pseudo terminal, and types answers."""
import errno
import json
import os
import pty
import re
import select
import signal
import subprocess
import threading
import time

from .case import Scenario
from .machine import feeder
from .programs import AXISCTL, LIMIT, wait_for
from .wire import HOMING, START

#: Of the axis: terminals are read often, and its way is long enough that what has to end a motion comes before its end,
#: however busy the computer is.
SHORT_WAITS = {"poll": "{ idle: 20 ms }", "jog_travel": "400 mm",
               "homing": "{ method: home_negative, velocity: 80 mm/s, search_velocity: 5 mm/s, backoff: 5 mm, "
                         "max_travel: 450 mm, timeout: 60 s }"}
#: Quicker than the default.
QUICK = ("--velocity", "20mm/s", "--distance", "5mm")


class ScriptedOperator:
    """`rules`: what to do at a text, in order of precedence: (pattern, answer). The answer is a line, None for nothing
    at all, or a function of the match that returns one of both. Each place of the text is met once."""

    def __init__(self, machine, axis, rules, options=(), record=None):
        self.rules, self.text, self._seen = rules, "", 0
        self.record_path = record or machine.path(f"record-{axis}.json")
        words = [AXISCTL, "--server", f"unix:{machine.socket}", "commission", axis, "--record", self.record_path,
                 "--operator", "e2e", *options]
        self.terminal, end = pty.openpty()
        self.process = subprocess.Popen(words, stdin=end, stdout=end, stderr=end, close_fds=True, start_new_session=True)
        os.close(end)

    def type(self, line):
        os.write(self.terminal, f"{line}\n".encode())

    def type_ahead(self, *lines):
        """Types while the program does not run: it finds all of it at once. A pseudo terminal hands over what was typed
        when the kernel comes to it; the echo shows that it has."""
        self.process.send_signal(signal.SIGSTOP)
        os.waitid(os.P_PID, self.process.pid, os.WSTOPPED)
        heard = len(self.text)
        for line in lines:
            self.type(line)
        wait_for(lambda: self._read() and self.text.count("\n", heard) >= len(lines), "what was typed has arrived")
        self.process.send_signal(signal.SIGCONT)

    def interrupt(self):
        """As Ctrl-C does."""
        self.process.send_signal(signal.SIGINT)

    def _read(self):
        if not select.select([self.terminal], [], [], 0.02)[0]:
            return True
        try:
            data = os.read(self.terminal, 65536)
        except OSError as error:
            if error.errno != errno.EIO:
                raise
            return False
        self.text += data.decode(errors="replace").replace("\r\n", "\n")
        return bool(data)

    def _react(self):
        """To the first text not reacted to yet."""
        found = [(match.end(), place, match, answer) for place, (pattern, answer) in enumerate(self.rules)
                 for match in [re.compile(pattern).search(self.text, self._seen)] if match]
        if not found:
            return
        end, _, match, answer = min(found, key=lambda one: one[:2])
        self._seen = end
        line = answer(match) if callable(answer) else answer
        if line is not None:
            self.type(line)

    def finish(self, limit=2 * LIMIT):
        """Answers until the program has ended; its exit status."""
        deadline = time.monotonic() + limit
        while self._read():
            self._react()
            if time.monotonic() > deadline:
                self.process.kill()
                raise AssertionError(f"not at its end within {limit:g} s:\n{self.text}")
        os.close(self.terminal)
        return self.process.wait(LIMIT)

    def record(self):
        with open(self.record_path, encoding="utf-8") as file:
            return json.load(file)

    def verdicts(self):
        """Of each step by its name, without the prefix."""
        return {step["name"]: step.get("verdict", "VERDICT_OPEN").removeprefix("VERDICT_")
                for step in self.record().get("steps", [])}

    def step(self, name):
        return next(step for step in self.record()["steps"] if step["name"] == name)


class Hand:
    """Of an operator who does what is asked for. `reacts`: terminals that react in place of others; `low`: those of
    switches that open when they are actuated."""

    def __init__(self, machine, node=1, reacts=None, low=()):
        self.machine, self.node, self.reacts, self.low = machine, node, reacts or {}, low

    def press(self, match):
        terminal = self.reacts.get(match[1], match[1])
        self.machine.sim.control(f"input {self.node} {terminal} {'off' if terminal in self.low else 'on'}")

    def release(self, match):
        self.machine.sim.control(f"input {self.node} {match[1]} auto")

    def once_under_way(self, action):
        """Some time after the motion began."""
        start = self.machine.sim.shaft(self.node).position

        def act():
            wait_for(lambda: abs(self.machine.sim.shaft(self.node).position - start) > 100, "under way")
            action()
        threading.Thread(target=act).start()

    def to_the_switch(self, match):
        """Says yes, and actuates the switch once the axis is under way."""
        self.once_under_way(lambda: self.press(match))
        return "yes"

    def rules(self):
        return [(r"Actuate (\w+) \(\w+\) by hand", self.press), (r"(\w+) is active\. Release it", self.release),
                (r"Release (\w+)\. ", self.release),
                (r"Go to the switch at (\w+) [^?]*\? \[yes/skip/abort\] ", self.to_the_switch),
                (r"again/go-on/abort\] ", "go-on"), (r"Why is it left out\? ", "no time"), (r"/abort\] ", "yes")]


class CommissionScenario(Scenario):
    """Commissions the feeder."""

    def cell(self, **keys):
        """The feeder stands 10 mm from its home switch; nothing is enabled."""
        return self.machine({"feeder": feeder(**SHORT_WAITS | keys)}).start()

    def person(self, machine, *rules, options=QUICK, hand=None):
        """An operator who says yes and does what is asked for, but for `rules`."""
        return ScriptedOperator(machine, "feeder", [*rules, *(hand or Hand(machine)).rules()], options)

    def assert_verdicts(self, person, **expected):
        """Of these steps, with _ for the blanks in their names."""
        verdicts = {name.replace(" ", "_"): verdict for name, verdict in person.verdicts().items()}
        self.assertEqual({name: verdicts.get(name) for name in expected}, expected, person.text)

    def nothing_moved(self, machine):
        self.assertEqual(machine.sim.shaft(), (0, False, 0))
        for address in (START, HOMING):
            self.assertEqual(machine.wire.writes(address), [])
