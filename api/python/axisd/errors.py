"""Errors: the daemon cannot be reached, it refused, or a motion ended other than Done."""
from __future__ import annotations

import grpc
import grpc.aio

from .types import Command, ErrorDetail
from .v1 import error_pb2

_TRAILER = "grpc-status-details-bin"


class AxisdError(Exception):
    """Base of all errors of this package."""


class UnreachableError(AxisdError):
    """The daemon did not answer. Whether a command arrived is not known: repeat the call with `request_id`, which
    attaches to the command if it did and starts it if it did not."""

    def __init__(self, message: str, request_id: str = "") -> None:
        super().__init__(message)
        self.request_id = request_id


class RefusedError(AxisdError):
    """The daemon refused the call; nothing happened unless `detail.outcome` says otherwise."""

    def __init__(self, text: str, code: grpc.StatusCode, detail: ErrorDetail | None) -> None:
        super().__init__(text)
        self.code = code
        self.detail = detail

    @property
    def reason(self) -> str:
        """Lower case: "soft_limit", "disabled", "offline" ...; empty if the daemon gave none."""
        return self.detail.reason if self.detail else ""

    @property
    def message(self) -> str:
        return self.detail.message if self.detail else str(self)

    @property
    def remedy(self) -> str:
        return self.detail.remedy if self.detail else ""


class LeaseLostError(AxisdError):
    """The lease ended inside its block: it was not renewed in time, or somebody took it. The text says who has the axes
    now; moving ones do what their `on_lease_loss` says."""


class MotionError(AxisdError):
    """A motion was accepted and ended Aborted, Error or Unknown. `command` is how it ended."""

    def __init__(self, command: Command) -> None:
        # The daemon's text may name the axis as well; once is enough.
        cause = ": " + str(command.cause).removeprefix(f"{command.axis}: ") if command.cause else ""
        super().__init__(f"{command.axis}: {command.kind} {command.state.value}{cause}")
        self.command = command

    @property
    def reason(self) -> str:
        return self.command.cause.reason if self.command.cause else ""

    @property
    def remedy(self) -> str:
        return self.command.cause.remedy if self.command.cause else ""


def detail_of(error: grpc.aio.AioRpcError) -> ErrorDetail | None:
    """The typed detail of the standard trailer, if there is one."""
    for key, value in error.trailing_metadata() or ():
        if key != _TRAILER:
            continue
        for packed in error_pb2.StatusDetails.FromString(value).details:
            if packed.type_url.rpartition("/")[2] == "axisd.v1.ErrorDetail":
                return ErrorDetail.of(error_pb2.ErrorDetail.FromString(packed.value))
    return None


def translate(error: grpc.aio.AioRpcError, subject: str, server: str, request_id: str = "") -> AxisdError:
    """The error of this package for one of gRPC."""
    detail = detail_of(error)
    lead = f"{subject}: " if subject else ""
    if detail is None and error.code() in (grpc.StatusCode.UNAVAILABLE, grpc.StatusCode.DEADLINE_EXCEEDED):
        return UnreachableError(f"{lead}no answer from axisd at {server}: {error.details()}", request_id)
    text = str(detail or error.details()).removeprefix(lead)  # the daemon's text may name the axis as well
    return RefusedError(lead + text, error.code(), detail)
