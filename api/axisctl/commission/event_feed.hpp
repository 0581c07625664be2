// The edges of an axis's inputs, none left out.
#pragma once

#include <grpcpp/client_context.h>

#include <condition_variable>
#include <mutex>
#include <optional>
#include <thread>
#include <vector>

#include "api/axisctl/client.hpp"
#include "axisd/v1/event_service.pb.h"
#include "axisd/v1/types.pb.h"

namespace axisd::axisctl::commission {

/// Reads the stream of events on a thread of its own. Thread: any.
class EventFeed {
 public:
  /// Returns once the stream is open: no later edge is missed. Throws Failure.
  EventFeed(const Client& client, const v1::AxisState& axis);
  EventFeed(const EventFeed&) = delete;
  EventFeed& operator=(const EventFeed&) = delete;
  ~EventFeed();

  /// Edges of inputs since the last call, in order. Throws Failure if the stream has ended.
  std::vector<v1::TerminalEdge> take();

 private:
  void read(const v1::WatchEventsRequest& request);

  const Client& client_;
  v1::AxisState axis_;  ///< when this was made: which of its terminals are outputs
  grpc::ClientContext context_;
  std::mutex mutex_;
  std::condition_variable opened_changed_;
  bool opened_ = false;
  std::optional<Failure> failure_;
  std::vector<v1::TerminalEdge> edges_;
  std::thread thread_;
};

}  // namespace axisd::axisctl::commission
