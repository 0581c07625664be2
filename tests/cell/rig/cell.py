"""The computers of a cell, what runs on them, and what can happen to them."""
import os
import pathlib
import shutil
import signal
import socket
import subprocess
import sys
import tempfile
import unittest

from harness import ROOT, Program, run, wait_for

from .disk import Disk
from .etcd import Etcd


def _checked(*words):
    done = run(list(words), limit=120)
    if done.returncode != 0:
        raise AssertionError(f"{' '.join(map(str, words))}: {done.stdout}{done.stderr}")
    return done.stdout


class Cell:
    """Made by deploy/cell/demo.sh --prepare; nothing runs yet. The test itself is one more computer, beside the desk."""

    name = "demo"

    def __init__(self, machines=3, members=3, axes=2, disks=False):
        if "AXISD_CELL_RIG" not in os.environ:
            raise AssertionError("run this by tests/cell/run.sh: it makes networks")
        self.deploy = ROOT / "deploy" / "cell"
        memory = "/dev/shm" if os.access("/dev/shm", os.W_OK) else None
        self.directory = pathlib.Path(tempfile.mkdtemp(prefix="axcell-", dir=memory))
        self.machines = [f"press-{number + 1}" for number in range(machines)]
        self.members = self.machines[:members]
        _checked(str(self.deploy / "demo.sh"), "--machines", str(machines), "--members", str(members), "--axes", str(axes),
                 "--prepare", str(self.directory))
        self.prefix = (self.directory / "namespaces").read_text().splitlines()[0].removesuffix("-wire")
        self.disks = {}
        self.etcd = Etcd(self)
        self.programs = {}  # (computer, what) -> Program that was started last
        self._started = []
        self._plug_in()
        if disks and Disk.usable():
            self.disks = {name: Disk(self.path(name, "etcd", "disk")) for name in self.members}

    def _plug_in(self):
        """A cable from the switch to the network of this process."""
        wire = f"{self.prefix}-wire"
        _checked("ip", "-n", wire, "link", "add", "tester", "type", "veth", "peer", "name", "eth0", "netns", str(os.getpid()))
        _checked("ip", "-n", wire, "link", "set", "tester", "master", "switch", "up")
        _checked("ip", "link", "set", "eth0", "up")
        _checked("ip", "address", "add", "10.28.0.3/24", "dev", "eth0")

    def path(self, *parts):
        return str(self.directory.joinpath(*parts))

    def address(self, name):
        return "10.28.0.2" if name == "desk" else f"10.28.0.{10 + int(name.removeprefix('press-'))}"

    # What runs.

    def start(self, name, what, *options):
        """What: etcd, axisd or cell."""
        program = Program(f"{what}-{name}-{len(self._started)}", [self.path(name, f"{what}.run"), *options], self.directory)
        self.programs[name, what] = program
        self._started.append(program)
        return program

    def start_etcd(self, name):
        return self.start(name, "etcd")

    def start_axisd(self, name, wait=True):
        program = self.start(name, "axisd", "--wire-log", self.path(name, f"wire-{len(self._started)}.log"))
        return self._serving(program, name, 7443) if wait else program

    def start_entrance(self, name, wait=True):
        program = self.start(name, "cell")
        return self._serving(program, name, 7445) if wait else program

    def _serving(self, program, name, port):
        """The program, once it takes connections."""
        def connected():
            if not program.running():
                raise AssertionError(f"{program.name} ended: {program.log()}")
            try:
                socket.create_connection((self.address(name), port), timeout=1).close()
            except OSError:
                return False
            return True
        wait_for(connected, f"{program.name} takes connections")
        return program

    def start_all(self):
        """Everything that there is, until each takes connections."""
        if self.members:
            self.etcd.set_up()
        for what in (self.start_axisd, self.start_entrance):
            for name in self.machines:
                what(name)
        return self

    def running(self, name, what):
        program = self.programs.get((name, what))
        return program is not None and program.running()

    # What happens.

    def kill(self, name, *what):
        """SIGKILL; without `what`: the computer loses its power. Nothing that was sent before is taken back."""
        for (computer, program) in list(self.programs):
            if computer == name and (not what or program in what):
                if self.programs[computer, program].running():
                    self.programs[computer, program].process.send_signal(signal.SIGKILL)
        for key in [key for key in self.programs if key[0] == name and (not what or key[1] in what)]:
            self.programs.pop(key).process.wait(60)

    def pause(self, name, *what):
        """SIGSTOP: nothing answers, and no connection is closed."""
        for program in what:
            self.programs[name, program].process.send_signal(signal.SIGSTOP)

    def resume(self, name, *what):
        for program in what:
            self.programs[name, program].process.send_signal(signal.SIGCONT)

    def cut(self, *names):
        """Their cables are out of the switch: frames are lost, and nobody is told."""
        for name in names:
            _checked("ip", "-n", f"{self.prefix}-wire", "link", "set", name, "nomaster")

    def heal(self, *names):
        for name in names:
            _checked("ip", "-n", f"{self.prefix}-wire", "link", "set", name, "master", "switch")

    def freeze(self, member):
        """The disk of its etcd hangs, where it has one of its own; else etcd itself does. Returns which."""
        if member in self.disks:
            self.disks[member].freeze()
            return "the disk hung"
        self.pause(member, "etcd")
        return "the process hung, as there is no disk to freeze"

    def thaw(self, member):
        if member in self.disks:
            self.disks[member].thaw()
        else:
            self.resume(member, "etcd")

    # The end.

    def logs(self):
        text = ""
        for file in sorted(self.directory.glob("*.std*")):
            lines = [line for line in file.read_text(errors="replace").splitlines() if "pkg/flags" not in line]
            text += f"\n===== {file.name} ({len(lines)} lines)\n" + "\n".join(lines[-40:])
        return text

    def close(self):
        for disk in self.disks.values():
            disk.thaw()
        findings = []
        for program in self._started:
            if program.running():
                program.process.send_signal(signal.SIGCONT)
                program.process.send_signal(signal.SIGTERM)
        for program in self._started:
            try:
                program.process.wait(30)
                program.check_memory()
            except subprocess.TimeoutExpired:
                findings.append(f"{program.name} did not end")
                program.kill()
            except AssertionError as error:
                findings.append(str(error))
        for disk in self.disks.values():
            disk.close()
        _checked(str(self.deploy / "demo.sh"), "--remove", str(self.directory))
        shutil.rmtree(self.directory, ignore_errors=True)
        if findings:
            raise AssertionError("\n".join(findings))


class CellScenario(unittest.TestCase):
    """Ends what a test started, and shows all logs when it failed."""

    maxDiff = None

    def cell(self, **arguments):
        cell = Cell(**arguments)
        self.addCleanup(self._end, cell)
        return cell

    def _end(self, cell):
        outcome = self._outcome.result
        if any(test is self for test, _ in [*outcome.failures, *outcome.errors]) or not self._outcome.success:
            print(f"##### logs of {self.id()}{cell.logs()}", file=sys.stderr)
        cell.close()

    @staticmethod
    def eventually(condition, what, limit=60.0):
        return wait_for(condition, what, limit)
