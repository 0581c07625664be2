#!/usr/bin/env python3
"""Axes of several machines of a cell, under one lease: each moves in turn by its distance, and nobody else can command
them meanwhile. If one fails, all are stopped. Shows the cell before.

    cell_transfer.py MACHINE/AXIS=DISTANCE ...     cell_transfer.py press-1/feeder=30 press-2/lifter=-5

$AXISD_CELL is the entrance of any machine of the cell.
"""
import argparse
import asyncio
import sys

import axisd


async def show(cell: axisd.Cell) -> None:
    info = await cell.info()
    print(f"{info.cell}, through {info.machine}, registry {info.registry.value}")
    for name, machine in (await cell.machines()).items():
        since = f" since {machine.since:%Y-%m-%d %H:%M:%S}" if machine.since else ""
        axes = "" if machine.axes is None else f", {len(machine.axes)} axes"
        print(f"  {name}: {machine.state.value}{since}{axes}" + (", all stopped" if machine.stop_all else ""))


async def run(lease: axisd.CellLease, ways: dict[str, float]) -> None:
    for name in ways:
        await lease.axis(name).enable()
    for name, distance in ways.items():
        command = await lease.axis(name).move_relative(distance)
        print(f"{name}: {command.state.value}, by {distance:g}")


async def stop(cell: axisd.Cell, names: list[str]) -> None:
    """Each of them, whatever becomes of the others. Stops need no lease."""
    for name, result in zip(names, await asyncio.gather(*(cell.axis(name).stop() for name in names),
                                                        return_exceptions=True)):
        if isinstance(result, BaseException):
            print(f"{name}: NOT stopped: {result}", file=sys.stderr)


async def main(ways: dict[str, float], ttl: float) -> None:
    async with axisd.connect_cell() as cell:
        await show(cell)
        try:
            async with cell.lease(*ways, ttl=ttl, label="cell_transfer") as lease:
                await run(lease, ways)
        except BaseException:  # Ctrl-C, too: motions go on without their program
            await stop(cell, list(ways))
            raise


def way(text: str) -> tuple[str, float]:
    name, _, distance = text.partition("=")
    return name, float(distance)


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description="Moves axes of several machines of a cell, one after the other.")
    parser.add_argument("ways", nargs="+", type=way, metavar="MACHINE/AXIS=DISTANCE")
    parser.add_argument("--ttl", type=float, default=2.0, help="what a partition costs at most, in seconds (default 2)")
    arguments = parser.parse_args()
    try:
        asyncio.run(main(dict(arguments.ways), arguments.ttl))
    except axisd.AxisdError as failure:
        print(failure, file=sys.stderr)  # also says what to do
        sys.exit(1)
