// Where a start takes the shaft, against what was asked for. Knows the drive's truth and the request, and
// nothing of how the daemon plans.
#pragma once

#include <cstdint>
#include <optional>
#include <string>

#include "devices/axis/command.hpp"

namespace axisd::chaos {

/// What the axis is, in pulses of its drive; positive is the drive's direction.
struct Track {
  double pulses_per_unit = 1;  ///< negative: inverted
  /// Rounding, and how far a shaft may rest from where its encoder was told to bring it: once for the base
  /// of a distance, once for its end.
  std::int64_t slack = 1;
  std::optional<double> minimum{}, maximum{};  ///< user units
  double jog_travel = 0, backoff = 0;          ///< user units
};

/// Where a shaft was, from `low` to `high`, while its position was read for a start and the start was sent:
/// what a terminal turns it by in that moment, no reading can tell.
struct Stretch {
  std::int64_t low = 0, high = 0;
};

/// What a drive did at a start.
struct Departure {
  std::int64_t from = 0;              ///< the shaft
  Stretch lately{};                   ///< with `from`
  std::optional<std::int64_t> way{};  ///< how far it goes; nothing: no end
  bool moving = false;
  bool trusted = false;                  ///< the axis says that it knows its position
  std::optional<std::int64_t> origin{};  ///< the shaft at position 0, if anybody can tell
};

/// Why this start is not what was asked for; empty: it is.
///  - a distance: as far from where the shaft is
///  - a position: there, where the axis knows its position
///  - a jog, or a velocity on an axis with limits: in the direction asked for, to the limit at most; where
///    nobody knows the position, no further than `jog_travel`
///  - homing: no further than `backoff` (the search for the switch is another start)
std::string wrong_departure(const Command& command, const Track& track, const Departure& departure);
/// Why a command that is done did not do it; empty: it did. `from`, `to`: the shaft, when it started and now.
std::string wrong_arrival(const Command& command, const Track& track, const Stretch& from, std::int64_t to);

}  // namespace axisd::chaos
