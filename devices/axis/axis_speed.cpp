// A motion that is far faster than it was told to be is a fault, whatever the drive says of its velocity.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <string_view>

#include "devices/axis/axis.hpp"

namespace axisd {

namespace {

/// r/min, the fastest of all that the drive may use for it: homing has two velocities and a start speed, and
/// backs off with the plan's.
double fastest_of(const Activity& activity, const AxisSettings& settings, const Scale& scale) {
  auto fastest = std::abs(static_cast<double>(activity.plan.velocity_rpm));
  if (activity.state != AxisState::homing || !settings.homing) return fastest;
  fastest = std::max(fastest, static_cast<double>(settings.limits.start_speed_rpm));
  for (const auto velocity : {settings.homing->velocity, settings.homing->search_velocity})
    fastest = std::max(fastest, std::abs(scale.velocity_to_rpm(velocity)));
  return fastest;
}

bool has_velocity_unit(const DriveDescriptor& drive) {
  return std::ranges::find(drive.settings, std::string_view("velocity_unit"), &SettingSpec::key) !=
         drive.settings.end();
}

/// "60 r/min (10 mm/s)".
std::string text_of(double pulses_per_second, const Scale& scale) {
  const auto& settings = scale.settings();
  const auto rpm = pulses_per_second * 60 / static_cast<double>(settings.pulses_per_revolution);
  return fmt::format("{:.0f} r/min ({:.4g} {}/s)", rpm, std::abs(scale.velocity_to_units(rpm)),
                     settings.unit);
}

}  // namespace

/// Only what axisd has started: what a terminal started, or a hand turns, was told nothing. The position is
/// lost with it: what a pulse is to the drive may not be what the configuration says (M20 has it lost with a
/// microstep that changed), and an open loop may not have followed at such a speed.
bool Axis::watch_speed(SpeedWatch::Event event) {
  if (!shaft_.sample()) return false;
  const SpeedWatch::Reading reading{.asked_at = shaft_.sample()->asked_at,
                                    .measured_at = shaft_.sample()->measured_at,
                                    .pulses = shaft_.sample()->position_pulses,
                                    .moving = shaft_.sample()->moving};
  const bool under_way = activity_ && activity_->start.has_begun();
  if (!under_way) {
    speed_watch_.rest(reading);
    return false;
  }
  if (event == SpeedWatch::Event::begun) {
    const auto per_rpm = static_cast<double>(context_.settings.scale.pulses_per_revolution) / 60;
    speed_watch_.begin(reading, fastest_of(*activity_, context_.settings, context_.scale) * per_rpm);
    return false;
  }
  const bool found =
      event == SpeedWatch::Event::arrived ? speed_watch_.arrive(reading) : speed_watch_.follow(reading);
  if (!found) return false;
  lose_trust();
  fail_with_stop(
      *activity_,
      context_.error(
          Reason::misconfigured,
          fmt::format("the shaft turned at {} or more, but was told to turn at {} at most; most likely the "
                      "units of the axis are not those of the drive",
                      text_of(speed_watch_.seen(), context_.scale),
                      text_of(speed_watch_.fastest(), context_.scale)),
          fmt::format("compare scale.microstep{} with the drive; then reset the axis, "
                      "try slowly, and home it",
                      has_velocity_unit(*context_.descriptor)
                          ? ", the drive's own gear and drive: velocity_unit"
                          : "")));
  return true;
}

}  // namespace axisd
