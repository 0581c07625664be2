#!/usr/bin/env python3
"""Homes an axis, moves it there and half the way back, and shows it on its way. The same for every drive: what the
axis's unit is and which model moves it, the machine says.

    move_and_watch.py AXIS [--distance 20] [--velocity 15]        the daemon: $AXISD_SERVER
"""
import argparse
import asyncio

import axisd


async def show(axis: axisd.Axis) -> None:
    async for state in axis.watch(0.2):
        print(f"{state.state.value:15} {state.position:10.3f} {state.unit} {state.velocity:10.3f} {state.unit}/s")


async def make_ready(axis: axisd.Axis) -> None:
    # Without power first: a drive whose terminals can start a motion is configured in no other way.
    await axis.disable()
    await axis.wait_online()
    await axis.enable()
    await axis.home()


async def main(name: str, distance: float, velocity: float) -> None:
    async with axisd.connect() as machine:
        axis = machine.axis(name)
        watching = asyncio.create_task(show(axis))
        try:
            await make_ready(axis)
            for way in (distance, -distance / 2):
                command = await axis.move_relative(way, velocity=velocity)
                print(f"moved by {way:g} at {command.granted.velocity:g}: asked for {velocity:g}, drives are coarse")
        except BaseException:  # Ctrl-C, too: a motion goes on without its program
            await axis.halt()
            raise
        finally:
            watching.cancel()
        state = await axis.state()
        print(f"{name} ({state.model}) rests at {state.position:.3f} {state.unit}, position {state.trust.value}")


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description="Moves an axis and shows it on its way.")
    parser.add_argument("axis")
    parser.add_argument("--distance", type=float, default=20.0, help="in the axis's unit")
    parser.add_argument("--velocity", type=float, default=15.0, help="in the axis's unit per second")
    arguments = parser.parse_args()
    asyncio.run(main(arguments.axis, arguments.distance, arguments.velocity))
