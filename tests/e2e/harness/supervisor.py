"""What systemd does with axisd.service, as the unit says it: starts it, hears its watchdog, kills, quiesces, restarts."""
import configparser
import queue
import signal
import threading
import time

from .programs import ROOT, wait_for


class Unit:
    """The part of a unit that says how a service is kept alive."""

    def __init__(self, path=ROOT / "deploy" / "axisd.service"):
        parser = configparser.ConfigParser(strict=False, interpolation=None)
        parser.optionxform = str
        parser.read(path)
        keys = dict(parser["Service"])
        assert keys["Type"] == "notify" and keys["Restart"] == "on-failure", keys
        assert keys["ExecStopPost"].startswith("-/usr/bin/axisd --quiesce "), keys["ExecStopPost"]
        self.watchdog = self._seconds(keys["WatchdogSec"])
        self.watchdog_signal = signal.Signals[keys["WatchdogSignal"]]
        self.pause = self._seconds(keys["RestartSec"])
        self.final = {int(status) for status in keys["RestartPreventExitStatus"].split()}

    @staticmethod
    def _seconds(text):
        for unit, scale in (("ms", 1e-3), ("s", 1)):
            if text.endswith(unit):
                return float(text.removesuffix(unit)) * scale
        return float(text)

    def restarts(self, status):
        """Of a main process that nobody stopped. Negative: the signal that ended it."""
        return status != 0 and status not in self.final


class Supervisor(threading.Thread):
    """Runs a machine's daemon as the service manager would, until close(), or until it is not to be restarted. `patience`:
    so many times the unit's watchdog interval; a computer that runs many tests at once lets a healthy daemon wait for
    longer than that interval."""

    def __init__(self, machine, patience=1, unit=None):
        super().__init__(daemon=True)
        self.unit = unit or Unit()
        self.interval = self.unit.watchdog * patience
        self._machine = machine
        self._inbox = queue.Queue()
        self._closing = threading.Event()
        self._lock = threading.Lock()
        self._events = []
        machine.notify.listen(lambda at, message: self._inbox.put((at, message)))
        self.start()

    def events(self, since=0, without=("WATCHDOG=1",)):
        """What happened, in order of time."""
        with self._lock:
            return [what for at, what in self._events if at >= since and what not in without]

    def time_of(self, what, since=0):
        """The first since then; None: it has not happened."""
        with self._lock:
            return next((at for at, each in self._events if at >= since and each == what), None)

    def last_word_before(self, before):
        """When the daemon last said that it lives."""
        with self._lock:
            return max(at for at, each in self._events if at < before and each in ("READY=1", "WATCHDOG=1"))

    def wait_for(self, what, since=0):
        """When it happened."""
        return wait_for(lambda: self.time_of(what, since), f"the supervisor notes {what}: {self.events(since)}")

    def close(self):
        """Stops the daemon, unless it has ended for good; returns once all is done."""
        self._closing.set()
        while self.is_alive():  # again, where a daemon is just being started
            if self._machine.daemons:
                self._machine.daemon.terminate()
            self.join(0.2)

    def _note(self, what, at=None):
        with self._lock:
            self._events.append((at or time.monotonic_ns(), what))

    def run(self):
        while True:
            daemon = self._machine.start_daemon({"WATCHDOG_USEC": str(round(self.interval * 1e6))}, wait=False)
            self._note("started")
            threading.Thread(target=lambda: self._inbox.put((time.monotonic_ns(), daemon.process.wait())),
                             daemon=True).start()
            status = self._watch(daemon)
            self._note(f"ended {status}")
            self._note(f"quiesced {self._machine.quiesce().returncode}")
            if self._closing.is_set() or not self.unit.restarts(status):
                self._note("left")
                return
            if self._closing.wait(self.unit.pause):
                self._note("left")
                return

    def _watch(self, daemon):
        """Until it has ended: with which status."""
        due = None
        while True:
            left = None if due is None else max(0.0, due - time.monotonic())
            try:
                at, message = self._inbox.get(timeout=left)
            except queue.Empty:
                due = None
                self._kill(daemon)
                continue
            if isinstance(message, int):
                return message
            self._note(message, at)
            if message in ("READY=1", "WATCHDOG=1"):
                due = at / 1e9 + self.interval
            elif message == "STOPPING=1":  # from here on it has the time that a stop has
                due = None
            elif message == "WATCHDOG=trigger" and due is not None:
                due = None
                self._kill(daemon)

    def _kill(self, daemon):
        name = self.unit.watchdog_signal.name
        self._note(name)
        daemon.process.send_signal(self.unit.watchdog_signal)
