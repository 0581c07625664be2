#pragma once

#include <deque>
#include <functional>
#include <mutex>
#include <string>

#include "devices/event.hpp"

namespace axisd::core {

/// The newest events in memory. Thread: record() and on_event() core, the rest any.
class EventLog final : public EventSource {
 public:
  static constexpr std::size_t capacity = 10'000;

  void record(WallTime at, std::string axis, EventContent content);
  [[nodiscard]] Batch events_after(std::uint64_t cursor, std::size_t most) const override;
  void on_event(std::function<void()> notify) override { notify_ = std::move(notify); }

 private:
  mutable std::mutex mutex_;  ///< held for copies of a bounded batch only
  std::deque<Event> events_;
  std::uint64_t newest_ = 0;
  std::function<void()> notify_;
};

}  // namespace axisd::core
