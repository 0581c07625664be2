#include "devices/axis/axis_context.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <utility>

#include "devices/alarm_text.hpp"
#include "devices/released_position.hpp"

namespace axisd {

AxisContext::AxisContext(AxisEnvironment environment, AxisSettings axis_settings,
                         const DriveDescriptor& drive_descriptor, std::unique_ptr<Drive> its_drive,
                         AxisFacePtr its_face, bool is_simulated)
    : env(std::move(environment)),
      settings(std::move(axis_settings)),
      descriptor(&drive_descriptor),
      scale(settings.scale),
      terminals(settings, drive_descriptor),
      planner(settings, drive_descriptor, scale),
      drive(std::move(its_drive)),
      face(std::move(its_face)),
      gate(face->gate),
      simulated(is_simulated) {}

AxisContext::~AxisContext() = default;

Error AxisContext::error(Reason reason, std::string message, std::string remedy) const {
  return {.reason = reason,
          .message = fmt::format("{}: {}", settings.name, message),
          .remedy = std::move(remedy),
          .where = {.bus = settings.bus, .node = settings.node}};
}

Error AxisContext::alarm_error(std::uint16_t code, std::string_view what) const {
  const auto* spec = find_alarm(*descriptor, code);
  auto cause =
      error(Reason::alarm,
            fmt::format("{} alarm {} ({})", what, alarm_text(code), spec != nullptr ? spec->name : "unknown"),
            spec != nullptr ? std::string(spec->remedy) : "see the drive's manual");
  cause.where.native_code = code;
  return cause;
}

Error AxisContext::not_trusted(std::string message) const {
  const auto set = shell("set-position", "VALUE");
  return error(Reason::not_trusted, std::move(message),
               settings.homing ? fmt::format("home the axis: {}, or set its position: {}", shell("home"), set)
                               : fmt::format("set its position: {}", set));
}

Error AxisContext::direction_blocked(bool positive) const {
  return error(Reason::limit_switch,
               fmt::format("the {} limit switch is active", positive ? "positive" : "negative"),
               "move away from it: " +
                   (check_velocity_mode() ? shell("jog", positive ? "-VELOCITY" : "VELOCITY")
                                          : shell("move", positive ? "--relative -WAY" : "--relative WAY")));
}

Error AxisContext::moved_before_start() const {
  return error(Reason::moving, "the drive began to move before the start",
               "check its terminals, and other masters on the bus");
}

Error AxisContext::reloading() const {
  return error(Reason::reloading, "its configuration is being reloaded", "repeat it in a moment");
}

Error AxisContext::ending() const { return error(Reason::cancelled, "the axis is being closed"); }

std::string AxisContext::shell(std::string_view command, std::string_view rest) const {
  return fmt::format("axisctl {} {}{}{}", command, settings.name, rest.empty() ? "" : " ", rest);
}

Result<void> AxisContext::check_velocity_mode() const {
  const auto& capabilities = descriptor->capabilities;
  if (capabilities.velocity_mode) return {};
  return fail(error(
      Reason::not_supported,
      fmt::format("the drive can neither jog nor run at a velocity: {}", capabilities.velocity_mode_lack),
      "give it positions: " + shell("move", "--relative WAY")));
}

std::int64_t AxisContext::home_offset() const {
  return scale.to_pulses(settings.homing ? settings.homing->position : 0);
}

bool AxisContext::is_from_home(std::int64_t offset) const {
  return std::abs(offset - home_offset()) <= drive->position_window();
}

bool AxisContext::counts_while_released() const {
  return drive->closed_loop() && counts_released(*descriptor, settings.model_settings);
}

bool AxisContext::terminal_may_void_position() const {
  return terminals.has("homing_start") || (terminals.has("motor_free") && !counts_while_released());
}

bool AxisContext::may_move_by_itself() const {
  const bool by_terminal = std::ranges::any_of(settings.inputs, [this](const TerminalSettings& input) {
    return terminals.starts_motion(input) || input.function == "motor_free";
  });
  return by_terminal || drive->moves_by_itself();
}

Duration AxisContext::settling() const {
  return drive->position_window() > 0 ? Duration(milliseconds(300)) : Duration{};
}

std::int64_t AxisContext::target_tolerance() const {
  return std::max<std::int64_t>(drive->position_window(), std::llround(settings.position_tolerance *
                                                                       std::abs(scale.pulses_per_unit())));
}

std::string_view AxisContext::homing_switch() const {
  switch (settings.homing->method) {
    case HomingMethod::home_positive:
    case HomingMethod::home_negative:
      return "home";
    case HomingMethod::positive_limit:
      return "positive_limit";
    case HomingMethod::negative_limit:
      return "negative_limit";
  }
  return "home";
}

double AxisContext::velocity_of(const MotionValues& with) const {
  return with.velocity.value_or(planner.maximum_velocity());
}

PositionTracker::Target AxisContext::target_of(const MoveAbsoluteRequest& request,
                                               const PositionTracker& from) const {
  auto position = request.position;
  if (settings.scale.modulo)
    position = from.position() + std::remainder(position - from.position(), *settings.scale.modulo);
  return from.plan_absolute(position);
}

}  // namespace axisd
