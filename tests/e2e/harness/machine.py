"""A machine of its own for each scenario: simulated lines, the daemon, a client, everything in a directory."""
import os
import pathlib
import shutil
import tempfile

from .can import CanLog, CanSimulator
from .client import Client
from .notify import NotifySocket
from .programs import AXISCTL, AXISD, Program, run
from .simulator import Simulator
from .wire import WireLog


#: On a busy computer the kernel's worker hands over the bytes of pseudo terminals late, by up to a second (observed).
#: Drives that boot slowly permit a guard that a motion's start fits into all the same.
PATIENT = {"reboot_guard": "950 ms", "stop_margin": "2 s"}
BOOT = "boot_ms=1000"


class Axis:
    """An axis of the configuration, and the drive that is simulated for it. `keys` are YAML keys with their
    text, `simulated` what axisd-sim --drive takes. Drives power up released here, unless that says otherwise."""

    def __init__(self, node=1, bus="line", simulated="", **keys):
        self.node, self.bus, self.simulated, self.keys = node, bus, simulated, keys

    def yaml(self):
        return "".join(f"    {key}: {value}\n" for key, value in
                       {"bus": self.bus, "node": self.node, "model": "ykd2405pr", **PATIENT, **self.keys}.items())

    def option(self):
        model = self.keys.get("model", "ykd2405pr")
        words = f"node={self.node},model={model}"
        if model != "yss-c":  # which is always released then, and on a network of the guest, where nobody is late
            words += ",switch.enabled_at_power_up=off"
            if "boot_ms" not in self.simulated:
                words += f",{BOOT}"
        return words + (f",{self.simulated}" if self.simulated else "")


def feeder(node=1, bus="line", simulated="", **keys):
    """A spindle, 2000 pulses/mm, with soft limits; its home edge lies 10 mm below where it stands at first."""
    keys = {"unit": "mm", "scale": "{ microstep: 10000 pulses/rev, travel: 5 mm/rev }",
            "limits": "{ position: [0, 400], velocity: 100 mm/s, acceleration_time: 150 ms }",
            "homing": "{ method: home_negative, velocity: 20 mm/s, search_velocity: 2 mm/s, backoff: 5 mm, "
                      "max_travel: 450 mm, timeout: 60 s }",
            "inputs": "{ X0: home, X1: positive_limit, X2: negative_limit }", "jog_travel": "20 mm"} | keys
    return Axis(node, bus, simulated or "home=-28000:-20000,positive_limit=900000,negative_limit=-60000", **keys)


def spinner(node=1, bus="line", simulated="", **keys):
    """An endless axis, 1000 pulses/rev."""
    keys = {"unit": "rev", "scale": "{ microstep: 1000 pulses/rev }",
            "limits": "{ velocity: 10 rev/s, acceleration_time: 150 ms }"} | keys
    return Axis(node, bus, simulated, **keys)


def turntable(node=5, bus="can0", simulated="", **keys):
    """A round table on a CAN network, 4000 pulses/rev before its gear of 10."""
    keys = {"model": "yss-c", "reboot_guard": "250 ms", "unit": "deg",
            "scale": "{ microstep: 4000 pulses/rev, gear: 10/1 }",
            "limits": "{ velocity: 360 deg/s, acceleration_time: 150 ms }"} | keys
    return Axis(node, bus, simulated, **keys)


