#pragma once

#include <array>
#include <cstdint>

#include "buses/clock.hpp"

namespace axisd {

/// How much of its time a bus was occupied: since the start and of late. Pure; adding allocates nothing.
class BusLoad {
 public:
  /// What recent() looks back on.
  static constexpr Duration window = std::chrono::seconds(10);

  explicit BusLoad(TimePoint since) : since_(since) {}
  /// The bus was occupied from `begin` to `end`. Intervals do not overlap, and come in order of their ends.
  void add(TimePoint begin, TimePoint end);

  [[nodiscard]] TimePoint since() const { return since_; }
  [[nodiscard]] Duration occupied() const { return occupied_; }
  /// Share of the time since the start, 0..1.
  [[nodiscard]] double overall(TimePoint now) const;
  /// Share of the last `window` (to the full second), or of the time since the start while that is shorter.
  [[nodiscard]] double recent(TimePoint now) const;

 private:
  struct Second {
    std::int64_t number = -1;  ///< of the clock
    Duration occupied{};
  };
  [[nodiscard]] Second& second(std::int64_t number);

  TimePoint since_;
  Duration occupied_{};
  std::array<Second, 16> seconds_{};  ///< a ring: more than the window has, so that its oldest is still there
};

}  // namespace axisd
