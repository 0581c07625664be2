"""Client of axisd: the axes of a machine from asyncio.

    async with axisd.connect("localhost:7443") as machine:
        feeder = machine.axis("feeder")
        await feeder.enable()
        await feeder.home()
        await feeder.move(120, velocity=50)
"""
from .errors import AxisdError, MotionError, RefusedError, UnreachableError
from .machine import Axis, Jog, Machine, connect
from .types import (AxisState, Bus, Command, CommandState, ErrorDetail, Info, Link, MotionValues, PermittedRange,
                    State, StopResult, Terminal, Tick, Trust)

__all__ = [
    "Axis", "AxisState", "AxisdError", "Bus", "Command", "CommandState", "ErrorDetail", "Info", "Jog", "Link",
    "Machine", "MotionError", "MotionValues", "PermittedRange", "RefusedError", "State", "StopResult", "Terminal",
    "Tick", "Trust", "UnreachableError", "connect",
]
