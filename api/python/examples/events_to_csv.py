#!/usr/bin/env python3
"""Appends what happens on a machine to a CSV file, one line per event, until Ctrl-C. After a lost connection, and when
it is started again with the same file, it goes on where it was: nothing twice, and nothing left out that the daemon
still keeps.

    events_to_csv.py FILE [--axis AXIS ...]        the daemon: $AXISD_SERVER
"""
import argparse
import asyncio
import contextlib
import csv
import dataclasses
import enum
import pathlib
from typing import Any

import axisd

COLUMNS = ["at", "axis", "kind", "content", "lost", "instance_id", "sequence"]
PAUSE = 1.0  # s; before it connects again


def row(event: axisd.Event) -> list[Any]:
    values = dataclasses.asdict(event.content) if event.content else {}
    content = " ".join(f"{name}={value.value if isinstance(value, enum.Enum) else value}"
                       for name, value in values.items())
    return [event.at.isoformat() if event.at else "", event.axis, type(event.content).__name__, content, event.lost,
            event.cursor.instance_id, event.cursor.sequence]


def last_cursor(file: pathlib.Path) -> axisd.Cursor | None:
    """Where the file ends; a new file gets its heading."""
    if not file.exists():
        file.write_text(",".join(COLUMNS) + "\n", encoding="utf-8")
    with file.open(newline="", encoding="utf-8") as lines:
        last = None
        for last in csv.DictReader(lines):
            pass
    return axisd.Cursor(last["instance_id"], int(last["sequence"])) if last else None


async def main(file: pathlib.Path, axes: list[str]) -> None:
    cursor = last_cursor(file)
    with file.open("a", newline="", encoding="utf-8") as lines:
        writer = csv.writer(lines)
        while True:
            with contextlib.suppress(axisd.UnreachableError):  # the daemon restarts, or the network is gone for a while
                async with axisd.connect() as machine:
                    async for event in machine.events(axes, after=cursor, kept=True):
                        writer.writerow(row(event))
                        lines.flush()
                        cursor = event.cursor
            await asyncio.sleep(PAUSE)


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description="Appends the events of a machine to a CSV file.")
    parser.add_argument("file", type=pathlib.Path)
    parser.add_argument("--axis", action="append", default=[], help="only of this axis; may be repeated")
    arguments = parser.parse_args()
    with contextlib.suppress(KeyboardInterrupt):
        asyncio.run(main(arguments.file, arguments.axis))
