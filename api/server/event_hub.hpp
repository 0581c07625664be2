// Tells the event streams that something happened.
#pragma once

#include <atomic>
#include <memory>
#include <vector>

#include "api/server/event_stream.hpp"

namespace axisd::server {

/// All WatchEvents streams. Thread: reply, except open() and happened().
class EventHub : public std::enable_shared_from_this<EventHub> {
 public:
  explicit EventHub(std::shared_ptr<ReplyThread> reply) : reply_(std::move(reply)) {}

  /// Begins a stream. nullptr: the server is shutting down. Thread: gRPC.
  grpc::ServerWriteReactor<v1::WatchEventsResponse>* open(const Services& services,
                                                          grpc::CallbackServerContext* context,
                                                          Admission::Ticket ticket, EventQuery query);

  /// There is a new event: only hands over, and once for as many as come before the reply thread looks.
  /// Wakes nobody while there is no stream. Thread: any; meant for the core.
  void happened();

 private:
  void forget_those_that_are_over();

  const std::shared_ptr<ReplyThread> reply_;
  std::atomic<bool> watched_{false};  ///< of streams_: there is one
  std::atomic<bool> handed_over_{false};
  std::vector<std::weak_ptr<EventStream>> streams_;
};

}  // namespace axisd::server