class Machine:
    """Not started by itself: start_lines() and start_daemon(), or start(). `networks`: the buses that are CAN
    networks, with their YAML keys; `link_helper`: the socket of axisd-link; `turnaround`: how late drives on lines may
    answer. `name`: of the machine."""

    def __init__(self, axes, baud=115200, serial_format="8N1", server=None, networks=None, link_helper=None,
                 turnaround="1 s", name="e2e"):
        self.axes, self.turnaround, self.name = axes, turnaround, name
        self.networks = networks or {}
        self.baud, self.serial_format = baud, serial_format
        # In memory where possible, so that a busy disk does not hold up simulators, which log.
        memory = "/dev/shm" if os.access("/dev/shm", os.W_OK) else None
        self.directory = tempfile.mkdtemp(prefix="axe2e-", dir=memory)
        self.socket = os.path.join(self.directory, "axisd.sock")
        self.server = server or f"{{ listen: \"unix:{self.socket}\" }}"
        self.state_directory = os.path.join(self.directory, "state")
        self.config = os.path.join(self.directory, "axisd.yaml")
        self.link_helper = link_helper or self.path("no-helper.sock")
        self.wire = WireLog(os.path.join(self.directory, "wire.log"))
        self.frames = CanLog(self.wire.path)
        self.notify = NotifySocket(self.directory)
        self.lines = {}
        self.daemons = []
        self._clients = []
        self.write_config()

    def path(self, name):
        return os.path.join(self.directory, name)

    def buses(self):
        return sorted({axis.bus for axis in self.axes.values()})

    def lines_used(self):
        return [bus for bus in self.buses() if bus not in self.networks]

    def write_config(self):
        text = f"machine: {self.name}\nstate_directory: {self.state_directory}\nserver: {self.server}\nbuses:\n"
        for bus, keys in self.networks.items():
            text += f"  {bus}:\n    canopen: {{ {', '.join(f'{key}: {value}' for key, value in keys.items())} }}\n"
        for bus in self.lines_used():
            text += (f"  {bus}:\n    modbus_rtu: {{ port: {self.path(bus)}, baud: {self.baud}, "
                     f"format: {self.serial_format}, turnaround_max: {self.turnaround} }}\n")
        text += "axes:\n"
        for name, axis in self.axes.items():
            text += f"  {name}:\n{axis.yaml()}"
        pathlib.Path(self.config).write_text(text)

    def start_line(self, bus, interface=None, bitrate=None):
        """On CAN: `interface`: where the drives are, if it is another one than the daemon's; `bitrate`: theirs."""
        drives = [axis.option() for axis in self.axes.values() if axis.bus == bus]
        if bus in self.networks:
            self.lines[bus] = CanSimulator(bus, self.directory, drives,
                                           interface or self.networks[bus]["interface"],
                                           ["--bitrate", str(bitrate)] if bitrate else [])
            return self.lines[bus]
        self.lines[bus] = Simulator(bus, self.directory, drives,
                                    ["--baud", str(self.baud), "--format", self.serial_format])
        return self.lines[bus]

    def start_lines(self):
        for bus in self.buses():
            self.start_line(bus)

    def start_daemon(self, environment=None, wait=True, options=(), before=()):
        """Starts axisd; returns once it reports READY. `before`: words of a program that runs it."""
        self.notify.forget()
        daemon = Program(f"axisd-{len(self.daemons)}",
                         [*before, AXISD, "--config", self.config, "--wire-log", str(self.wire.path), "--link-helper",
                          self.link_helper, *options], self.directory,
                         {"NOTIFY_SOCKET": self.notify.path} | (environment or {}))
        self.daemons.append(daemon)
        for client in self._clients:
            client.close()
            client.connect()
        if wait:
            self.notify.wait_for("READY=1", daemon)
        return daemon

    def start(self):
        """Everything, until each axis is online."""
        self.start_lines()
        self.start_daemon()
        for axis in self.axes:
            self.client.wait_online(axis)
        return self

    @property
    def daemon(self):
        return self.daemons[-1]

    @property
    def sim(self):
        """The only line."""
        (line,) = self.lines.values()
        return line

    def connect(self):
        """A client with a connection of its own."""
        client = Client(f"unix:{self.socket}")
        self._clients.append(client)
        return client

    @property
    def client(self):
        return self._clients[0] if self._clients else self.connect()

    def axisctl(self, *words):
        """Runs axisctl to its end."""
        return run([AXISCTL, "--server", f"unix:{self.socket}", *words], limit=120)

    def quiesce(self):
        return run([AXISD, "--quiesce", self.config, "--state-directory", self.state_directory, "--link-helper",
                    self.link_helper], limit=60)

    def logs(self):
        """Everything that was written, the long logs by their ends."""
        text = f"\n===== axisd.yaml\n{pathlib.Path(self.config).read_text()}"
        for file in sorted(pathlib.Path(self.directory).iterdir()):
            if file.suffix in (".stderr", ".stdout", ".log"):
                lines = file.read_text(errors="replace").splitlines()
                text += f"\n===== {file.name} ({len(lines)} lines)\n" + "\n".join(lines[-60:])
        return text

    def close(self):
        """Ends all programs, the daemon first; the directory is left to remove()."""
        for client in self._clients:
            client.close()
        findings = []
        for part in [*self.daemons, *self.lines.values()]:
            try:
                if isinstance(part, Program):
                    part.terminate()
                    part.check_memory()
                else:
                    part.close()
            except Exception as error:  # each of the others must end, too
                findings.append(f"{part.name}: {error}")
                getattr(part, "program", part).kill()
        self.notify.close()
        if findings:
            raise AssertionError("\n".join(findings))

    def remove(self):
        shutil.rmtree(self.directory, ignore_errors=True)
