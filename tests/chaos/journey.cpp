#include "tests/chaos/journey.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>

namespace axisd::chaos {

namespace {

std::int64_t pulses(const Track& track, double units) { return std::llround(units * track.pulses_per_unit); }

bool is_near(std::int64_t one, std::int64_t other, const Track& track) {
  return std::llabs(one - other) <= track.slack;
}

/// So far from one of these places.
bool is_distance(std::int64_t to, const Stretch& from, std::int64_t distance, const Track& track) {
  return to - distance >= from.low - track.slack && to - distance <= from.high + track.slack;
}

std::string as_units(const Track& track, std::int64_t distance) {
  return fmt::format("{:.3f}", static_cast<double>(distance) / track.pulses_per_unit);
}

/// `way`: planned. Of a jog and of a velocity that ends at a limit.
std::string wrong_run(const Command& command, const Track& track, const Departure& departure,
                      std::int64_t way) {
  const auto asked = *command.asked.velocity * track.pulses_per_unit;
  // From where it was when it was read.
  const auto heading = departure.from + way;
  const bool onwards = asked > 0 ? heading >= departure.lately.low - track.slack
                                 : heading <= departure.lately.high + track.slack;
  if (!onwards) return fmt::format("{} goes the other way, by {}", command.id, as_units(track, way));
  const auto& [low, high] = departure.lately;
  const auto shortest = std::max({low - heading, heading - high, std::int64_t{0}});
  if (shortest <= std::llabs(pulses(track, track.jog_travel)) + track.slack) return {};
  if (!departure.trusted)
    return fmt::format("{} goes by {}, and nobody knows the position", command.id, as_units(track, way));
  if (!departure.origin) return {};
  const auto end = static_cast<double>(departure.from + way - *departure.origin) / track.pulses_per_unit;
  const auto slack = std::abs(static_cast<double>(track.slack) / track.pulses_per_unit);
  if (end >= *track.minimum - slack && end <= *track.maximum + slack) return {};
  return fmt::format("{} goes to {:.3f}, beyond the limits", command.id, end);
}

}  // namespace

std::string wrong_departure(const Command& command, const Track& track, const Departure& departure) {
  const auto& asked = command.asked;
  if (!departure.way && departure.moving) {
    const bool may = command.kind == CommandKind::home ||
                     (asked.velocity && !asked.distance && !asked.position && !track.minimum);
    return may ? "" : fmt::format("{} {} starts without an end", to_string(command.kind), command.id);
  }
  const auto way = departure.way.value_or(0);
  const auto heading = departure.from + way;
  if (asked.distance) {
    if (is_distance(heading, departure.lately, pulses(track, *asked.distance), track)) return {};
    return fmt::format("{} asks for a distance of {:.3f}, and the drive goes by {}", command.id,
                       *asked.distance, as_units(track, way));
  }
  if (command.kind == CommandKind::home) {
    if (std::llabs(way) <= std::llabs(pulses(track, track.backoff)) + track.slack) return {};
    return fmt::format("{} backs off by {}", command.id, as_units(track, way));
  }
  if (asked.position) {
    if (!departure.trusted || !departure.origin ||
        is_near(heading - *departure.origin, pulses(track, *asked.position), track))
      return {};
    return fmt::format("{} asks for {:.3f}, and the drive goes to {}", command.id, *asked.position,
                       as_units(track, heading - *departure.origin));
  }
  return asked.velocity ? wrong_run(command, track, departure, way) : std::string{};
}

std::string wrong_arrival(const Command& command, const Track& track, const Stretch& from, std::int64_t to) {
  const auto& distance = command.asked.distance;
  if (!distance || is_distance(to, from, pulses(track, *distance), track)) return {};
  return fmt::format("{} is done, asked for a distance of {:.3f}, and the load moved by {}", command.id,
                     *distance, as_units(track, to - from.low));
}

}  // namespace axisd::chaos
