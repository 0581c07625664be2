"""The groups of the fake daemon: `transfer` of feeder and turntable; whatever else a call names."""
import grpc
from fake_axis import offline_detail, refuse
from axisd.v1 import error_pb2, group_service_pb2 as group_pb, group_service_pb2_grpc as rpc, types_pb2

SERVICES = (rpc.add_GroupServiceServicer_to_server,)
GROUPS = {"transfer": ["feeder", "turntable"]}


class FakeGroups(rpc.GroupServiceServicer):
    async def ListGroups(self, request, context):
        self.note("ListGroups", request, context)
        return group_pb.ListGroupsResponse(groups=[group_pb.Group(name="transfer", axes=["feeder", "elsewhere"])])

    async def MoveGroup(self, request, context):
        """Is done at once, without anything having moved."""
        self.note("MoveGroup", request, context)
        for target in request.targets:
            if target.axis not in self.axes:
                await refuse(context, grpc.StatusCode.NOT_FOUND, error_pb2.ErrorDetail(
                    reason=error_pb2.REASON_UNKNOWN_AXIS, message=f"there is no axis '{target.axis}'",
                    remedy="did you mean 'feeder'?", outcome=error_pb2.OUTCOME_NOT_SENT))
        members = [group_pb.GroupMember(command=types_pb2.Command(
            id=f"g-{target.axis}", axis=target.axis, kind=types_pb2.COMMAND_KIND_MOVE_GROUP,
            state=types_pb2.COMMAND_STATE_DONE)) for target in request.targets]
        return group_pb.MoveGroupResponse(move=group_pb.GroupMove(
            id="g-1", group=request.group, state=types_pb2.COMMAND_STATE_DONE, members=members))

    def group_results(self, request, kind):
        """`ghost` cannot be stopped, of `sticky` nobody sees the standstill."""
        results = []
        for name in (*GROUPS.get(request.group, ()), *request.axes):
            if name not in self.axes:
                error = error_pb2.ErrorDetail(reason=error_pb2.REASON_UNKNOWN_AXIS, message=f"there is no axis '{name}'",
                                              remedy="did you mean 'feeder'?")
                results.append(group_pb.GroupStopResult(name=name, error=error))
            elif name == "ghost":
                results.append(group_pb.GroupStopResult(name=name, error=offline_detail()))
            else:
                command = types_pb2.Command(id=f"s-{name}", axis=name, kind=kind, state=types_pb2.COMMAND_STATE_DONE)
                if request.wait_until != types_pb2.WAIT_UNTIL_DONE:
                    command.state = types_pb2.COMMAND_STATE_ACTIVE
                elif name == "sticky":
                    command.state = types_pb2.COMMAND_STATE_ERROR
                    command.cause.CopyFrom(error_pb2.ErrorDetail(
                        reason=error_pb2.REASON_NOT_CONFIRMED, message="sticky: standstill was not confirmed",
                        remedy="look at the machine"))
                results.append(group_pb.GroupStopResult(name=name, command=command))
        return results

    async def GroupHalt(self, request, context):
        self.note("GroupHalt", request, context)
        return group_pb.GroupHaltResponse(results=self.group_results(request, types_pb2.COMMAND_KIND_HALT))

    async def GroupReleaseStop(self, request, context):
        self.note("GroupReleaseStop", request, context)
        results = []
        for name in (*GROUPS.get(request.group, ()), *request.axes):
            error = self.release(self.axes[name], request)
            results.append(group_pb.GroupReleaseStopResult(name=name, error=error, holds=self.axes[name].state.holds))
        return group_pb.GroupReleaseStopResponse(results=results)

    async def GroupStop(self, request, context):
        self.note("GroupStop", request, context)
        if request.hold:
            for name in (*GROUPS.get(request.group, ()), *request.axes):
                if name in self.axes:
                    self.hold(self.axes[name], request.request_id)
        return group_pb.GroupStopResponse(results=self.group_results(request, types_pb2.COMMAND_KIND_STOP))
