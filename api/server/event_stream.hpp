// One client's WatchEvents stream.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "api/server/reply_stream.hpp"
#include "axisd/v1/event_service.pb.h"

namespace axisd::server {

/// Which events a client wants, and from where on.
struct EventQuery {
  std::uint64_t cursor = 0;         ///< sequence of the last event seen
  std::vector<std::string> axes{};  ///< empty: all
  std::vector<v1::EventKind> kinds{};
};

/// Writes the events after its cursor, at most some hundred a message. Nothing waits here: a reader that
/// falls behind finds its events with the machine, or hears how many it lost. Thread: reply.
class EventStream final : public ReplyStream<v1::WatchEventsResponse> {
 public:
  EventStream(const Services& services, grpc::CallbackServerContext* context, Admission::Ticket ticket,
              EventQuery query);

  /// There may be new events.
  void notified() { go_on(); }
  [[nodiscard]] bool over() const { return ended(); }

 private:
  bool next(v1::WatchEventsResponse& to) override;
  void release() override {}
  [[nodiscard]] bool wanted(const Event& event) const;

  EventSource& events_;
  const std::string instance_id_;
  EventQuery query_;
  bool greeted_ = false;  ///< the first message was written
};

}  // namespace axisd::server
