// Passing calls on, as bytes.
#pragma once

#include <grpcpp/generic/async_generic_service.h>

#include "api/cell/callers.hpp"
#include "api/cell/open_calls.hpp"
#include "api/cell/routes.hpp"

namespace axisd::cell {

/// Takes every call that no service of the entrance has, and passes it on to the machine that its metadata
/// names. Nothing of a message is read. Thread: gRPC's; each call belongs to itself.
class Forwarder final : public grpc::CallbackGenericService {
 public:
  /// All of them outlive the server.
  Forwarder(RouteTable& routes, const Callers& callers, OpenCalls& calls)
      : routes_(routes), callers_(callers), calls_(calls) {}

  grpc::ServerGenericBidiReactor* CreateReactor(grpc::GenericCallbackServerContext* context) override;

 private:
  RouteTable& routes_;
  const Callers& callers_;
  OpenCalls& calls_;
};

/// Keys of a call's metadata that mean something here.
inline constexpr std::string_view machine_key = "axisd-machine", hops_key = "axisd-hops",
                                  user_key = "axisd-user", role_key = "axisd-role";

}  // namespace axisd::cell
