// One client's WatchCommand stream.
#pragma once

#include <deque>
#include <memory>
#include <string>

#include "api/server/reply_stream.hpp"
#include "axisd/v1/command_service.pb.h"

namespace axisd::server {

/// Writes each change of a command and ends after its last one. A reader that falls behind gets the newest
/// changes. Thread: reply.
class CommandStream final : public ReplyStream<v1::WatchCommandResponse> {
 public:
  using ReplyStream::ReplyStream;

  /// Begins to follow the command. nullptr: the server is shutting down. Thread: gRPC.
  static grpc::ServerWriteReactor<v1::WatchCommandResponse>* start(const Services& services,
                                                                   grpc::CallbackServerContext* context,
                                                                   const std::string& id,
                                                                   Admission::Ticket ticket);

 private:
  bool next(v1::WatchCommandResponse& to) override;
  void release() override { subscription_.reset(); }
  void changed(Result<Command> change);

  std::shared_ptr<void> subscription_;
  std::deque<Command> changes_;  ///< not yet written
};

}  // namespace axisd::server
