// Who calls, whom for, and whether they may.
#pragma once

#include <google/protobuf/message.h>
#include <grpcpp/server_context.h>

#include <memory>
#include <mutex>
#include <string>
#include <unordered_map>
#include <utility>
#include <vector>

#include "api/server/access.hpp"
#include "api/server/open_calls.hpp"
#include "api/server/refusals.hpp"
#include "api/tls/live.hpp"
#include "devices/machine.hpp"

namespace axisd::server {

/// Looked at before every call of the main address. A peer is known by its certificate, by the user at the
/// other end of its unix socket, else as "local:" and the host part of its address. Never by its port:
/// request ids must stay valid over a reconnection. Thread: any.
class Callers {
 public:
  /// `machine` outlives this. `access`: nullptr: everybody may do everything. `audit`: as of Refusals.
  Callers(Machine& machine, std::shared_ptr<const AccessControl> access, AuditSink* audit);

  /// Names peers, and judges them, by their certificates. Before the first call.
  void trust(std::shared_ptr<const tls::Live> live) { live_ = std::move(live); }
  /// Notes who is at the other end of a unix socket. gRPC is given the socket after that, by its number,
  /// which is free for another one only when the last call on it is gone.
  void enter(int connection);

  /// Whether the call may be made. Errors: access_denied, invalid_argument (metadata),
  /// unauthenticated (a certificate that is not good any more, or none where there is TLS).
  [[nodiscard]] Result<void> admit(const grpc::CallbackServerContext& context,
                                   const google::protobuf::Message& request);
  /// Whom a call is for that was admitted.
  [[nodiscard]] Caller of(const grpc::CallbackServerContext& context) const;
  /// The same with its origin.
  [[nodiscard]] Caller of(const grpc::CallbackServerContext& context,
                          const google::protobuf::Message& request) const;
  /// Who made its connection.
  [[nodiscard]] Peer peer_of(const grpc::CallbackServerContext& context) const;
  /// Whether a stream of its client may go on; empty: always. To be asked as long as the server runs.
  [[nodiscard]] OpenCalls::Judge judge_of(const grpc::CallbackServerContext& context) const;
  /// nullptr: there is none.
  [[nodiscard]] std::shared_ptr<const AccessSettings> access() const { return access_->settings(); }

 private:
  [[nodiscard]] std::vector<GroupSettings> groups_for(const AccessSettings* access) const;

  Machine& machine_;
  const std::shared_ptr<const AccessControl> access_;
  Refusals refusals_;
  std::shared_ptr<const tls::Live> live_;  ///< nullptr: there is no TLS
  mutable std::mutex mutex_;
  std::unordered_map<std::string, Peer> local_;  ///< under mutex_; by what gRPC calls the connection
};

}  // namespace axisd::server
