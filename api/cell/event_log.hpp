// What happened, with a cursor. Pure.
#pragma once

#include <cstdint>
#include <deque>
#include <optional>
#include <string>

#include "axisd/cell/v1/cell_service.pb.h"

namespace axisd::cell {

/// Keeps the newest. Thread: core.
class EventLog {
 public:
  static constexpr std::size_t most = 4096, most_at_once = 256;

  /// `instance_id`: of this run.
  explicit EventLog(std::string instance_id) : instance_id_(std::move(instance_id)) {}

  /// Gives it the next sequence.
  void add(v1::CellEvent event);
  [[nodiscard]] std::uint64_t newest() const { return newest_; }

  /// Where a reader begins who says this.
  [[nodiscard]] std::uint64_t cursor_of(const v1::WatchEventsRequest& request) const;
  /// What comes behind `cursor`, which is moved on.
  [[nodiscard]] v1::WatchEventsResponse after(std::uint64_t& cursor) const;

 private:
  const std::string instance_id_;
  std::deque<v1::CellEvent> events_;
  std::uint64_t newest_ = 0;
};

}  // namespace axisd::cell
