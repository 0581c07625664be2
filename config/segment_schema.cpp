#include <algorithm>
#include <array>

#include "config/field.hpp"
#include "devices/descriptor.hpp"

// The keys of an axis's segments. What depends on the model or on other keys is in segment_checks.cpp.
namespace axisd::config {

namespace {

constexpr std::string_view modes[] = {"relative", "absolute"};

constexpr KeySpec position_keys[] = {
    {.key = "target",
     .kind = Kind::position,
     .required = true,
     .description = "Distance in mode relative, position in mode absolute; axis direction.",
     .example = "20 mm",
     .field = field([](auto& t) -> auto& { return t.position_segment->target; })},
    {.key = "velocity",
     .kind = Kind::velocity,
     .required = true,
     .description = "Of this segment.",
     .example = "50 mm/s",
     .field = field([](auto& t) -> auto& { return t.position_segment->velocity; })},
    {.key = "acceleration_time",
     .kind = Kind::duration,
     .description = "Also of the deceleration; shared with the velocity segment of the same number, whose "
                    "time counts if "
                    "this one is not given.",
     .example = "120 ms",
     .default_value = "100 ms",
     .field = field([](auto& t) -> auto& { return t.position_segment->acceleration_time; })},
};

constexpr KeySpec velocity_keys[] = {
    {.key = "velocity",
     .kind = Kind::velocity,
     .required = true,
     .description = "Of this segment; an input with function pv_direction selects the direction.",
     .example = "20 mm/s",
     .field = field([](auto& t) -> auto& { return t.velocity_segment->velocity; })},
    {.key = "acceleration_time",
     .kind = Kind::duration,
     .description = "Also of the deceleration; shared with the position segment of the same number, whose "
                    "time counts if "
                    "this one is not given.",
     .example = "120 ms",
     .default_value = "100 ms",
     .field = field([](auto& t) -> auto& { return t.velocity_segment->acceleration_time; })},
};

/// As many as the longest table of all models has.
int last_segment() {
  int last = 0;
  for (const auto* model : drive_models()) last = std::max(last, model->capabilities.maximum_segments);
  return last;
}

auto segment_keys(int last) {
  return std::to_array<KeySpec>({
      {.key = "mode",
       .kind = Kind::choice,
       .description = "What the targets of positions mean: distances, or positions that count from home.",
       .example = "absolute",
       .default_value = "relative",
       .choices = modes,
       .field = choice_field([](auto& t) -> auto& { return t.axis->axis.segments->absolute; })},
      {.key = "positions",
       .kind = Kind::numbered_sections,
       .description = "Moves, by the number that pin0..pin4 select; started by an input with pt_enable.",
       .minimum = 1,
       .maximum = last,
       .children = position_keys,
       .field = list_of<&Target::position_segment>(
           [](auto& t) -> auto& { return t.axis->axis.segments->positions; },
           [](auto& row) -> auto& { return row.number; })},
      {.key = "velocities",
       .kind = Kind::numbered_sections,
       .description = "Velocities, by the number that pin0..pin4 select; run by an input with pv_enable.",
       .minimum = 1,
       .maximum = last,
       .children = velocity_keys,
       .field = list_of<&Target::velocity_segment>(
           [](auto& t) -> auto& { return t.axis->axis.segments->velocities; },
           [](auto& row) -> auto& { return row.number; })},
  });
}

}  // namespace

std::span<const KeySpec> segment_schema() {
  static const auto keys = segment_keys(last_segment());
  return keys;
}

}  // namespace axisd::config
