"""CAN interfaces of the guest (tests/guest/run.sh), and what was on them."""
import contextlib
import dataclasses
import errno
import fcntl
import os
import pathlib
import pty
import select
import shutil
import socket
import struct
import subprocess
import tempfile
import termios
import threading
import time
import tty

from .programs import AXISD_LINK, Program, wait_for
from .simulator import Simulator

NMT, SYNC = 0x000, 0x080
ERROR_FLAG, BUS_OFF = 0x20000000, 0x40  # linux/can.h, linux/can/error.h
_FRAME = struct.Struct("=IB3x8s")


def ip(*commands):
    """Runs commands of ip(8), in one process."""
    subprocess.run(["ip", "-batch", "-"], input="\n".join(commands) + "\n", text=True, check=True, capture_output=True)


def sdo_request(node):
    return 0x600 + node


def sdo_reply(node):
    return 0x580 + node


def heartbeat(node):
    return 0x700 + node


class Peer:
    """Another participant of an interface: a plain socket."""

    def __init__(self, interface):
        self._socket = socket.socket(socket.PF_CAN, socket.SOCK_RAW, socket.CAN_RAW)
        self._socket.bind((interface,))
        self._socket.setblocking(False)

    def send(self, cob_id, data=b""):
        """False: the kernel had no room."""
        try:
            self._socket.send(_FRAME.pack(cob_id, len(data), data))
        except OSError as error:
            if error.errno != errno.ENOBUFS:
                raise
            return False
        return True

    def report_bus_off(self):
        """As a controller does; every socket that asked for error frames sees it."""
        self._socket.send(_FRAME.pack(ERROR_FLAG | BUS_OFF, 8, b""))

    def received(self):
        """(id, data) of all frames since the last call."""
        frames = []
        with contextlib.suppress(BlockingIOError, OSError):
            while True:
                cob_id, size, data = _FRAME.unpack(self._socket.recv(_FRAME.size))
                frames.append((cob_id, data[:size]))
        return frames

    def fileno(self):
        return self._socket.fileno()

    def close(self):
        self._socket.close()


class EndlessNode(Peer):
    """A node that answers every SDO upload by segments without an end, each of `size` bytes."""

    def __init__(self, interface, node, size):
        super().__init__(interface)
        self._node, self._size = node, size
        self.aborts = []  # codes that were sent to it
        self._ended = threading.Event()
        self._thread = threading.Thread(target=self._run)
        self._thread.start()

    def _run(self):
        while not self._ended.is_set():
            select.select([self], [], [], 0.05)
            for cob_id, data in self.received():
                if cob_id == sdo_request(self._node):
                    self._answer(data)

    def _answer(self, request):
        if request[0] == 0x40:  # initiate upload: its size is not said
            self.send(sdo_reply(self._node), bytes([0x40]) + request[1:4] + bytes(4))
        elif request[0] >> 5 == 3:  # upload segment: never the last one
            time.sleep(0.002)  # as nodes do; and a guest's time passes only while nobody in it works
            empty = (7 - self._size) << 1
            self.send(sdo_reply(self._node), bytes([request[0] & 0x10 | empty]) + bytes(7))
        elif request[0] == 0x80:
            self.aborts.append(int.from_bytes(request[4:8], "little"))

    def close(self):
        self._ended.set()
        self._thread.join()
        super().close()


class Candump:
    """candump of can-utils: what somebody else sees on an interface. Listens from its construction on."""

    def __init__(self, interface):
        self._trace = tempfile.NamedTemporaryFile("r", dir="/dev/shm")
        with open(self._trace.name, "w") as out:
            self._process = subprocess.Popen(["candump", "-L", interface], stdout=out, stderr=subprocess.DEVNULL)
        wait_for(lambda: os.path.exists(f"/proc/{self._process.pid}/fd/3"), "candump listens")

    def frames(self):
        """All until now, as `601#2B40600000000000`."""
        lines = pathlib.Path(self._trace.name).read_text().splitlines(keepends=True)
        return [line.split()[2] for line in lines if line.endswith("\n")]  # else it is being written

    def close(self):
        self._process.terminate()
        self._process.wait()
        self._trace.close()


@dataclasses.dataclass(frozen=True)
class Frame:
    time: int  # CLOCK_MONOTONIC, ns
    kind: str  # tx, rx (as the log's owner sees it)
    id: int
    data: bytes

    def __str__(self):
        return f"{self.time} {self.kind} {self.id:03X}#{self.data.hex().upper()}"

    @property
    def object(self):
        """(index, sub-index, value) of an expedited SDO download; None: another frame."""
        if not 0x600 < self.id < 0x680 or len(self.data) != 8 or self.data[0] & 0xE2 != 0x22:
            return None
        size = 4 - (self.data[0] >> 2 & 3) if self.data[0] & 1 else 4
        return (int.from_bytes(self.data[1:3], "little"), self.data[3],
                int.from_bytes(self.data[4:4 + size], "little"))


