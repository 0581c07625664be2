"""A register bank with the YKD2405PR's addresses, served by pymodbus: an independent reading of Modbus RTU.

    pymodbus_slave.py PORT LOG     LOG gets a line per write: <address> <value> ...

Behind the registers there is as little drive as axisd needs: enabling shows in the status word, and a start in
position mode goes to its target at its speed, without ramps.
"""
import asyncio
import sys
import time

from pymodbus.datastore import ModbusServerContext, ModbusSlaveContext, ModbusSparseDataBlock
from pymodbus.framer.rtu_framer import ModbusRtuFramer
from pymodbus.server import StartAsyncSerialServer

MOVING, STATUS, POSITION, BLOCK = 0x0004, 0x0007, 0x000A, 0x0020
RELEASED, RUNS, IN_POSITION = 1 << 4, 1 << 2, 1
PULSES = 1000  # per revolution


def number(words):
    """Of two registers, the high word first."""
    return int.from_bytes(b"".join(word.to_bytes(2, "big") for word in words), "big", signed=True)


class Bank(ModbusSparseDataBlock):
    """Holding registers 0x0000..0x0119."""

    def __init__(self, log):
        super().__init__(dict.fromkeys(range(0x011A), 0))
        self.log = log
        self.motion = None  # (position and time of its start, target, pulses/s)
        # Model, version; status; what 0x0020..0x0025 hold after power-up (5000 pulses at 60 r/min).
        for address, values in ((0x0000, [0x0301, 0x0110]), (STATUS, [RELEASED]), (BLOCK, [5, 100, 100, 60, 0, 5000])):
            super().setValues(address, values)

    def setValues(self, address, values, use_as_default=False):
        if not isinstance(values, list):
            values = [values]
        print(f"0x{address:04X}", *values, file=self.log, flush=True)
        super().setValues(address, values)
        if address == 0x0029:
            super().setValues(STATUS, [0 if values[0] else RELEASED])
        if address == 0x0027 and values[0] == 5:
            _, _, _, speed, *target = super().getValues(BLOCK, 6)
            start = number(super().getValues(POSITION, 2))
            self.motion = (start, time.monotonic(), number(target), speed * PULSES / 60)

    def getValues(self, address, count=1):
        self.follow()
        return super().getValues(address, count)

    def follow(self):
        if self.motion is None:
            return
        start, since, target, speed = self.motion
        gone = min(round((time.monotonic() - since) * speed), abs(target - start))
        position = start + (gone if target > start else -gone)
        super().setValues(POSITION, [position >> 16 & 0xFFFF, position & 0xFFFF])
        there = position == target
        super().setValues(MOVING, [0 if there else 1])
        super().setValues(STATUS, [IN_POSITION if there else RUNS])
        if there:
            self.motion = None


async def main(port, log):
    slave = ModbusSlaveContext(hr=Bank(log), zero_mode=True)
    context = ModbusServerContext(slaves={1: slave}, single=False)
    print("ready", flush=True)
    await StartAsyncSerialServer(context=context, framer=ModbusRtuFramer, port=port, baudrate=115200,
                                 ignore_missing_slaves=True, allow_reuse_address=True)


if __name__ == "__main__":
    with open(sys.argv[2], "w") as file:
        asyncio.run(main(sys.argv[1], file))
