// How far the clock of another computer is from this one's.
#pragma once

#include <algorithm>
#include <optional>
#include <vector>

#include "buses/clock.hpp"

namespace axisd::cell {

/// The other clock was read between the sending of a question and its answer, so half of the round trip
/// bounds what its middle says of the offset. Later the clocks have drifted apart. Pure.
class ClockSamples {
 public:
  /// What two clocks drift apart at most: 100 ppm each, as crystals do.
  static constexpr double drift = 200e-6;

  struct Offset {
    Duration offset;  ///< the other clock's reading less this one's
    Duration error;   ///< it is off by this at most
  };

  /// `sent`, `received`: by this computer's clock; `reading`: what the other one's showed in between.
  void add(TimePoint sent, TimePoint received, Duration reading) {
    if (samples_.size() == most) samples_.erase(samples_.begin());
    samples_.push_back({.middle = sent + (received - sent) / 2,
                        .offset = reading - (sent + (received - sent) / 2).time_since_epoch(),
                        .half = (received - sent + Duration(1)) / 2});
  }
  [[nodiscard]] std::size_t count() const { return samples_.size(); }
  /// The best that is known of this moment of this computer's clock; nothing: there is no sample.
  [[nodiscard]] std::optional<Offset> at(TimePoint when) const {
    if (samples_.empty()) return std::nullopt;
    const auto error_of = [when](const Sample& sample) {
      const auto age = when > sample.middle ? when - sample.middle : sample.middle - when;
      return sample.half + std::chrono::duration_cast<Duration>(age * drift);
    };
    const auto best = std::ranges::min_element(samples_, {}, error_of);
    return Offset{.offset = best->offset, .error = error_of(*best)};
  }

 private:
  struct Sample {
    TimePoint middle;
    Duration offset, half;
  };
  static constexpr std::size_t most = 64;
  std::vector<Sample> samples_;
};

}  // namespace axisd::cell