class CanLog:
    """The CAN frames in a log file, of daemon (`<ns> <bus> tx 605#... @<class>`) or simulator (`<ns> rx 605#...`)."""

    def __init__(self, path):
        self.path = pathlib.Path(path)

    def lines(self):
        if not self.path.exists():
            return
        for line in self.path.read_text().splitlines(keepends=True):
            if line.endswith("\n"):  # else it is being written
                yield line.split()

    def frames(self, kind=None, since=0, until=None, cob_id=None):
        """In order of time."""
        found = []
        for words in self.lines():
            if words[1] not in ("tx", "rx"):
                words = [words[0], *(word for word in words[2:] if not word.startswith("@"))]
            if len(words) != 3 or words[1] not in ("tx", "rx") or "#" not in words[2] or "R" in words[2]:
                continue
            identifier, data = words[2].split("#")
            frame = Frame(int(words[0]), words[1], int(identifier, 16), bytes.fromhex(data))
            if kind in (None, frame.kind) and since <= frame.time and (until is None or frame.time < until) and \
                    cob_id in (None, frame.id):
                found.append(frame)
        return sorted(found, key=lambda frame: frame.time)

    def writes(self, index, sub=0, node=None, **filters):
        """Frames that write this object by SDO."""
        return [frame for frame in self.frames(**filters)
                if frame.object and frame.object[:2] == (index, sub) and node in (None, frame.id - 0x600)]

    def links(self):
        """(time, state) of the daemon's link, in order."""
        return [(int(words[0]), words[3]) for words in self.lines() if len(words) == 4 and words[2] == "link"]


class CanSimulator(Simulator):
    """Simulated drives on an interface."""

    def __init__(self, name, directory, drives, interface, options=()):
        super().__init__(name, directory, drives, options, where=["--can", interface])
        self.frames = CanLog(self.wire.path)


class LinkHelper:
    """axisd-link, started by the first connection as by its socket unit."""

    def __init__(self, *links):
        directory = tempfile.mkdtemp(prefix="axlink-", dir="/dev/shm")
        self.socket = os.path.join(directory, "link.sock")
        file = pathlib.Path(directory) / "links"
        file.write_text("".join(f"{link}\n" for link in links))
        self.program = Program("axisd-link", ["systemd-socket-activate", "-l", self.socket, AXISD_LINK, "--links",
                                              str(file), "--user", "root"], directory)
        wait_for(lambda: os.path.exists(self.socket), "the socket of axisd-link")

    def close(self):
        self.program.terminate()
        self.program.check_memory()
        shutil.rmtree(os.path.dirname(self.socket))


class SlcanAdapter:
    """A serial CAN adapter on a pseudo terminal: the kernel makes a genuine CAN interface of it."""

    N_SLCAN, SIOCGIFNAME = 17, 0x8910

    def __init__(self, bitrate=1_000_000):
        self._master, self._slave = pty.openpty()
        tty.setraw(self._slave)
        fcntl.ioctl(self._slave, termios.TIOCSETD, struct.pack("i", self.N_SLCAN))
        name = bytearray(32)
        fcntl.ioctl(self._slave, self.SIOCGIFNAME, name)
        self.interface = name.split(b"\0")[0].decode()
        self._stalled, self._ended = False, False
        self._taken, self._wire = [], None
        # A thread of its own: setting the interface up waits until its commands were read.
        self._thread = threading.Thread(target=self._run, daemon=True)
        self._thread.start()
        ip(f"link set {self.interface} txqueuelen 10",
           f"link set {self.interface} type can bitrate {bitrate} restart-ms 0", f"link set {self.interface} up")

    def join(self, wire):
        """Frames pass between the adapter and this Peer, which is closed with it."""
        self._wire = wire

    def _run(self):
        text = b""
        while not self._ended:
            sources = [] if self._stalled else [self._master, *([self._wire] if self._wire else [])]
            ready = select.select(sources, [], [], 0.005)[0]
            if self._master in ready:
                *lines, text = (text + os.read(self._master, 4096)).split(b"\r")
                for line in lines:
                    if line.startswith(b"t"):
                        self._pass_on(int(line[1:4], 16), bytes.fromhex(line[5:].decode()))
            if self._wire in ready:
                for cob_id, data in self._wire.received():
                    self.say(f"t{cob_id:03X}{len(data)}{data.hex().upper()}")

    def _pass_on(self, cob_id, data):
        self._taken.append((cob_id, data))
        if self._wire:
            self._wire.send(cob_id, data)

    def stall(self, stalled):
        """A stalled one reads nothing: the kernel's queue fills."""
        self._stalled = stalled

    def say(self, text):
        """To the kernel: "sb000256" is bus-off."""
        os.write(self._master, text.encode() + b"\r")

    def taken(self):
        """(id, data) of all frames that it was given."""
        return list(self._taken)

    def close(self):
        self._stalled = False
        ip(f"link set {self.interface} down")
        self._ended = True
        self._thread.join()
        os.close(self._slave)  # removes the interface
        os.close(self._master)
        if self._wire:
            self._wire.close()
