// What happened, with a cursor. Pure.
#pragma once

#include <cstdint>
#include <deque>
#include <map>
#include <string>

#include "axisd/cell/v1/cell_service.pb.h"

namespace axisd::cell {

/// Keeps the newest: so many of each kind, and of one kind fairly between the clients that cause them (M32).
/// Thread: core.
class EventLog {
 public:
  static constexpr std::size_t most_of_kind = 1024;
  static constexpr int most_at_once = 256;

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
  /// What is kept of one kind: sequences, by who has caused them.
  struct Lane {
    std::size_t size = 0;
    std::map<std::string, std::deque<std::uint64_t>> by_client;
  };
  /// The oldest of whoever has most of them goes.
  void make_room(Lane& lane);

  const std::string instance_id_;
  std::map<std::uint64_t, v1::CellEvent> events_;
  std::map<v1::CellEventKind, Lane> lanes_;
  std::uint64_t newest_ = 0;
};

}  // namespace axisd::cell
