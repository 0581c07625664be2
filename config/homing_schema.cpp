#include "config/field.hpp"

// The keys of an axis's `homing`.
namespace axisd::config {

namespace {

constexpr std::string_view methods[] = {"home_positive", "home_negative", "positive_limit", "negative_limit"};

constexpr KeySpec homing_keys[] = {
    {.key = "method",
     .kind = Kind::choice,
     .required = true,
     .description = "Which switch is searched for and in which axis direction. A number is a method of a CiA "
                    "402 drive (6098h), which homes by itself then, with whatever switches it has.",
     .example = "home_negative",
     .minimum = -128,
     .maximum = 127,
     .choices = methods,
     .field = {.apply =
                   [](Target& t, const Value& v) {
                     if (v.text.empty())
                       t.axis->axis.homing->number = static_cast<std::int8_t>(v.integer);
                     else
                       t.axis->axis.homing->method = static_cast<HomingMethod>(v.integer);
                   },
               .show =
                   [](const Target& t) {
                     const auto& homing = *t.axis->axis.homing;
                     return homing.number ? fmt::format("number {}", int{*homing.number})
                                          : to_text(homing.method);
                   }}},
    {.key = "velocity",
     .kind = Kind::velocity,
     .required = true,
     .description = "Towards the switch.",
     .example = "20 mm/s",
     .field = field([](auto& t) -> auto& { return t.axis->axis.homing->velocity; })},
    {.key = "search_velocity",
     .kind = Kind::velocity,
     .required = true,
     .description = "Slow, while looking for the edge of the switch.",
     .example = "2 mm/s",
     .field = field([](auto& t) -> auto& { return t.axis->axis.homing->search_velocity; })},
    {.key = "acceleration_time",
     .kind = Kind::duration,
     .description = "While homing.",
     .example = "200 ms",
     .default_value = "100 ms",
     .field = field([](auto& t) -> auto& { return t.axis->axis.homing->acceleration_time; })},
    {.key = "position",
     .kind = Kind::position,
     .description = "Position of the axis once it is homed.",
     .example = "12.5 mm",
     .default_value = "0",
     .field = field([](auto& t) -> auto& { return t.axis->axis.homing->position; })},
    {.key = "offset",
     .kind = Kind::position,
     .description = "Signed way that the drive goes on from the switch before it is homed.",
     .example = "-3 mm",
     .default_value = "0",
     .field = field([](auto& t) -> auto& { return t.axis->axis.homing->offset; })},
    {.key = "backoff",
     .kind = Kind::position,
     .above_minimum = true,
     .description =
         "How far to move away from a switch that is already active; without it homing is refused there.",
     .example = "10 mm",
     .minimum = 0,
     .field = field([](auto& t) -> auto& { return t.axis->axis.homing->backoff; })},
    {.key = "max_travel",
     .kind = Kind::position,
     .above_minimum = true,
     .description = "Homing is stopped after this way.",
     .example = "450 mm",
     .minimum = 0,
     .field = field([](auto& t) -> auto& { return t.axis->axis.homing->max_travel; })},
    {.key = "timeout",
     .kind = Kind::duration,
     .description = "Homing is stopped after this time.",
     .example = "30 s",
     .default_value = "60 s",
     .minimum = 100,
     .maximum = 3'600'000,
     .field = field([](auto& t) -> auto& { return t.axis->axis.homing->timeout; })},
};

}  // namespace

std::span<const KeySpec> homing_schema() { return homing_keys; }

std::span<const std::string_view> homing_methods() { return methods; }

}  // namespace axisd::config
