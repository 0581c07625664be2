#!/usr/bin/env python3
"""Saves what a drive's parameters hold to a JSON file, and writes it back to a drive of the same model, such as the one
that replaces it. What the machine's configuration decides is left alone: axisd writes it by itself.

    parameter_backup.py save AXIS FILE
    parameter_backup.py restore AXIS FILE          switches the power stage off
"""
import argparse
import asyncio
import json
import pathlib

import axisd


async def free_parameters(drive: axisd.Drive) -> list[str]:
    """Those that are neither decided by the configuration nor triggers nor read-only."""
    return [name for name, parameter in (await drive.parameters()).items()
            if parameter.access.startswith("read_write") and not parameter.configured_by and not parameter.instead]


async def save(drive: axisd.Drive, file: pathlib.Path) -> None:
    values = await drive.read(*await free_parameters(drive))
    file.write_text(json.dumps({"model": (await drive.info()).model, "values": values}, indent=1) + "\n")
    print(f"{drive.axis}: {len(values)} parameters saved")


async def restore(drive: axisd.Drive, file: pathlib.Path) -> None:
    backup = json.loads(file.read_text())
    model = (await drive.info()).model
    if backup["model"] != model:
        raise SystemExit(f"{file} is of a {backup['model']}, and {drive.axis} is a {model}")
    present = await drive.read(*backup["values"])
    # Only what differs: each write may wear the drive's EEPROM. All or none, and read back by the daemon.
    changed = {name: value for name, value in backup["values"].items() if present[name] != value}
    if changed:
        await drive.write(**changed)
    for name, value in changed.items():
        print(f"{drive.axis}: {name} {present[name]} -> {value}")
    print(f"{drive.axis}: {len(changed)} of {len(present)} parameters written")


async def main(task: str, name: str, file: pathlib.Path) -> None:
    async with axisd.connect() as machine:
        axis = machine.axis(name)
        if task == "save":
            await save(axis.drive, file)
        else:
            await axis.disable()
            await restore(axis.drive, file)


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description="Saves a drive's parameters, and writes them back.")
    parser.add_argument("task", choices=["save", "restore"])
    parser.add_argument("axis")
    parser.add_argument("file", type=pathlib.Path)
    arguments = parser.parse_args()
    try:
        asyncio.run(main(arguments.task, arguments.axis, arguments.file))
    except axisd.AxisdError as error:
        raise SystemExit(str(error)) from None
