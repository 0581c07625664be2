"""gRPC calls to axisd.v1, by the generated stubs."""
import itertools
import os
import uuid

import grpc

from client import package
from .programs import LIMIT, wait_for

package.load()
from axisd.v1 import (audit_service_pb2 as audit_pb, audit_service_pb2_grpc, axis_service_pb2 as axis_pb, axis_service_pb2_grpc, bus_service_pb2 as bus_pb,  # noqa: E402
                      bus_service_pb2_grpc, command_service_pb2 as command_pb, command_service_pb2_grpc,
                      drive_service_pb2 as drive_pb, drive_service_pb2_grpc, error_pb2 as error_pb,
                      event_service_pb2 as event_pb, event_service_pb2_grpc, group_service_pb2 as group_pb,
                      group_service_pb2_grpc, lease_service_pb2 as lease_pb,
                      lease_service_pb2_grpc, system_service_pb2 as system_pb, system_service_pb2_grpc,
                      types_pb2 as pb)

__all__ = ["Client", "CallFailed", "audit_pb", "axis_pb", "bus_pb", "command_pb", "drive_pb", "error_pb", "event_pb", "group_pb", "lease_pb",
           "pb", "system_pb"]

ACCEPTED, STARTED, DONE = pb.WAIT_UNTIL_ACCEPTED, pb.WAIT_UNTIL_STARTED, pb.WAIT_UNTIL_DONE
ENDED = (pb.COMMAND_STATE_DONE, pb.COMMAND_STATE_ABORTED, pb.COMMAND_STATE_ERROR, pb.COMMAND_STATE_UNKNOWN)
_ids = itertools.count()


class CallFailed(Exception):
    """A call that was refused; `detail` is None without the trailer."""

    def __init__(self, error):
        self.code = error.code()
        self.message = error.details()
        self.detail = None
        for key, value in error.trailing_metadata() or ():
            if key != "grpc-status-details-bin":
                continue
            for packed in error_pb.StatusDetails.FromString(value).details:
                if packed.type_url.endswith("/axisd.v1.ErrorDetail"):
                    self.detail = error_pb.ErrorDetail.FromString(packed.value)
        super().__init__(f"{self.code.name}: {self.message}\n{self.detail}")

    @property
    def reason(self):
        return error_pb.Reason.Name(self.detail.reason) if self.detail else None


def seconds(value):
    """A google.protobuf.Duration's or Timestamp's content, from a number."""
    return {"seconds": int(value), "nanos": round((value - int(value)) * 1e9)}


class Client:
    """One connection. Motion calls get a request_id of their own unless one is given."""

    def __init__(self, target, credentials=None, options=()):
        self._target, self._credentials = target, credentials
        self._options = [("grpc.use_local_subchannel_pool", 1), ("grpc.enable_http_proxy", 0), *options]
        self.connect()

    def connect(self):
        """Connects (anew): a connection of old would end the first call to a restarted daemon."""
        self.channel = (grpc.secure_channel(self._target, self._credentials, self._options) if self._credentials
                        else grpc.insecure_channel(self._target, self._options))
        self.audit = audit_service_pb2_grpc.AuditServiceStub(self.channel)
        self.axis = axis_service_pb2_grpc.AxisServiceStub(self.channel)
        self.command = command_service_pb2_grpc.CommandServiceStub(self.channel)
        self.bus = bus_service_pb2_grpc.BusServiceStub(self.channel)
        self.drive = drive_service_pb2_grpc.DriveServiceStub(self.channel)
        self.event = event_service_pb2_grpc.EventServiceStub(self.channel)
        self.group = group_service_pb2_grpc.GroupServiceStub(self.channel)
        self.lease = lease_service_pb2_grpc.LeaseServiceStub(self.channel)
        self.system = system_service_pb2_grpc.SystemServiceStub(self.channel)

    def close(self):
        self.channel.close()

    @staticmethod
    def call(method, request, timeout=LIMIT):
        try:
            return method(request, timeout=timeout)
        except grpc.RpcError as error:
            raise CallFailed(error) from None

    def motion(self, name, axis, wait=ACCEPTED, request_id=None, options=None, **fields):
        """Calls the method of this name; returns its Command."""
        if request_id is None:
            request_id = f"{os.getpid()}-{next(_ids)}-{uuid.uuid4()}"
        for key in ("acceleration_time", "deceleration_time", "hold"):
            if isinstance(fields.get(key), (int, float)) and not isinstance(fields[key], bool):
                fields[key] = seconds(fields[key])
        request = getattr(axis_pb, f"{name}Request")(
            axis=axis, options={"request_id": request_id, "wait_until": wait, **(options or {})}, **fields)
        return self.call(getattr(self.axis, name), request, timeout=2 * LIMIT).command

    def to_done(self, name, axis, **fields):
        """As motion(), until it has ended; anything but Done is an error."""
        command = self.motion(name, axis, wait=DONE, **fields)
        if command.state != pb.COMMAND_STATE_DONE:
            raise AssertionError(f"{name} ended otherwise:\n{command}")
        return command

    def state(self, axis):
        return self.call(self.axis.GetAxis, axis_pb.GetAxisRequest(axis=axis)).state

    def states(self):
        return self.call(self.axis.ListAxes, axis_pb.ListAxesRequest()).axes

    def info(self):
        return self.call(self.system.GetInfo, system_pb.GetInfoRequest())

    def buses(self):
        return self.call(self.bus.ListBuses, bus_pb.ListBusesRequest()).buses

    def get_command(self, command):
        return self.call(self.command.GetCommand, command_pb.GetCommandRequest(id=command.id)).command

    def wait_state(self, axis, condition, what):
        """Until the axis's state fulfils the condition; returns it."""
        last = None

        def fulfilled():
            nonlocal last
            last = self.state(axis)
            return condition(last)
        try:
            wait_for(fulfilled, what)
        except AssertionError as error:
            raise AssertionError(f"{error}; last:\n{last}") from None
        return last

    def wait_online(self, axis):
        return self.wait_state(axis, lambda s: s.link == pb.LINK_STATE_ONLINE, f"{axis} online")

    def has_ended(self, command):
        """The command, if it has ended, whichever way."""
        now = self.get_command(command)
        return now if now.state in ENDED else None

    def wait_ended(self, command):
        """Until the command has ended, whichever way; returns it."""
        return wait_for(lambda: self.has_ended(command), f"{pb.CommandKind.Name(command.kind)} {command.id} ended")
