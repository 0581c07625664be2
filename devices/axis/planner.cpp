#include "devices/axis/planner.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include "buses/seconds.hpp"
#include "devices/axis/segments.hpp"

namespace axisd {

namespace {

Error out_of_range(std::string message, double minimum, double maximum, std::string unit) {
  return {.reason = Reason::out_of_range,
          .message = std::move(message) + " is out of range",
          .remedy = "choose a value in the permitted range",
          .permitted = Range{.minimum = minimum, .maximum = maximum, .unit = std::move(unit)}};
}

/// In nanoseconds a Duration holds 292 years: the slowest of motions is shorter than this.
constexpr double longest_seconds = 5e9;

Duration duration_of(double seconds) {
  const auto within = std::clamp(seconds, 0.0, longest_seconds);
  return std::chrono::duration_cast<Duration>(std::chrono::duration<double>(within));
}

/// As long as a ramp may be told, and what of one a drive can be sent.
constexpr double longest_ramp_seconds = 86'400, most_counts = std::numeric_limits<std::int32_t>::max();

int milliseconds_of(Duration time) {
  return static_cast<int>(std::chrono::duration_cast<milliseconds>(time).count());
}

}  // namespace

Planner::Planner(const AxisSettings& settings, const DriveDescriptor& descriptor, const Scale& scale)
    : settings_(&settings), capabilities_(&descriptor.capabilities), scale_(&scale) {}

int Planner::maximum_rpm() const {
  const auto by_pulse_rate =
      capabilities_->maximum_pulse_rate_hz * 60 / settings_->scale.pulses_per_revolution;
  return static_cast<int>(std::min<std::int64_t>(capabilities_->maximum_rpm, by_pulse_rate));
}

std::int64_t Planner::longest_move() const {
  constexpr std::int64_t half_counter = std::int64_t{1} << 30U;
  return std::min({half_counter, std::int64_t{capabilities_->maximum_target_pulses},
                   -std::int64_t{capabilities_->minimum_target_pulses}});
}

bool Planner::reachable(std::int64_t counter) const { return std::abs(counter) <= longest_move(); }

double Planner::maximum_velocity() const {
  return std::min(settings_->limits.velocity, std::abs(scale_->velocity_to_units(maximum_rpm())));
}

double Planner::minimum_velocity() const {
  // The start speed may not be above the speed, and has a lower bound of its own.
  return std::abs(
      scale_->velocity_to_units(std::max(capabilities_->minimum_rpm, capabilities_->minimum_start_rpm)));
}

double Planner::size_of(const VelocityCount& count) const {
  return count.rpm / (count.of_pulse ? static_cast<double>(settings_->scale.pulses_per_revolution) : 1);
}

double Planner::sent_rpm(int rpm) const {
  const auto step = size_of(capabilities_->velocity_count);
  if (step <= 0) return rpm;
  const auto sent = std::floor((rpm / step) + 1e-6) * step;
  return sent > rpm * (1 - 1e-9) ? rpm : sent;
}

Planner::Ramps Planner::sent_ramps(int rpm, const Ramps& told) const {
  const auto sent = sent_rpm(rpm);
  const auto fixed = capabilities_->fixed_deceleration;
  const auto step = size_of(capabilities_->acceleration_count);
  if (step <= 0) {
    // A drive whose velocities are coarse is slower than planned, and there the sooner.
    const auto shortened = [share = sent / std::max(rpm, 1)](Duration ramp) {
      return std::chrono::duration_cast<Duration>(share *
                                                  std::chrono::duration<double, Duration::period>(ramp));
    };
    return {.acceleration = shortened(told.acceleration),
            .deceleration = fixed > 0 ? milliseconds(fixed) : shortened(told.deceleration)};
  }
  constexpr double exact = 1e-12;  // what a number that is whole may be off by here
  const auto counts_of = [&](Duration time) {
    return rpm / (in_seconds(std::max<Duration>(time, milliseconds(1))) * step);
  };
  const auto rounded_down = [](double counts) { return std::floor(counts * (1 + exact)); };
  const auto rounded_up = [](double counts) { return std::ceil(counts * (1 - exact)); };
  const auto takes = [&](double counts) {
    return duration_of(std::min(sent / (std::clamp(counts, 1.0, most_counts) * step), longest_ramp_seconds));
  };
  // One ramp for both is that of a brake.
  const bool two_ramps = capabilities_->own_deceleration;
  const auto start = counts_of(told.acceleration);
  const auto brake =
      fixed > 0 ? static_cast<double>(fixed) : rounded_up(two_ramps ? counts_of(told.deceleration) : start);
  return {.acceleration = takes(two_ramps ? rounded_down(start) : rounded_up(start)),
          .deceleration = takes(brake)};
}

Planner::Ramps Planner::sent_ramps(const Plan& plan) const {
  return sent_ramps(std::abs(plan.velocity_rpm),
                    {.acceleration = plan.acceleration_time, .deceleration = plan.deceleration_time});
}

Plan Planner::granting(Plan plan) const {
  const auto in_ms = [](Duration time) {
    return std::max<Duration>(std::chrono::round<milliseconds>(time), milliseconds(1));
  };
  const auto [acceleration, deceleration] = sent_ramps(plan);
  const bool counted = capabilities_->acceleration_count.rpm > 0;
  plan.granted.velocity = std::abs(scale_->velocity_to_units(sent_rpm(plan.velocity_rpm)));
  plan.granted.acceleration_time = counted ? in_ms(acceleration) : plan.acceleration_time;
  plan.granted.deceleration_time =
      counted || capabilities_->fixed_deceleration > 0 ? in_ms(deceleration) : plan.deceleration_time;
  return plan;
}

Duration Planner::braking_time(double velocity, Duration told) const {
  const auto rpm = static_cast<int>(std::ceil(std::abs(scale_->velocity_to_rpm(velocity)) - 1e-6));
  return std::max(told, sent_ramps(rpm, {.acceleration = told, .deceleration = told}).deceleration);
}

Planner::Ramps Planner::ramps(const MotionValues& asked) const {
  const auto& limits = settings_->limits;
  if (!capabilities_->own_deceleration) {
    const auto both = asked.acceleration_time.value_or(limits.acceleration_time);
    return {.acceleration = both, .deceleration = both};
  }
  return {.acceleration = asked.acceleration_time.value_or(limits.acceleration_time),
          .deceleration = asked.deceleration_time.value_or(
              asked.acceleration_time.value_or(limits.deceleration_time.value_or(limits.acceleration_time)))};
}

void Planner::check_ramp(Duration time, const char* name, Obstacles& found) const {
  const auto low = milliseconds(capabilities_->minimum_time_ms);
  const auto high = milliseconds(capabilities_->maximum_time_ms);
  if (time < low || time > high)
    found.block(out_of_range(fmt::format("{} of {} ms", name, milliseconds_of(time)), milliseconds_of(low),
                             milliseconds_of(high), "ms"));
}

void Planner::check_profile(double velocity, const MotionValues& asked, Obstacles& found) const {
  const auto speed = std::abs(velocity);
  const auto unit = settings_->scale.unit + "/s";
  // A little beyond the limit is the limit, written with fewer digits.
  // The direction of a move is that of its target: a sign of its velocity would be dropped silently.
  const bool negative_in_move = asked.velocity && *asked.velocity < 0;
  if (!std::isfinite(velocity) || negative_in_move || speed > maximum_velocity() * (1 + 1e-9) ||
      speed < minimum_velocity() * (1 - 1e-9))
    found.block(out_of_range(fmt::format("velocity {} {}", negative_in_move ? velocity : speed, unit),
                             minimum_velocity(), maximum_velocity(), unit));
  const auto [acceleration, deceleration] = ramps(asked);
  const bool fixed = capabilities_->fixed_deceleration > 0;
  if (asked.deceleration_time && (fixed || *asked.deceleration_time != deceleration))
    found.block({.reason = Reason::not_supported,
                 .message = fmt::format(
                     "deceleration time of {} ms beside an acceleration time of {} ms: {}",
                     milliseconds_of(*asked.deceleration_time), milliseconds_of(acceleration),
                     fixed ? "the drive's deceleration is fixed" : "the drive brakes as it accelerates"),
                 .remedy = "leave the deceleration time out"});
  check_ramp(acceleration, "acceleration time", found);
  check_ramp(deceleration, "deceleration time", found);
}

Result<Plan> Planner::profile(double velocity, const MotionValues& asked) const {
  Obstacles found;
  check_profile(velocity, asked, found);
  if (auto allowed = found.verdict(); !allowed) return fail(allowed.error());
  const auto& limits = settings_->limits;
  const auto whole_ms = [](Duration time) { return milliseconds(milliseconds_of(time)); };
  const auto [acceleration, deceleration] = ramps(asked);
  Plan plan;
  // Never faster than asked: rounded down, except where the request is that very speed.
  const auto rpm = std::abs(scale_->velocity_to_rpm(velocity));
  plan.velocity_rpm = std::min(maximum_rpm(), static_cast<int>(std::floor(rpm + 1e-6)));
  plan.velocity_rpm = std::max(plan.velocity_rpm, capabilities_->minimum_start_rpm);
  plan.start_rpm = std::clamp(std::min(limits.start_speed_rpm, plan.velocity_rpm),
                              capabilities_->minimum_start_rpm, capabilities_->maximum_start_rpm);
  plan.acceleration_time = whole_ms(acceleration);
  plan.deceleration_time = whole_ms(deceleration);
  return granting(std::move(plan));
}

Result<void> Planner::check_soft_limits(double target, double from) const {
  const auto& limits = settings_->limits;
  if (!limits.position_minimum || !limits.position_maximum) return {};
  // Half a pulse beyond is the limit itself, rounded.
  const auto slack = 0.5 / std::abs(scale_->pulses_per_unit());
  const bool above = target > *limits.position_maximum + slack;
  const bool below = target < *limits.position_minimum - slack;
  if (!above && !below) return {};
  // Beyond the limit already: moving back towards the range is always allowed.
  if ((above && target < from) || (below && target > from)) return {};
  return fail(Error{
      .reason = Reason::soft_limit,
      .message = fmt::format("target {:.6g} {} is beyond a software limit", target, settings_->scale.unit),
      .remedy = "choose a target within the limits",
      .permitted = Range{.minimum = *limits.position_minimum,
                         .maximum = *limits.position_maximum,
                         .unit = settings_->scale.unit}});
}

void Planner::check_move(const PositionTracker::Target& target, const PositionTracker& tracker,
                         Obstacles& found) const {
  // Without trust the numbers mean nothing; what bounds such moves then is jog_travel, or a waiver in the
  // YAML.
  if (tracker.trust() != PositionTrust::unknown || !settings_->require_trust)
    found.block_on(check_soft_limits(target.position, tracker.position()));
  const auto distance = static_cast<double>(target.counter) - static_cast<double>(tracker.counter());
  if (std::abs(distance) > static_cast<double>(longest_move())) {
    const auto reach = static_cast<double>(longest_move()) / std::abs(scale_->pulses_per_unit());
    found.block(out_of_range(fmt::format("target {:.6g} {}", target.position, settings_->scale.unit),
                             tracker.position() - reach, tracker.position() + reach, settings_->scale.unit));
  }
}

bool Planner::positive(const PositionTracker::Target& target, const PositionTracker& tracker) const {
  return (target.counter >= tracker.counter()) != settings_->scale.invert;
}

Result<Plan> Planner::move(Plan plan, const PositionTracker::Target& target,
                           const PositionTracker& tracker) const {
  Obstacles found;
  check_move(target, tracker, found);
  if (auto allowed = found.verdict(); !allowed) return fail(allowed.error());
  return aimed(std::move(plan), target, tracker);
}

Plan Planner::aimed(Plan plan, const PositionTracker::Target& target, const PositionTracker& tracker) const {
  plan.target = target;
  plan.positive = positive(target, tracker);
  plan.granted.position = scale_->to_units(target.counter + tracker.offset());
  // Of an absolute move, too; and from where the drive was told to stand: what a reading wavers is no part of
  // it.
  plan.granted.distance =
      *plan.granted.position - scale_->to_units(tracker.resting_counter() + tracker.offset());
  plan.predicted = duration(plan, target.counter - tracker.counter());
  return plan;
}

Duration Planner::duration(const Plan& plan, std::int64_t pulses) const {
  const auto per_second = static_cast<double>(settings_->scale.pulses_per_revolution) / 60.0;
  const auto [acceleration, deceleration] = sent_ramps(plan);
  return move_duration(std::abs(static_cast<double>(pulses)), plan.start_rpm * per_second,
                       sent_rpm(plan.velocity_rpm) * per_second, acceleration, deceleration);
}

Duration Planner::soonest(const Plan& plan, std::int64_t pulses) const {
  const auto per_second = static_cast<double>(settings_->scale.pulses_per_revolution) / 60.0;
  // One that is said to be fixed may follow what is told all the same.
  const auto [acceleration, deceleration] = sent_ramps(plan);
  return soonest_duration(std::abs(static_cast<double>(pulses)), plan.start_rpm * per_second,
                          plan.velocity_rpm * per_second, std::min(acceleration, plan.acceleration_time),
                          std::min(deceleration, plan.deceleration_time));
}

Result<std::optional<HomingProfile>> Planner::homing() const {
  if (!settings_->homing) return std::optional<HomingProfile>{};
  const auto& homing = *settings_->homing;
  const auto to_rpm = [&](double velocity) {
    return static_cast<int>(std::floor(std::abs(scale_->velocity_to_rpm(velocity)) + 1e-6));
  };
  const auto unit = settings_->scale.unit + "/s";
  const auto units = [&](int rpm) { return std::abs(scale_->velocity_to_units(rpm)); };
  const auto highest = std::min(capabilities_->maximum_homing_rpm, maximum_rpm());
  const auto highest_search = std::min(capabilities_->maximum_search_rpm, maximum_rpm());
  HomingProfile profile{.method = settings_->scale.invert ? mirrored(homing.method) : homing.method,
                        .velocity_rpm = to_rpm(homing.velocity),
                        .search_velocity_rpm = to_rpm(homing.search_velocity),
                        .acceleration_time = homing.acceleration_time,
                        .offset_pulses = static_cast<std::int32_t>(std::clamp<std::int64_t>(
                            scale_->to_pulses(homing.offset), -1'000'000'000, 1'000'000'000))};
  if (homing.number) {
    const auto number = homing_number(*settings_, *capabilities_);
    if (!number) return fail(number.error());
    profile.number = *number;
  }
  if (profile.velocity_rpm < capabilities_->minimum_homing_rpm || profile.velocity_rpm > highest)
    return fail(out_of_range(fmt::format("homing velocity {} {}", homing.velocity, unit),
                             units(capabilities_->minimum_homing_rpm), units(highest), unit));
  if (profile.search_velocity_rpm < capabilities_->minimum_search_rpm ||
      profile.search_velocity_rpm > highest_search)
    return fail(out_of_range(fmt::format("homing search_velocity {} {}", homing.search_velocity, unit),
                             units(capabilities_->minimum_search_rpm), units(highest_search), unit));
  if (std::abs(profile.offset_pulses) > capabilities_->maximum_homing_offset_pulses) {
    const auto reach = capabilities_->maximum_homing_offset_pulses / std::abs(scale_->pulses_per_unit());
    return fail(out_of_range(fmt::format("homing offset {} {}", homing.offset, settings_->scale.unit), -reach,
                             reach, settings_->scale.unit));
  }
  return profile;
}

Duration move_duration(double pulses, double start_speed, double speed, Duration acceleration_time,
                       Duration deceleration_time) {
  if (pulses <= 0 || speed <= 0) return Duration{0};
  const auto ramps = in_seconds(acceleration_time) + in_seconds(deceleration_time);
  const auto mean = (start_speed + speed) / 2;
  const auto in_ramps = mean * ramps;
  if (in_ramps <= pulses) return duration_of(ramps + (pulses - in_ramps) / speed);
  // Too short to reach the speed: the ramps meet earlier. Bounded from above by the start speed all the way.
  return duration_of(std::min(ramps * std::sqrt(pulses / in_ramps) * 2, pulses / std::max(start_speed, 1.0)));
}

Duration soonest_duration(double pulses, double start_speed, double speed, Duration acceleration_time,
                          Duration deceleration_time) {
  const auto bound = move_duration(pulses, start_speed, speed, acceleration_time, deceleration_time);
  const auto ramps = std::chrono::duration<double>(acceleration_time + deceleration_time).count();
  if (pulses <= 0 || speed <= start_speed || (start_speed + speed) / 2 * ramps <= pulses) return bound;
  // Where both ramps meet, the speed is `top`.
  const auto won = speed - start_speed;
  const auto top = std::sqrt((start_speed * start_speed) + (2 * pulses * won / ramps));
  const std::chrono::duration<double> time(ramps * (top - start_speed) / won);
  return std::min(bound, std::chrono::duration_cast<Duration>(time));
}

HomingMethod mirrored(HomingMethod method) {
  switch (method) {
    case HomingMethod::home_positive:
      return HomingMethod::home_negative;
    case HomingMethod::home_negative:
      return HomingMethod::home_positive;
    case HomingMethod::positive_limit:
      return HomingMethod::negative_limit;
    case HomingMethod::negative_limit:
      return HomingMethod::positive_limit;
  }
  return method;
}

Result<std::int8_t> homing_number(const AxisSettings& settings, const Capabilities& capabilities) {
  const int wanted = settings.homing->number.value_or(0);
  const auto found = std::ranges::find(capabilities.homing_numbers, wanted, &HomingNumber::number);
  if (found == capabilities.homing_numbers.end())
    return fail(Reason::misconfigured, fmt::format("the drive has no homing method {}", wanted),
                "write another one, as homing: { method }");
  if (!settings.scale.invert) return found->number;
  if (found->mirror != 0) return found->mirror;
  return fail(Reason::misconfigured,
              fmt::format("homing method {} cannot be mirrored for an inverted axis", wanted),
              "write another one, or turn the motor's direction instead of scale.invert");
}

Result<void> check_mirror(const AxisSettings& settings, const DriveDescriptor& descriptor) {
  if (!settings.scale.invert) return {};
  const auto has = [&](std::string_view function) {
    return std::ranges::find(settings.inputs, function, &TerminalSettings::function) != settings.inputs.end();
  };
  if (has("pv_enable") && !has("pv_direction"))
    return fail(Reason::misconfigured,
                "pv_enable on an inverted axis would run the wrong way: the drive's own direction is fixed",
                "assign pv_direction, too, or turn the motor's direction instead of scale.invert");
  const auto approach = settings.model_settings.find("home_approach");
  const bool mirrors = descriptor.capabilities.home_approach_mirrors ||
                       (approach != settings.model_settings.end() &&
                        approach->second == SettingValue(std::string("as_searched")));
  const bool to_home = settings.homing && !settings.homing->number &&
                       (settings.homing->method == HomingMethod::home_positive ||
                        settings.homing->method == HomingMethod::home_negative);
  if (to_home && !mirrors)
    return fail(
        Reason::misconfigured,
        "this model approaches a home switch always in its own forward direction: on an inverted axis "
        "the other edge of the switch would be home",
        "home on a limit switch (positive_limit, negative_limit), or turn the motor's direction "
        "instead of scale.invert");
  return {};
}

Result<DriveSetup> drive_setup(const AxisSettings& settings, const DriveDescriptor& descriptor) {
  const Scale scale(settings.scale);
  const auto homing = Planner(settings, descriptor, scale).homing();
  if (!homing) return fail(homing.error());
  if (const auto mirrored = check_mirror(settings, descriptor); !mirrored) return fail(mirrored.error());
  std::optional<DriveSegments> segments;
  if (settings.segments) {
    auto table = to_drive(*settings.segments, settings, scale, descriptor);
    if (!table) return fail(table.error());
    segments = *table;
  }
  DriveSetup setup{.pulses_per_revolution = settings.scale.pulses_per_revolution,
                   .inputs = settings.inputs,
                   .outputs = settings.outputs,
                   .homing = *homing,
                   .persist = settings.persist,
                   .reboot_guard = settings.reboot_guard,
                   .model_settings = settings.model_settings,
                   .own_descriptor = settings.own_descriptor,
                   .segments = segments};
  if (settings.scale.invert) {
    const auto mirror = [](std::vector<TerminalSettings>& terminals,
                           std::span<const TerminalFunctionSpec> functions) {
      for (auto& terminal : terminals)
        if (const auto* function = find_function(functions, terminal.function);
            function && !function->mirror.empty())
          terminal.function = function->mirror;
      // The direction of PV is a level: the other one is the other direction.
      for (auto& terminal : terminals)
        if (terminal.function == "pv_direction") terminal.active_low = !terminal.active_low;
    };
    mirror(setup.inputs, descriptor.input_functions);
    mirror(setup.outputs, descriptor.output_functions);
  }
  return setup;
}

}  // namespace axisd
