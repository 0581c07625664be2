// One client's WatchCommand stream.
#pragma once

#include <grpcpp/support/server_callback.h>

#include <deque>
#include <memory>
#include <optional>
#include <string>

#include "api/server/services.hpp"
#include "axisd/v1/command_service.pb.h"

namespace axisd::server {

/// Writes each change of a command, one at a time, and ends after its last one. A reader that falls behind
/// gets the newest changes. Thread: reply, except where gRPC's threads call (On..., close()).
class CommandStream final : public grpc::ServerWriteReactor<v1::WatchCommandResponse>,
                            public OpenCall,
                            public std::enable_shared_from_this<CommandStream> {
 public:
  CommandStream(const Services& services, Admission::Ticket ticket);

  /// Begins to follow the command. nullptr: the server is shutting down. Thread: gRPC.
  static grpc::ServerWriteReactor<v1::WatchCommandResponse>* start(const Services& services,
                                                                   const std::string& id,
                                                                   Admission::Ticket ticket);

  void close(const grpc::Status& status) override;
  void OnWriteDone(bool ok) override;
  void OnCancel() override;
  void OnDone() override;

 private:
  void changed(Result<Command> change);
  void end(const grpc::Status& status);
  void go_on();

  const std::shared_ptr<ReplyThread> reply_;
  const std::shared_ptr<OpenCalls> calls_;
  Admission::Ticket ticket_;
  std::shared_ptr<void> subscription_;
  std::deque<Command> changes_;        ///< not yet written
  v1::WatchCommandResponse response_;  ///< of the pending write
  bool writing_ = false;
  bool finished_ = false;
  std::optional<grpc::Status> end_with_;  ///< once everything was written
  std::shared_ptr<CommandStream> self_;   ///< gRPC's share, until OnDone
};

}  // namespace axisd::server
