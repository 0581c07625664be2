"""axisd-sim: simulated drives on a pseudo terminal with a link in the test's directory."""
import os
import re
import socket
import threading
import typing

from .programs import AXISD_SIM, Program, wait_for
from .wire import WireLog


class Shaft(typing.NamedTuple):
    """The load itself, whatever the drive says about it."""
    position: int  # pulses since the simulator's start
    moving: bool
    starts: int


class Simulator:
    """One line, or (`where`) another kind of wire. Commands: see `help` of its control socket."""

    def __init__(self, name, directory, drives, options=(), where=None):
        self.name = name
        self.port = os.path.join(directory, name)
        self.wire = WireLog(os.path.join(directory, f"{name}.sim.log"))
        self._control = os.path.join(directory, f"{name}.ctl")
        words = [AXISD_SIM, *(where or ["--link", self.port]), "--log", str(self.wire.path), "--control", self._control, *options]
        for drive in drives:
            words += ["--drive", drive]
        self.program = Program(f"sim-{name}", words, directory)
        wait_for(self._ready, f"{name}: simulator ready")
        self._socket = socket.socket(socket.AF_UNIX)
        self._socket.connect(self._control)
        self._replies = self._socket.makefile()
        self._one_at_a_time = threading.Lock()  # an operator's hands are threads

    def _ready(self):
        if not self.program.running():
            raise AssertionError(f"axisd-sim ended: {self.program.log()}")
        return self.program.output().startswith("ready ")

    def control(self, command):
        """Sends one command; its reply without the "ok"."""
        with self._one_at_a_time:
            self._socket.sendall(command.encode() + b"\n")
            reply = self._replies.readline().strip()
        if not reply.startswith("ok"):
            raise AssertionError(f"{command}: {reply}")
        return reply[2:].strip()

    def shaft(self, node=1):
        found = re.fullmatch(r"position=(-?\d+) moving=(\d) starts=(\d+)", self.control(f"shaft {node}"))
        return Shaft(int(found[1]), found[2] == "1", int(found[3]))

    def peek(self, register, node=1):
        return int(self.control(f"peek {node} {register}"))

    def poke(self, register, value, node=1):
        self.control(f"poke {node} {register} {value}")

    def wait_moving(self, node=1):
        wait_for(lambda: self.shaft(node).moving, f"node {node} moves")

    def wait_rest(self, node=1):
        wait_for(lambda: not self.shaft(node).moving, f"node {node} rests")

    def close(self):
        self._replies.close()
        self._socket.close()
        self.program.terminate()
        self.program.check_memory()
