#pragma once

#include <memory>
#include <optional>
#include <string>
#include <utility>

#include "api/cell/core_stream.hpp"
#include "api/cell/event_log.hpp"
#include "api/cell/roster.hpp"
#include "buses/clock.hpp"

namespace axisd::cell {

/// EventLog, and who reads it as it grows. Thread: core.
class EventFeed {
 public:
  /// `clock` outlives this. `instance_id`: of this run.
  EventFeed(const Clock& clock, std::string instance_id) : clock_(clock), log_(std::move(instance_id)) {}

  /// It happens now.
  void tell(v1::CellEvent event) {
    set_time(*event.mutable_at(), clock_.wall(clock_.now()));
    log_.add(std::move(event));
    readers_.poke();
  }
  void watch(const std::shared_ptr<CoreStream<v1::WatchEventsResponse>>& stream,
             const v1::WatchEventsRequest& request) {
    readers_.add(stream);
    stream->serve([this, cursor = log_.cursor_of(request),
                   first = true]() mutable -> std::optional<v1::WatchEventsResponse> {
      if (!std::exchange(first, false) && cursor == log_.newest()) return std::nullopt;
      return log_.after(cursor);
    });
  }
  void finish(const grpc::Status& status) { readers_.finish(status); }

 private:
  const Clock& clock_;
  EventLog log_;
  CoreStreams<v1::WatchEventsResponse> readers_;
};

}  // namespace axisd::cell
