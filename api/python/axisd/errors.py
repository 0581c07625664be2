"""Errors: the daemon cannot be reached, it refused, or a motion ended other than Done."""
from __future__ import annotations

import grpc
import grpc.aio

from .reasons import Outcome, Reason
from .types import Command, ErrorDetail, StopResult
from .v1 import error_pb2

_TRAILER = "grpc-status-details-bin"
# How gRPC's texts begin for a call that never had a connection; the last one, where none can be made with the pair of
# certificate and key.
_NEVER_CONNECTED = ("failed to connect", "DNS resolution failed", "empty address list")


class AxisdError(Exception):
    """Base of all errors of this package."""


class UnreachableError(AxisdError):
    """The daemon did not answer. Whether a command arrived is not known, unless `nothing_sent` says that it did not:
    repeat the call with `request_id`, which attaches to the command if it did and starts it if it did not. Stops were
    repeated before this was raised."""

    def __init__(self, message: str, request_id: str = "", nothing_sent: bool = False) -> None:
        super().__init__(message)
        self.request_id = request_id
        self.nothing_sent = nothing_sent
        """There was no connection to send it on."""


class RefusedError(AxisdError):
    """The daemon refused the call; nothing happened unless `detail.outcome` says otherwise."""

    def __init__(self, text: str, code: grpc.StatusCode, detail: ErrorDetail | None) -> None:
        super().__init__(text)
        self.code = code
        self.detail = detail

    @property
    def reason(self) -> Reason:
        """UNSPECIFIED if the daemon gave none."""
        return self.detail.reason if self.detail else Reason.UNSPECIFIED

    @property
    def message(self) -> str:
        return self.detail.message if self.detail else str(self)

    @property
    def remedy(self) -> str:
        return self.detail.remedy if self.detail else ""


class ArgumentError(RefusedError, ValueError):
    """This package refused the call: an argument is wrong in itself, a name that is no member, say. Nothing was sent."""

    def __init__(self, message: str, remedy: str = "") -> None:
        raw = error_pb2.ErrorDetail(reason=error_pb2.REASON_INVALID_ARGUMENT, message=message, remedy=remedy,
                                    outcome=error_pb2.OUTCOME_NOT_SENT)
        detail = ErrorDetail.of(raw)
        super().__init__(str(detail), grpc.StatusCode.INVALID_ARGUMENT, detail)


class StopError(AxisdError):
    """A stop of several axes of which some did not confirm it: look at these. The others did, or accepted it, where the
    call did not wait."""

    def __init__(self, subject: str, results: tuple[StopResult, ...], failed: tuple[StopResult, ...]) -> None:
        lead = f"{subject}: " if subject else ""
        causes = " | ".join(str(result) for result in failed)
        super().__init__(f"{lead}the stop is not confirmed for {len(failed)} of {len(results)}: {causes}")
        self.results = results
        """Of every axis."""
        self.failed = {result.axis: result for result in failed}
        """Of those that did not confirm, by name."""


class LeaseLostError(AxisdError):
    """The lease ended inside its block: it was not renewed in time, or somebody took it. The text says who has the axes
    now; moving ones do what their `on_lease_loss` says."""


class MotionError(AxisdError):
    """A motion was accepted and ended Aborted, Error or Unknown. `command` is how it ended; `machine`: where, in a cell."""

    def __init__(self, command: Command, machine: str = "") -> None:
        told = command.cause.of_member(machine, command.axis) if command.cause and machine else command.cause
        # The daemon's text may name the axis as well; once is enough.
        cause = ": " + str(told).removeprefix(f"{command.axis}: ") if told else ""
        axis = f"{machine}/{command.axis}" if machine else command.axis
        super().__init__(f"{axis}: {command.kind} {command.state.value}{cause}")
        self.command = command
        self.machine = machine
        self._told = told

    @property
    def reason(self) -> Reason:
        return self.command.cause.reason if self.command.cause else Reason.UNSPECIFIED

    @property
    def remedy(self) -> str:
        return self._told.remedy if self._told else ""


def detail_of(error: grpc.aio.AioRpcError) -> ErrorDetail | None:
    """The typed detail of the standard trailer, if there is one."""
    for key, value in error.trailing_metadata() or ():
        if key != _TRAILER:
            continue
        for packed in error_pb2.StatusDetails.FromString(value).details:
            if packed.type_url.rpartition("/")[2] == "axisd.v1.ErrorDetail":
                return ErrorDetail.of(error_pb2.ErrorDetail.FromString(packed.value))
    return None


def _is_silent_machine(error: grpc.aio.AioRpcError, detail: ErrorDetail) -> bool:
    """The entrance's word for a machine that does not answer; of a drive the bus and the node are told as well."""
    return (error.code() is grpc.StatusCode.UNAVAILABLE and detail.reason is Reason.OFFLINE and not detail.bus
            and detail.node is None)


def translate(error: grpc.aio.AioRpcError, subject: str, server: str, request_id: str = "",
              machine: str | None = None) -> AxisdError:
    """The error of this package for one of gRPC. `machine`: what was asked through the entrance of a cell; empty: the
    entrance itself; None: a daemon was asked."""
    detail = detail_of(error)
    bare = f"{subject}: " if subject else ""
    if machine:
        detail = detail.of_member(machine, subject) if detail is not None else None
        subject = f"{machine}/{subject}" if subject else machine
    lead = f"{subject}: " if subject else ""
    text = error.details() or error.code().name
    if detail is not None and machine is not None and _is_silent_machine(error, detail):
        return UnreachableError(f"{lead}{str(detail).removeprefix(lead).removeprefix(f'{machine}: ')}", request_id,
                                detail.outcome is Outcome.NOT_SENT)
    if detail is None and error.code() in (grpc.StatusCode.UNAVAILABLE, grpc.StatusCode.DEADLINE_EXCEEDED):
        unsent = error.code() is grpc.StatusCode.UNAVAILABLE and text.startswith(_NEVER_CONNECTED)
        asked = "axisd" if machine is None else "axisd-cell"
        return UnreachableError(f"{lead}no answer from {asked} at {server}: {text}"
                                + ("; nothing was sent" if unsent else ""), request_id, unsent)
    if detail is not None and detail.reason is Reason.CANCELLED and error.code() is grpc.StatusCode.UNAVAILABLE:
        return UnreachableError(f"{lead}{detail}", request_id)  # the daemon's end cut the call off
    # The daemon's text may name the axis as well.
    text = str(detail or error.details()).removeprefix(lead).removeprefix(bare)
    return RefusedError(lead + text, error.code(), detail)
