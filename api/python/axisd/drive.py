"""The drive behind an axis."""
from __future__ import annotations

import contextlib
import datetime
from collections.abc import AsyncGenerator
from typing import Any

from google.protobuf.duration_pb2 import Duration

from .connection import Connection
from .drives import DriveInfo, Parameter, Segments, SerialProgress
from .v1 import drive_service_pb2

_MEMORY_TIME = 60.0  # s; saving and restoring take the drive's own time


class Drive:
    """Parameters, segments and address of a drive; made as Axis.drive. What changes the drive's memory needs standstill
    and the power stage off."""

    def __init__(self, machine: Connection, axis: str, lease_token: int = 0) -> None:
        self._machine = machine
        self._lease_token = lease_token
        self.axis = axis

    def __repr__(self) -> str:
        return f"Drive({self.axis!r} at {self._machine.server})"

    async def _call(self, name: str, request: Any) -> Any:
        return await self._machine._call(getattr(self._machine._drives, name), request, self.axis)

    async def _memory_call(self, name: str, request: Any) -> Any:
        return await self._machine._call(getattr(self._machine._drives, name), request, self.axis,
                                         limit=max(self._machine.timeout, _MEMORY_TIME))

    async def info(self) -> DriveInfo:
        """Model, limits, terminals with their functions, alarms."""
        return DriveInfo.of(await self._call("GetDrive", drive_service_pb2.GetDriveRequest(axis=self.axis)))

    async def parameters(self) -> dict[str, Parameter]:
        """The whole catalogue of the model, without touching the bus."""
        response = await self._call("ListParameters", drive_service_pb2.ListParametersRequest(axis=self.axis))
        return {parameter.name: Parameter.of(parameter) for parameter in response.parameters}

    async def read(self, *names: str) -> dict[str, int]:
        """The values that the drive holds; without names all that can be read."""
        request = drive_service_pb2.ReadParametersRequest(axis=self.axis, names=names)
        return {value.name: value.value for value in (await self._call("ReadParameters", request)).values}

    async def write(self, **values: int) -> dict[str, int]:
        """Writes all or, if any is refused by the checks, none; returns what was read back."""
        request = drive_service_pb2.WriteParametersRequest(
            axis=self.axis,
            values=[drive_service_pb2.ParameterValue(name=name, value=value) for name, value in values.items()],
            lease_token=self._lease_token)
        return {value.name: value.value for value in (await self._call("WriteParameters", request)).values}

    async def save(self, *, confirm: str) -> None:
        """Saves all parameters in the drive's EEPROM. `confirm`: the axis's name again, since this wears it."""
        request = drive_service_pb2.SaveParametersRequest(axis=self.axis, confirm=confirm,
                                                          lease_token=self._lease_token)
        await self._memory_call("SaveParameters", request)

    async def restore_factory(self, *, confirm: str) -> str:
        """Restores the factory settings; returns which address and serial settings apply after the next power-up."""
        request = drive_service_pb2.RestoreFactoryRequest(axis=self.axis, confirm=confirm,
                                                          lease_token=self._lease_token)
        return (await self._memory_call("RestoreFactory", request)).after_power_cycle

    async def segments(self) -> Segments:
        """The drive's own table of positions and velocities."""
        response = await self._call("ReadSegments", drive_service_pb2.ReadSegmentsRequest(axis=self.axis))
        return Segments.of(response.segments)

    async def write_segments(self, segments: Segments) -> Segments:
        """Replaces the whole table; returns what was read back."""
        request = drive_service_pb2.WriteSegmentsRequest(axis=self.axis, segments=segments.message(),
                                                         lease_token=self._lease_token)
        return Segments.of((await self._call("WriteSegments", request)).segments)

    async def readdress(self, node: int, *, confirm: str,
                        verify: float | None = None) -> AsyncGenerator[SerialProgress, None]:
        """Gives the drive another address, which counts from its next power-up. With `verify` it is then looked for, so
        many seconds. The configuration has to be changed, too."""
        request = drive_service_pb2.ReaddressRequest(axis=self.axis, node=node, confirm=confirm)
        async with contextlib.aclosing(self._change("Readdress", request, verify)) as changes:
            async for change in changes:
                yield change

    async def set_serial(self, *, baud: int | None = None, format: str = "", confirm: str,
                         verify: float | None = None) -> AsyncGenerator[SerialProgress, None]:
        """The same for baud rate and format ("8N1", "8N2", "8E1" or "8O1")."""
        request = drive_service_pb2.SetSerialRequest(axis=self.axis, baud=baud, format=format, confirm=confirm)
        async with contextlib.aclosing(self._change("SetSerial", request, verify)) as changes:
            async for change in changes:
                yield change

    async def _change(self, name: str, request: Any, verify: float | None) -> AsyncGenerator[SerialProgress, None]:
        if verify is not None:
            time = Duration()
            time.FromTimedelta(datetime.timedelta(seconds=verify))
            request.verify.CopyFrom(time)
        request.lease_token = self._lease_token
        method = getattr(self._machine._drives, name)
        async with contextlib.aclosing(self._machine._stream(method, request, self.axis)) as stream:
            async for progress in stream:
                yield SerialProgress.of(progress)
