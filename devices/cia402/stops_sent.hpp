// Stops and triggers that are on their way to a drive.
#pragma once

#include <cstdint>
#include <optional>

#include "buses/clock.hpp"

namespace axisd::cia402 {

/// Pure. Thread: core. Several sequences may be under way at a time: a stop overtakes whatever else is.
class StopsSent {
 public:
  void begin_stop() { ++count_, ++sending_; }
  void end_stop(TimePoint at) {
    --sending_;
    ended_at_ = at;
  }
  /// Of stops so far: another number, and one has come in between.
  [[nodiscard]] std::uint64_t count() const { return count_; }
  /// No stop is on its way, and this was asked for after the last one.
  [[nodiscard]] bool is_after(TimePoint asked_at) const { return sending_ == 0 && asked_at >= ended_at_; }

  /// Its frame has left.
  void note_frame(TimePoint at) { frame_at_ = at; }
  /// When the last frame of a stop had left. Nothing: none has.
  [[nodiscard]] const std::optional<TimePoint>& frame_at() const { return frame_at_; }

  void begin_trigger() { ++triggering_; }
  void end_trigger() { --triggering_; }
  /// A motion may begin any moment.
  [[nodiscard]] bool triggers() const { return triggering_ > 0; }

 private:
  std::uint64_t count_ = 0;
  int sending_ = 0, triggering_ = 0;
  TimePoint ended_at_{};
  std::optional<TimePoint> frame_at_;
};

}  // namespace axisd::cia402
