"""What a hand-written script does, for index_bench.py: as bench_index_loop with `apart`, on python3-pymodbus, which keeps
the line's silences itself. Runs until it is ended.

    index_pymodbus.py PORT BAUD COUNT START_RPM UP_MS DOWN_MS RPM HERE THERE
"""
import itertools
import sys

from pymodbus.client import ModbusSerialClient

STATE, BLOCK, TRIGGER, ENABLE = 0x0003, 0x0020, 0x0027, 0x0029
ABSOLUTE_MOVE = 5


def good(ask, *words, slave):
    """Again where the computer was too busy: a start that arrives twice goes to the same place."""
    for _ in range(5):
        reply = ask(*words, slave=slave)
        if not reply.isError():
            return reply
        print(reply, file=sys.stderr)
    sys.exit(f"index_pymodbus.py: drive {slave} does not answer")


def counter(registers):
    value = registers[7] << 16 | registers[8]
    return value - (value >> 31 << 32)


def main():
    port, baud, count = sys.argv[1], int(sys.argv[2]), int(sys.argv[3])
    *profile, here, there = map(int, sys.argv[4:])
    client = ModbusSerialClient(port=port, baudrate=baud, timeout=1)  # it takes whole seconds only
    if not client.connect():
        sys.exit(f"index_pymodbus.py: {port} cannot be opened")

    def state(node):
        return good(client.read_holding_registers, STATE, 10, slave=node).registers

    targets, moves = {}, dict.fromkeys(range(1, count + 1), False)
    for node in moves:
        good(client.write_register, ENABLE, 1, slave=node)
        targets[node] = counter(state(node))
    for node in itertools.cycle(moves):
        if moves[node]:
            registers = state(node)
            moves[node] = registers[1] != 0 or counter(registers) != targets[node]
        if not moves[node]:
            targets[node] = there if targets[node] == here else here
            words = [targets[node] >> 16 & 0xFFFF, targets[node] & 0xFFFF]
            good(client.write_registers, BLOCK, profile + words, slave=node)
            good(client.write_register, TRIGGER, ABSOLUTE_MOVE, slave=node)
            moves[node] = True


if __name__ == "__main__":
    main()
