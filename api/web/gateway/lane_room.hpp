// How much of the daemon's stop lane the pages may use, and each person of that. Pure.
#pragma once

#include <cstddef>
#include <optional>
#include <string>

#include "api/web/gateway/rates.hpp"
#include "api/web/gateway/shares.hpp"
#include "buses/clock.hpp"

namespace axisd::web {

/// The daemon takes 100 calls of one connection at once, those beyond would wait, stops as well; and it cuts
/// off a connection that costs it too much: 8000 at once and 4000 a second, in which a frame is one, and so
/// are 128 bytes, once more those of headers. Presses leave places and effort for stops. Outlives what it
/// gave away. Thread: one at a time.
class LaneRoom {
 public:
  using Place = Shares::Place;
  static constexpr int most_moves = 48, most_moves_each = 16;
  static constexpr int most_stops = 32, most_stops_each = 16;
  static constexpr Pace effort{.per_second = 3000, .at_once = 6000};
  /// Of a person's presses and renewals, and once more of their stops: sixty a second.
  static constexpr Pace effort_each{.per_second = 800, .at_once = 1600};
  static constexpr double kept_for_stops = 1500;
  /// Bytes of a request; a usual one has 100.
  static constexpr std::size_t largest = 1024;

  /// What a call costs the daemon, with its headers and what the connection says besides; rather more.
  [[nodiscard]] static constexpr double cost_of(std::size_t size) {
    return 12 + 2 * static_cast<double>(size) / 128;
  }

  /// A place for a press or a renewal. Nothing: there is none.
  [[nodiscard]] std::optional<Place> move(const std::string& who, std::size_t size, TimePoint now) {
    auto place = moves_.take(who);
    if (!place || size > largest || !efforts_.take('m' + who, now, cost_of(size), kept_for_stops))
      return std::nullopt;
    return place;
  }
  /// A place for a stop. Nothing: it has to go another way.
  [[nodiscard]] std::optional<Place> stop(const std::string& who, std::size_t size, TimePoint now) {
    auto place = stops_.take(who);
    if (!place || size > largest || !efforts_.take('s' + who, now, cost_of(size))) return std::nullopt;
    return place;
  }

 private:
  Shares moves_{most_moves, most_moves_each}, stops_{most_stops, most_stops_each};
  Rates efforts_{effort, effort_each};
};

}  // namespace axisd::web
