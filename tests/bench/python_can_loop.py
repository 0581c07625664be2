"""What can_bench.py compares with besides: the loop of bare_loop.cpp in python3-can.

    python_can_loop.py INTERFACE MS
"""
import sys
import time

import can


def main():
    period = int(sys.argv[2]) * 1_000_000
    bus = can.Bus(interface="socketcan", channel=sys.argv[1])
    sync = can.Message(arbitration_id=0x080, is_extended_id=False)
    due = time.monotonic_ns() + period
    while True:
        while (left := due - time.monotonic_ns()) > 0:
            bus.recv(left / 1e9)
        if time.monotonic_ns() - due < period:
            bus.send(sync)
        due += period


if __name__ == "__main__":
    main()
