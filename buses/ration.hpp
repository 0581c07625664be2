// How much of what is bounded somebody else may take by what nobody can refuse him: lines of the log, records
// of the audit.
#pragma once

#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "buses/clock.hpp"

namespace axisd {

/// Each origin has so many in a period, which begins with its first one. The rest are left out and counted,
/// and their number is told with the next that is not, or by take_left_out(). Pure: time comes with each
/// call. Thread: that of its owner.
class Ration {
 public:
  struct Settings {
    std::uint64_t most = 50;  ///< of one origin in a period
    Duration period = std::chrono::seconds(10);
    std::size_t origins = 256;  ///< told apart at a time; all further ones count as one
  };
  /// How many of one origin were left out in a period.
  struct LeftOut {
    std::string origin;  ///< "others": of those that are not told apart
    std::uint64_t count = 0;
    bool operator==(const LeftOut&) const = default;
  };

  explicit Ration(Settings settings) : settings_(settings) {}

  /// One more of this origin. How many before it were left out and not told, if it may be; nothing: it is
  /// left out.
  [[nodiscard]] std::optional<std::uint64_t> take(std::string_view origin, TimePoint now);
  /// Ends the periods that are over, and tells what was left out in them, once.
  [[nodiscard]] std::vector<LeftOut> take_left_out(TimePoint now);
  /// When the next period is over; TimePoint::max(): none has begun.
  [[nodiscard]] TimePoint next_due() const;
  [[nodiscard]] Duration period() const { return settings_.period; }

 private:
  struct Period {
    TimePoint end{};
    std::uint64_t taken = 0, left_out = 0;
  };
  [[nodiscard]] Period& period_of(std::string_view origin, TimePoint now);

  Settings settings_;
  std::map<std::string, Period, std::less<>> periods_;
};

}  // namespace axisd
