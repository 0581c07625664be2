#pragma once

#include <functional>
#include <map>
#include <mutex>
#include <string>
#include <vector>

#include "daemon/core/fair_lane.hpp"
#include "daemon/core/tallies.hpp"
#include "devices/event.hpp"

namespace axisd::core {

/// The newest events in memory: so many of each kind, and of one kind fairly between axes, or between clients
/// where it is they who cause them. Thread: record(), keep(), on_event() and tallies() core, the rest any.
class EventLog final : public EventSource {
 public:
  /// Of terminal edges, changes of state and commands.
  static constexpr std::size_t capacity = 4'000;
  /// Of each other kind.
  static constexpr std::size_t capacity_of_rare = 1'000;

  EventLog();
  void record(WallTime at, std::string axis, EventContent content);
  /// Told of each event before any reader sees it. Set once, before the first.
  void keep(std::function<void(const Event&)> kept) { kept_ = std::move(kept); }
  [[nodiscard]] Batch events_after(std::uint64_t cursor, std::size_t most) const override;
  void on_event(std::function<void()> notify) override { notify_ = std::move(notify); }
  /// Of all events since the start. Thread: core.
  [[nodiscard]] const Tallies& tallies() const { return tallies_; }

 private:
  mutable std::mutex mutex_;  ///< held for copies of a bounded batch only
  std::map<std::uint64_t, Event> events_;
  std::vector<FairLane> lanes_;  ///< by kind
  std::uint64_t newest_ = 0;
  Tallies tallies_;  ///< of the core
  std::function<void(const Event&)> kept_;
  std::function<void()> notify_;
};

}  // namespace axisd::core
