"""What was on the wire: the daemon's --wire-log and the log of axisd-sim. All times are CLOCK_MONOTONIC, ns."""
import dataclasses
import pathlib

START, STOP, ENABLE, HOMING, BLOCK = 0x0027, 0x0028, 0x0029, 0x0030, 0x0020


def crc(data):
    """Modbus CRC, as it stands on the wire."""
    value = 0xFFFF
    for byte in data:
        value ^= byte
        for _ in range(8):
            value = value >> 1 ^ (0xA001 if value & 1 else 0)
    return value.to_bytes(2, "little")


def frame_bytes(line):
    """Of a line of the daemon's log that has a frame which was on the wire."""
    return bytes.fromhex("".join(word for word in line.split()[3:] if not word.startswith("@")))


@dataclasses.dataclass(frozen=True)
class Frame:
    """One request."""
    time: int
    data: bytes

    @property
    def node(self):
        return self.data[0]

    @property
    def function(self):
        return self.data[1]

    @property
    def address(self):
        return int.from_bytes(self.data[2:4], "big")

    @property
    def is_write(self):
        return self.function in (0x06, 0x10)

    @property
    def values(self):
        """Registers that a write carries."""
        body = self.data[4:6] if self.function == 0x06 else self.data[7:-2] if self.function == 0x10 else b""
        return [int.from_bytes(body[i:i + 2], "big") for i in range(0, len(body), 2)]

    def writes(self, address, value=None):
        """Whether it writes this register (this value to it)."""
        if not self.is_write or not self.address <= address < self.address + len(self.values):
            return False
        return value is None or self.values[address - self.address] == value

    def __str__(self):
        return f"{self.time} {self.data.hex(' ').upper()}"


class WireLog:
    """The requests in a log file, of daemon (`<ns> <bus> tx <hex> @<class>`) or simulator (`<ns> rx <hex>`)."""

    def __init__(self, path):
        self.path = pathlib.Path(path)

    def text(self):
        return self.path.read_text() if self.path.exists() else ""

    def requests(self, node=None, since=0, until=None, bus=None):
        """Requests in order of time, begun in [since, until)."""
        frames = []
        for line in self.text().splitlines(keepends=True):
            words = line.split()
            if not line.endswith("\n") or len(words) < 3 or "#" in line:
                continue  # being written, or of a CAN network
            if words[1] == "rx":
                data = bytes.fromhex("".join(words[2:]))
            elif words[2] == "tx" and bus in (None, words[1]):
                data = frame_bytes(line)
            else:
                continue
            frame = Frame(int(words[0]), data)
            if len(data) < 4 or frame.time < since or (until is not None and frame.time >= until):
                continue
            if node is None or frame.node == node:
                frames.append(frame)
        return sorted(frames, key=lambda frame: frame.time)

    def writes(self, address=None, value=None, **filters):
        """Writing requests (of this register)."""
        return [frame for frame in self.requests(**filters)
                if frame.is_write and (address is None or frame.writes(address, value))]
