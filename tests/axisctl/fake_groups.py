"""The groups of the fake daemon."""
from axisd.v1 import group_service_pb2 as group_pb, group_service_pb2_grpc as rpc

SERVICES = (rpc.add_GroupServiceServicer_to_server,)


class FakeGroups(rpc.GroupServiceServicer):
    async def ListGroups(self, request, context):
        self.note("ListGroups", request, context)
        return group_pb.ListGroupsResponse(groups=[group_pb.Group(name="transfer", axes=["feeder", "elsewhere"])])
