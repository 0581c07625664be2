"""The programs under test as processes, and waiting for what they do."""
import os
import pathlib
import pwd
import signal
import subprocess
import time

AXISD = os.environ["AXISD"]  # these are set by CTest
AXISD_SIM = os.environ["AXISD_SIM"]
AXISCTL = os.environ["AXISCTL"]
AXISD_LINK = os.environ.get("AXISD_LINK", "")  # only where there is SocketCAN

#: Who clients are that come by a unix socket.
OWN_NAME = f"unix:{pwd.getpwuid(os.getuid()).pw_name}"

ROOT = pathlib.Path(__file__).resolve().parents[3]
LIMIT = 60.0  # s; for one condition. Generous: nothing is judged by it, it only ends what would hang.


class Hung(AssertionError):
    """A condition did not come true."""


def own_host():
    """A loopback address that no other process of this computer takes: so ports are free without being searched for."""
    number = os.getpid()
    return f"127.{64 + (number >> 16) % 64}.{(number >> 8) & 255}.{number & 255 or 1}"


def wait_for(condition, what, limit=LIMIT):
    """Returns the first true value of condition()."""
    deadline = time.monotonic() + limit
    while True:
        value = condition()
        if value:
            return value
        if time.monotonic() > deadline:
            raise Hung(f"not within {limit:g} s: {what}")
        time.sleep(0.005)


class Program:
    """One running program; its output goes to files that can be read at any time."""

    def __init__(self, name, arguments, directory, environment=None):
        self.name = name
        self.stderr = pathlib.Path(directory) / f"{name}.stderr"
        self.stdout = pathlib.Path(directory) / f"{name}.stdout"
        inherited = {key: value for key, value in os.environ.items()
                     if not key.startswith(("AXISD_", "NOTIFY_", "WATCHDOG_", "JOURNAL_"))}
        with open(self.stdout, "ab") as out, open(self.stderr, "ab") as err:
            self.process = subprocess.Popen(arguments, stdin=subprocess.DEVNULL, stdout=out, stderr=err,
                                            env=inherited | (environment or {}))

    def log(self):
        return self.stderr.read_text(errors="replace")

    def output(self):
        return self.stdout.read_text(errors="replace")

    def running(self):
        return self.process.poll() is None

    def wait(self, limit=LIMIT):
        """Exit status, once it has ended by itself."""
        return self.process.wait(limit)

    def terminate(self):
        """SIGTERM; returns the exit status."""
        if self.running():
            self.process.send_signal(signal.SIGTERM)
        return self.process.wait(LIMIT)

    def kill(self):
        """SIGKILL: the program gets no chance to tidy up."""
        if self.running():
            self.process.kill()
        self.process.wait(LIMIT)

    def check_memory(self):
        """A sanitizer's finding is a failure, whatever the scenario saw."""
        text = self.log()
        for mark in ("ERROR: AddressSanitizer", "ERROR: LeakSanitizer", "runtime error:"):
            if mark in text:
                raise AssertionError(f"{self.name}: {text[text.index(mark):][:4000]}")


def run(arguments, limit=LIMIT, env=None):
    """Runs a program to its end; the completed process with its texts. `env`: in place of the own environment."""
    return subprocess.run(arguments, stdin=subprocess.DEVNULL, capture_output=True, text=True, timeout=limit, check=False,
                          env=env)
