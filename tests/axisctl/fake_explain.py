"""What stands in the way, as the fake daemon tells it: what is looked at in `state`, and two obstacles for a far target."""
from axisd.v1 import error_pb2, system_service_pb2 as pb


class FakeExplain:
    async def Explain(self, request, context):
        self.note("Explain", request, context)
        axis = await self.find(request.axis, context)
        response = pb.ExplainResponse()
        if not axis.state.enabled and request.WhichOneof("command") != "enable":
            response.obstacles.add(blocking=True, detail=error_pb2.ErrorDetail(
                reason=error_pb2.REASON_DISABLED, message=f"{axis.name}: the power stage is off",
                remedy=f"enable the axis first: axisctl enable {axis.name}"))
        if axis.limits and request.move_absolute.position > axis.limits[1]:
            response.obstacles.add(blocking=True, detail=error_pb2.ErrorDetail(
                reason=error_pb2.REASON_SOFT_LIMIT, message="the target is beyond a software limit",
                remedy="choose a target within the limits",
                permitted=error_pb2.PermittedRange(minimum=axis.limits[0], maximum=axis.limits[1], unit="mm")))
        if axis.state.moving:
            response.obstacles.add(blocking=False, detail=error_pb2.ErrorDetail(
                reason=error_pb2.REASON_MOVING, message=f"{axis.name}: the axis moves",
                remedy="the start waits for standstill"))
        return response
