"""What the fake daemon keeps over restarts: `convict` damages it."""
import grpc

from fake_axis import refuse  # makes axisd importable
from axisd.v1 import error_pb2, system_service_pb2 as pb, types_pb2

TEXT = "state.v1 was rolled back: it has generation 12, but there was generation 40"


class FakeState:
    def __init__(self):
        self.convictions = []
        self.kept_files = [pb.KeptFileState(name="state.v1", generation=12, expected=40),
                           pb.KeptFileState(name="journal.v1", generation=120)]
        self.latch_trouble = None  # that StopAll answers with
        self.storage_error = None  # that GetInfo answers with

    def convict(self):
        conviction = types_pb2.StateConviction(file="state.v1", fault=types_pb2.STATE_FAULT_ROLLED_BACK, found=12,
                                               expected=40, text=TEXT)
        conviction.since.FromSeconds(1_700_000_000)
        self.convictions = [conviction]
        self.happen("", kept_state_change={"convictions": self.convictions})

    async def accepted(self, context):
        """Aborts the call unless it is."""
        if self.convictions:
            detail = error_pb2.ErrorDetail(reason=error_pb2.REASON_STATE_UNACCEPTED, message=TEXT,
                                           remedy="axisctl state accept")
            await refuse(context, grpc.StatusCode.FAILED_PRECONDITION, detail)

    async def GetState(self, request, context):
        self.note("GetState", request, context)
        return pb.GetStateResponse(files=self.kept_files, convictions=self.convictions, start_count=65544)

    async def BackUpState(self, request, context):
        self.note("BackUpState", request, context)
        if self.storage_error:
            await refuse(context, grpc.StatusCode.UNAVAILABLE, self.storage_error)
        return pb.BackUpStateResponse(state="axisd-state 2\n", generation=12)

    async def AcceptState(self, request, context):
        self.note("AcceptState", request, context)
        accepted, self.convictions = self.convictions, []
        if accepted:
            self.happen("", kept_state_change={"convictions": accepted, "accepted_by": "test"})
        return pb.AcceptStateResponse(accepted=accepted)
