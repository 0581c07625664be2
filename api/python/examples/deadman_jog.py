#!/usr/bin/env python3
"""Jogs an axis as long as somebody holds a button: lines on standard input, at least five per second. When they stop
coming, for whatever reason, the axis halts. When this program hangs or dies, the daemon halts it after HOLD.

    while sleep 0.1; do echo; done | deadman_jog.py AXIS --velocity -5        the daemon: $AXISD_SERVER
"""
import argparse
import asyncio
import os
import stat
import sys

import axisd

HOLD = 0.3      # s; without a renewal the daemon halts the axis
RELEASED = 0.2  # s; without a line the button counts as released
LOOK = 0.02     # s; how often the button is looked at


class Button(asyncio.Protocol):
    """What counts is when the last line came, not how many wait to be read: those are of the past."""

    def __init__(self) -> None:
        self._last = float("-inf")
        self.gone = False

    def data_received(self, data: bytes) -> None:
        self._last = asyncio.get_running_loop().time()

    def connection_lost(self, error: Exception | None) -> None:
        self.gone = True

    def held(self) -> bool:
        return not self.gone and asyncio.get_running_loop().time() - self._last < RELEASED


async def jog_while_held(axis: axisd.Axis, button: Button, velocity: float) -> None:
    async with axis.jog(velocity, hold=HOLD) as jog:
        print(f"jogging at {jog.command.granted.velocity:g}", flush=True)
        while button.held():
            await asyncio.sleep(LOOK)
            jog.check()  # a limit or a stop may have ended it
    state = await axis.state()
    print(f"released: {axis.name} halted at {state.position:.3f} {state.unit}", flush=True)


async def main(name: str, velocity: float) -> None:
    async with axisd.connect() as machine:
        axis = machine.axis(name)
        await axis.wait_online()
        await axis.enable()
        _, button = await asyncio.get_running_loop().connect_read_pipe(Button, sys.stdin)
        while not button.gone:
            await asyncio.sleep(LOOK)
            if not button.held():
                continue
            try:
                await jog_while_held(axis, button, velocity)
            except axisd.MotionError as error:
                print(error, flush=True)
                while button.held():  # it has to be released before it may be pressed again
                    await asyncio.sleep(LOOK)


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description="Jogs an axis while lines come on standard input.")
    parser.add_argument("axis")
    parser.add_argument("--velocity", type=float, default=5.0, help="signed, in the axis's unit per second")
    arguments = parser.parse_args()
    if not sys.stdin.isatty() and not stat.S_ISFIFO(os.fstat(sys.stdin.fileno()).st_mode):
        parser.error("the button is a pipe or a terminal at the standard input")
    asyncio.run(main(arguments.axis, arguments.velocity))
