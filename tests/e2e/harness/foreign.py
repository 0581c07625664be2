"""A drive on a CAN interface that nobody of this project wrote: tests/foreign/slave.js, on a library from npm."""
import json
import os
import pathlib
import socket
import sys
import time

from .programs import ROOT, Program, wait_for

FOREIGN = ROOT / "tests" / "foreign"


def makers_file(name):
    """The data sheet of this name: the one of the project, else that of the makers' folder, where it may be missing."""
    own = ROOT / "tests" / "data" / "eds" / name
    folder = os.environ.get("AXISD_EDS_FOLDER") or ROOT.parent / "shared" / "eds"
    return own if own.exists() else pathlib.Path(folder) / name


class ForeignSlave:
    """`velocity`, `acceleration`: what a unit of them is, in revolutions per second (squared). `limits`: where the limit
    switches are, in revolutions from where it stands at first."""

    def __init__(self, directory, interface, node, eds, counts, velocity, acceleration, limits):
        self._directory, self._control = directory, os.path.join(directory, f"slave-{node}.sock")
        self._arguments = [sys.executable, "-B", str(FOREIGN / "slave.py"), interface, str(node), str(eds), self._control,
                           str(counts), str(velocity), str(acceleration), *map(str, limits)]
        self._starts = 0
        self.program = None
        self.start()

    def start(self):
        """Powers it up."""
        if os.path.exists(self._control):
            os.remove(self._control)
        self._starts += 1
        self.program = Program(f"slave-{self._starts}", self._arguments, self._directory)
        wait_for(lambda: "ready" in self.program.output() or not self.program.running(), "the slave is ready")

    def cut(self):
        """Takes its power away."""
        self.program.kill()

    def hand(self, line):
        """The shaft as it is: turns, speed (revolutions per second), moving, starts, state."""
        with socket.socket(socket.AF_UNIX) as connection:
            connection.connect(self._control)
            connection.sendall(f"{line}\n".encode())
            text = b""
            while not text.endswith(b"\n"):
                part = connection.recv(4096)
                if not part:
                    raise AssertionError(f"the slave has ended: {self.program.log()}")
                text += part
        return json.loads(text)

    @property
    def shaft(self):
        return self.hand("shaft")

    def wait(self, condition, what):
        """Until the shaft fulfils the condition; returns it. Not asked as often as it could be: in a guest each question
        costs more than what is asked about."""
        def fulfilled():
            time.sleep(0.03)
            shaft = self.shaft
            return shaft if condition(shaft) else None
        return wait_for(fulfilled, what)

    def close(self):
        self.cut()
