#!/usr/bin/env python3
"""Several axes in sequence, with what may go wrong: all home at once, then each moves in turn. If one fails, all are
stopped, and the cause is shown with what to do about it.

    sequence.py AXIS=DISTANCE ...                  sequence.py feeder=30 turntable=90
"""
import argparse
import asyncio
import sys
import uuid
from collections.abc import Iterable

import axisd

ATTEMPTS = 3


async def move_once(axis: axisd.Axis, distance: float) -> axisd.Command:
    """Moves by a distance exactly once, though an answer may be lost on its way: a repetition with the same request_id
    attaches to the motion that is under way, and never starts another."""
    request_id = str(uuid.uuid4())
    for _ in range(ATTEMPTS - 1):
        try:
            return await axis.move_relative(distance, request_id=request_id)
        except axisd.UnreachableError:
            await asyncio.sleep(1)
    return await axis.move_relative(distance, request_id=request_id)


async def make_ready(axis: axisd.Axis) -> None:
    await axis.disable()
    await axis.wait_online()
    if (await axis.state()).state is axisd.State.ERROR_STOP:
        await axis.reset()  # refused while the cause lasts
    await axis.enable()
    await axis.home()


async def run(axes: dict[axisd.Axis, float]) -> None:
    async with asyncio.TaskGroup() as group:
        for axis in axes:
            group.create_task(make_ready(axis))
    for axis, distance in axes.items():
        command = await move_once(axis, distance)
        state = await axis.state()
        print(f"{axis.name}: {command.kind} {command.state.value} at {state.position:.3f} {state.unit}")


async def stop(axes: Iterable[axisd.Axis]) -> None:
    """Each of them, whatever becomes of the others. Not a halt: a motion that is just on its way to the daemon must not
    take over."""
    for axis, result in zip(axes, await asyncio.gather(*(axis.stop() for axis in axes), return_exceptions=True)):
        if isinstance(result, BaseException):
            print(f"{axis.name}: NOT stopped: {result}", file=sys.stderr)


async def main(ways: dict[str, float]) -> None:
    async with axisd.connect() as machine:
        axes = {machine.axis(name): distance for name, distance in ways.items()}
        try:
            await run(axes)
        except BaseException:  # Ctrl-C, too: motions go on without their program
            await stop(axes)
            raise


def causes(error: BaseException) -> list[BaseException]:
    """What a group of tasks failed with, or the error itself."""
    if not isinstance(error, BaseExceptionGroup):
        return [error]
    return [cause for one in error.exceptions for cause in causes(one)]


def way(text: str) -> tuple[str, float]:
    name, _, distance = text.partition("=")
    return name, float(distance)


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description="Homes several axes, then moves each in turn.")
    parser.add_argument("ways", nargs="+", type=way, metavar="AXIS=DISTANCE")
    try:
        asyncio.run(main(dict(parser.parse_args().ways)))
    except (axisd.AxisdError, ExceptionGroup) as failure:
        for cause in causes(failure):
            print(cause, file=sys.stderr)  # also says what to do
        sys.exit(1)
