#include "api/server/bus_service.hpp"

#include <memory>
#include <utility>
#include <vector>

#include "api/server/convert.hpp"
#include "api/server/peer.hpp"
#include "api/server/pending_call.hpp"
#include "api/server/status.hpp"

namespace axisd::server {

grpc::ServerUnaryReactor* BusServiceImpl::ListBuses(grpc::CallbackServerContext* context,
                                                    const v1::ListBusesRequest*,
                                                    v1::ListBusesResponse* response) {
  auto ticket = services_.admission.admit(client_of(*context), Admission::Kind::call);
  if (!ticket) return answer(context, to_status(ticket.error()));
  return PendingCall::start(services_, context, *std::move(ticket),
                            [&](const std::shared_ptr<PendingCall>& call) {
                              services_.machine.buses([call, response](std::vector<BusStatus> buses) {
                                call->complete([response, buses = std::move(buses)] {
                                  for (const auto& bus : buses) to_proto(bus, *response->add_buses());
                                  return grpc::Status::OK;
                                });
                              });
                            });
}

}  // namespace axisd::server
