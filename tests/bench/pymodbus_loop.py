"""What a hand-written script does, for rtu_bench.py: python3-pymodbus, one node after the other, registers
0x0003..0x000C. It keeps the line's silences itself. Runs until it is ended.

    pymodbus_loop.py PORT BAUD NODES
"""
import itertools
import sys

from pymodbus.client import ModbusSerialClient


def main():
    port, baud, nodes = sys.argv[1], int(sys.argv[2]), int(sys.argv[3])
    client = ModbusSerialClient(port=port, baudrate=baud, timeout=1)  # it takes whole seconds only
    if not client.connect():
        sys.exit(f"pymodbus_loop.py: {port} cannot be opened")
    for node in itertools.cycle(range(1, nodes + 1)):
        reply = client.read_holding_registers(0x0003, 10, slave=node)
        if reply.isError():
            print(reply, file=sys.stderr)


if __name__ == "__main__":
    main()
