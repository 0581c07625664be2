"""A person at the terminal of axisctl commission: reads what it says on a pseudo terminal, and types answers."""
import errno
import json
import os
import pty
import re
import select
import signal
import subprocess
import time

from .programs import AXISCTL, LIMIT


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
