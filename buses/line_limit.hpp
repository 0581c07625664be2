// How much of the log somebody else may fill.
#pragma once

#include <cstdint>
#include <map>
#include <string>
#include <vector>

#include "buses/clock.hpp"

namespace axisd {

/// Which lines of the log are written that others cause: of each origin so many in a period, which begins
/// with its first line. The rest are counted, and their number is said when the period is over. Pure: time
/// comes with each call. Thread: that of its owner.
class LineLimit {
 public:
  struct Settings {
    std::uint64_t most = 50;  ///< lines of one origin in a period
    Duration period = std::chrono::seconds(10);
    std::size_t origins = 256;  ///< told apart at a time; all further ones count as one
  };
  /// Lines of one origin that were left out in a period.
  struct LeftOut {
    std::string origin;  ///< "others": of those that are not told apart
    std::uint64_t lines = 0;
    bool operator==(const LeftOut&) const = default;
  };

  LineLimit() : LineLimit(Settings{}) {}
  explicit LineLimit(Settings settings) : settings_(settings) {}

  /// Whether a line of `origin` is written now; else it is counted.
  [[nodiscard]] bool admit(const std::string& origin, TimePoint now);
  /// Ends the periods that are over, and tells what was left out in them, once.
  [[nodiscard]] std::vector<LeftOut> take_left_out(TimePoint now);
  /// When the next period is over; TimePoint::max(): none has begun.
  [[nodiscard]] TimePoint next_due() const;
  [[nodiscard]] Duration period() const { return settings_.period; }

 private:
  struct Period {
    TimePoint end{};
    std::uint64_t lines = 0;  ///< written and left out
  };
  Settings settings_;
  std::map<std::string, Period> periods_;
  std::vector<LeftOut> over_;  ///< of periods that ended with a line of their origin
};

}  // namespace axisd
