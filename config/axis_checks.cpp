#include "config/axis_checks.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <functional>
#include <limits>
#include <string>
#include <utility>

#include "buses/regular_file.hpp"
#include "config/checks.hpp"
#include "config/quantity.hpp"
#include "config/text.hpp"
#include "devices/axis/planner.hpp"

namespace axisd::config {

namespace {

/// Relative slack in comparisons of motor speeds: the YAML's decimals pass through divisions.
constexpr double slack = 1e-9;

/// "-128 to -1, 1 to 37".
std::string text_of(std::span<const HomingNumber> numbers) {
  std::string text;
  for (std::size_t first = 0; first < numbers.size();) {
    auto last = first;
    while (last + 1 < numbers.size() && numbers[last + 1].number == numbers[last].number + 1) ++last;
    text += fmt::format("{}{}", text.empty() ? "" : ", ", int{numbers[first].number});
    if (last > first) text += fmt::format(" to {}", int{numbers[last].number});
    first = last + 1;
  }
  return text;
}

}  // namespace

void AxisChecks::run() {
  specialise();
  check_node();
  check_microstep();
  complete_scale();
  check_policies();
  check_poll();
  check_turnaround();
  check_drift_check();
  check_persist();
  if (axis_.scale.modulo && given("limits.position")) {
    add("scale.modulo", "'modulo' and limits.position exclude each other",
        "an axis that wraps has no software limits; leave one of them out");
  }
  if (model_ != nullptr) {
    add_default_settings(axis_, *model_);
    check_times();
  }
  if (scale_) check_distances();
  if (scale_ && model_ != nullptr) check_speeds();
  if (axis_.homing) check_homing();
  check_terminals();
  if (axis_.segments) check_segments();
}

void AxisChecks::add(std::string_view key, std::string message, std::string suggestion) {
  if (!reported_.emplace(key).second) return;
  diagnostics_.add(places_.mark(path_ + std::string(key)), std::move(message), std::move(suggestion));
}

std::string AxisChecks::velocity_text(double value) const {
  return fmt::format("{} {}/s", format_number(value), axis_.scale.unit);
}

namespace {

/// Files that are named in a configuration are smaller.
constexpr std::size_t largest_file = 4U << 20U;
/// One line about such a file, which quotes its path and its text.
constexpr std::size_t longest_problem = 600;

/// Of the content of a file; 0 for none that can be read.
std::size_t content_of(const SettingValue& path) {
  const auto text = read_regular_file(std::get<std::string>(path), largest_file);
  return text ? std::hash<std::string>()(*text) : 0;
}

}  // namespace

void AxisChecks::specialise() {
  if (model_ == nullptr || model_->specialise == nullptr || !usable("drive")) return;
  for (const auto& setting : model_->settings) {
    const auto key = fmt::format("drive.{}", setting.key);
    if (!clean(key)) return;
    if (!setting.required || axis_.model_settings.contains(std::string(setting.key))) continue;
    add("drive", fmt::format("missing key '{}' in {}drive", setting.key, path_),
        fmt::format("model {} needs it: {}", axis_.model, setting.description));
    return;
  }
  add_default_settings(axis_, *model_);
  const auto file = std::ranges::find(model_->settings, "path", &SettingSpec::kind);
  // Before it is read for good: what changes in between shows at the next look.
  axis_.own_descriptor_source = content_of(axis_.model_settings.at(std::string(file->key)));
  const auto made = model_->specialise(*model_, axis_.model_settings);
  if (made) {
    axis_.own_descriptor = *made;
    model_ = made->get();
    return;
  }
  const auto mark = places_.mark(fmt::format("{}drive.{}", path_, file->key));
  std::string_view lines = made.error().message;
  while (!lines.empty()) {
    const auto end = std::min(lines.find('\n'), lines.size());
    diagnostics_.add(mark, printable(lines.substr(0, end), longest_problem), made.error().remedy);
    lines.remove_prefix(std::min(end + 1, lines.size()));
  }
}

void AxisChecks::check_node() {
  if (model_ == nullptr || !usable("node")) return;
  if (axis_.node >= model_->minimum_node && axis_.node <= model_->maximum_node) return;
  add("node", fmt::format("model {} cannot have address {}", axis_.model, axis_.node),
      fmt::format("write a value between {} and {}", model_->minimum_node, model_->maximum_node));
}

void AxisChecks::check_microstep() {
  if (model_ == nullptr || !usable("scale.microstep")) return;
  const auto permitted = model_->capabilities.pulses_per_revolution;
  const auto wanted = axis_.scale.pulses_per_revolution;
  if (permitted.empty() || std::ranges::find(permitted, wanted) != permitted.end()) return;
  const auto nearest = *std::ranges::min_element(
      permitted, {}, [&](std::int32_t value) { return std::abs(std::int64_t{value} - wanted); });
  std::vector<std::string> texts;
  for (const auto value : permitted) texts.push_back(std::to_string(value));
  const auto list = names_of(texts, [](const std::string& text) -> std::string_view { return text; });
  add("scale.microstep", fmt::format("model {} cannot be set to {} pulses/rev", axis_.model, wanted),
      fmt::format("nearest is {} pulses/rev; permitted: {}", nearest, alternatives(list)));
}

void AxisChecks::complete_scale() {
  auto& scale = axis_.scale;
  if (!usable("unit") || !usable("scale.microstep") || !usable("scale.gear") || !usable("scale.travel"))
    return;
  if (!given("scale.travel")) {
    constexpr auto without_travel = std::to_array<std::string_view>({"deg", "rev"});
    if (std::ranges::find(without_travel, scale.unit) == without_travel.end()) {
      const auto meant = nearest(scale.unit, without_travel);
      const auto unit = meant.empty() ? "" : fmt::format("did you mean unit: {}? else ", meant);
      add("scale.travel", fmt::format("missing key 'travel' in {}scale", path_),
          fmt::format("{}for example travel: 5 {}/rev", unit, scale.unit));
      return;
    }
    scale.travel_numerator = scale.unit == "deg" ? 360 : 1;
  }
  if (Scale::valid(scale)) {
    scale_.emplace(scale);
  } else {
    add("scale", "the scale is too fine or too coarse to be calculated exactly",
        "use fewer digits in gear and travel");
  }
}

void AxisChecks::check_policies() {
  if (!axis_.vertical || !usable("load")) return;
  // M2: a policy must not let the load fall.
  if (axis_.stop_escalation_release) {
    add("stop_escalation", "'stop_escalation: release' would release a vertical load", "use none");
  }
  if (axis_.on_lease_loss == LeaseLoss::disable)
    add("on_lease_loss", "'on_lease_loss: disable' would release a vertical load", "use halt or stop");
  if (model_ != nullptr && model_->capabilities.passes_no_mode)
    add("load",
        fmt::format(
            "this drive of model {} may let a vertical load sag: with neither velocity nor homing mode "
            "it is enabled, and moved after a stop, by way of no mode at all",
            axis_.model),
        "where it has one of them, say so: drive: { objects: ... }; else take another drive");
}

void AxisChecks::check_persist() {
  if (model_ == nullptr || !given("persist") || !axis_.persist.any() || !usable("persist")) return;
  constexpr std::string_view on_command = "DriveService.SaveParameters saves everything";
  if (!model_->saves.any()) {
    add("persist", fmt::format("'persist' has no effect: model {} saves on command only", axis_.model),
        fmt::format("leave it out; {}", on_command));
    return;
  }
  if (axis_.persist == PersistSettings::all()) return;  // `true`: what there is
  static constexpr std::pair<std::string_view, bool PersistSettings::*> parts[] = {
      {"terminals", &PersistSettings::terminals},
      {"segments", &PersistSettings::segments},
      {"homing", &PersistSettings::homing},
      {"drive", &PersistSettings::drive}};
  for (const auto& [name, part] : parts)
    if (axis_.persist.*part && !(model_->saves.*part))
      add("persist",
          fmt::format("'{}' has no effect in 'persist': model {} does not save it as it is written", name,
                      axis_.model),
          fmt::format("leave it out of the list; {}", on_command));
}

void AxisChecks::check_drift_check() {
  if (model_ == nullptr || !given("drift_check")) return;
  const auto is_fixed = [](const TerminalSpec& terminal) { return !terminal.function.empty(); };
  const bool configures =
      !std::ranges::all_of(model_->inputs, is_fixed) || !std::ranges::all_of(model_->outputs, is_fixed) ||
      std::ranges::any_of(model_->settings,
                          [](const SettingSpec& setting) { return setting.object.has_value(); });
  if (!configures)
    add("drift_check",
        fmt::format("'drift_check' has no effect: axisd sets no terminals on model {}", axis_.model),
        "leave it out");
}

void AxisChecks::check_poll() {
  if (!usable("poll.moving") || !usable("poll.idle") || axis_.poll_idle >= axis_.poll_moving) return;
  add(given("poll.idle") ? "poll.idle" : "poll.moving",
      fmt::format("idle axes would be polled more often ({}) than moving ones ({})",
                  format_duration(axis_.poll_idle), format_duration(axis_.poll_moving)),
      "make poll.idle at least poll.moving");
}

void AxisChecks::check_turnaround() {
  if (model_ == nullptr || model_->bus == BusKind::modbus_rtu || !given("turnaround_max")) return;
  add("turnaround_max", fmt::format("model {} is not on RS-485", axis_.model),
      "leave it out; the canopen bus has sdo_timeout");
}

void AxisChecks::check_time(std::string_view key, Duration value, int minimum_ms) {
  if (!given(key) || !usable(key)) return;
  const auto maximum_ms = model_->capabilities.maximum_time_ms;
  if (value < milliseconds(minimum_ms) || value > milliseconds(maximum_ms)) {
    add(key, fmt::format("{} is out of range: {}", format_duration(value), key),
        fmt::format("model {} takes {} ms to {} ms", axis_.model, minimum_ms, maximum_ms));
  } else if (value % milliseconds(1) != Duration::zero()) {
    add(key, fmt::format("{} is not a whole number of ms: {}", format_duration(value), key),
        fmt::format("model {} takes whole ms", axis_.model));
  }
}

void AxisChecks::check_times() {
  const auto& capabilities = model_->capabilities;
  check_time("limits.acceleration_time", axis_.limits.acceleration_time, capabilities.minimum_time_ms);
  if (!capabilities.own_deceleration && given("limits.deceleration_time"))
    add("limits.deceleration_time",
        fmt::format("'deceleration_time' has no effect: this drive of model {} {}", axis_.model,
                    capabilities.fixed_deceleration > 0 ? "has a deceleration that cannot be set"
                                                        : "brakes as it accelerates"),
        capabilities.fixed_deceleration > 0 ? "leave it out" : "leave it out; acceleration_time is for both");
  check_time("limits.deceleration_time", axis_.limits.deceleration_time.value_or(Duration::zero()),
             capabilities.minimum_time_ms);
  if (axis_.homing) {
    check_time("homing.acceleration_time", axis_.homing->acceleration_time,
               capabilities.minimum_homing_time_ms);
  }
}

void AxisChecks::check_distance(std::string_view key, std::optional<double> value, std::string_view from) {
  // The drives count in signed 32 bit.
  constexpr std::int64_t largest = std::numeric_limits<std::int32_t>::max();
  if (!value || !given(key) || !usable(key)) return;
  const auto pulses = scale_->checked_pulses(*value);
  if (pulses && *pulses <= largest && *pulses >= -largest) return;
  add(key,
      fmt::format("{} {}{} is more than the drive can count", format_number(*value), axis_.scale.unit, from),
      fmt::format("at most {} {} either way", format_number(std::abs(scale_->to_units(largest))),
                  axis_.scale.unit));
}

void AxisChecks::check_target(std::string_view key, std::optional<double> value, std::string_view from) {
  check_distance(key, value, from);
  if (!value || model_ == nullptr || !given(key) || !usable(key) || reported_.contains(key)) return;
  const auto pulses = scale_->to_pulses(*value);
  const std::int64_t lowest = model_->capabilities.minimum_target_pulses;
  const std::int64_t highest = model_->capabilities.maximum_target_pulses;
  if (pulses >= lowest && pulses <= highest) return;
  const auto [first, last] = std::minmax({scale_->to_units(lowest), scale_->to_units(highest)});
  add(key,
      fmt::format("{} {}{} is {} pulses: more than model {} can be sent", format_number(*value),
                  axis_.scale.unit, from, pulses, axis_.model),
      fmt::format("between {} and {} {}{}", format_number(first), format_number(last), axis_.scale.unit,
                  from));
}

void AxisChecks::check_distances() {
  check_target("scale.modulo", axis_.scale.modulo);
  for (const auto limit : {axis_.limits.position_minimum, axis_.limits.position_maximum}) {
    check_distance("limits.position", limit);
    // The drive counts from where it was homed.
    if (limit && axis_.homing && usable("homing.position"))
      check_target("limits.position", *limit - axis_.homing->position, " from homing.position");
  }
  check_target("jog_travel", axis_.jog_travel);
  check_distance("position_tolerance", axis_.position_tolerance);
  // It bounds what an axis with limits may do while its position is unknown.
  if (given("jog_travel") && usable("limits") && !given("limits.position"))
    add("jog_travel", "'jog_travel' has no effect without limits: { position: ... }",
        "leave it out, or add the limits");
  if (axis_.homing) {
    check_distance("homing.position", axis_.homing->position);
    check_target("homing.backoff", axis_.homing->backoff);
    check_distance("homing.max_travel", axis_.homing->max_travel);
  }
  check_distance("simulate.home_switch", entry_.simulation.home_switch);
  check_distance("simulate.home_width", entry_.simulation.home_width);
  check_distance("simulate.positive_limit", entry_.simulation.positive_limit);
  check_distance("simulate.negative_limit", entry_.simulation.negative_limit);
  check_distance("simulate.start_position", entry_.simulation.start_position);
}

void AxisChecks::check_speed(std::string_view key, double velocity, double minimum_rpm, double maximum_rpm) {
  if (!given(key) || !usable(key)) return;
  const double rpm = std::abs(scale_->velocity_to_rpm(velocity));
  const bool too_slow = rpm < minimum_rpm * (1 - slack);
  if (!too_slow && rpm <= maximum_rpm * (1 + slack)) return;
  const double bound = too_slow ? minimum_rpm : maximum_rpm;
  const auto direction = too_slow ? "at least" : "at most";
  add(key,
      fmt::format("{} {} is {} r/min of the motor; {} {} r/min at {} pulses/rev", key,
                  velocity_text(velocity), format_number(rpm), direction, bound,
                  axis_.scale.pulses_per_revolution),
      fmt::format("write {} {}", direction, velocity_text(std::abs(scale_->velocity_to_units(bound)))));
}

double AxisChecks::maximum_rpm() const {
  // 200 kHz of pulses; the drives take whole r/min.
  const auto& capabilities = model_->capabilities;
  const auto pulse_limit = 60 * capabilities.maximum_pulse_rate_hz / axis_.scale.pulses_per_revolution;
  return static_cast<double>(std::min<std::int64_t>(capabilities.maximum_rpm, pulse_limit));
}

void AxisChecks::check_start_speed() {
  const auto& capabilities = model_->capabilities;
  const int start = axis_.limits.start_speed_rpm;
  if (!usable("limits.start_speed")) return;
  if (capabilities.maximum_start_rpm == 0) {
    if (given("limits.start_speed"))
      add("limits.start_speed", fmt::format("'start_speed' has no effect: model {} has none", axis_.model),
          "leave it out");
    return;
  }
  if (start < capabilities.minimum_start_rpm || start > capabilities.maximum_start_rpm) {
    add("limits.start_speed", fmt::format("'start_speed' {} r/min is out of range", start),
        fmt::format("model {} takes {} to {} r/min", axis_.model, capabilities.minimum_start_rpm,
                    capabilities.maximum_start_rpm));
  } else if (usable("limits.velocity") && !reported_.contains("limits.velocity")) {
    const double highest = std::abs(scale_->velocity_to_rpm(axis_.limits.velocity));
    if (start > highest * (1 + slack)) {
      add("limits.start_speed",
          fmt::format("'start_speed' {} r/min is above limits.velocity ({} r/min)", start,
                      format_number(highest)),
          "start slower");
    }
  }
}

/// A deceleration that is only read is believed: one that no drive has (1 count/s^2, as templates have it)
/// would make every bound of a stop meaningless.
void AxisChecks::check_braking() {
  constexpr auto longest = std::chrono::seconds(60);
  if (model_->capabilities.fixed_deceleration <= 0) return;
  if (!usable("limits.velocity") || reported_.contains("limits.velocity")) return;
  const auto time = Planner(axis_, *model_, *scale_).braking_time(axis_.limits.velocity, Duration::zero());
  if (time <= longest) return;
  add("limits.velocity",
      fmt::format("by 6084h it brakes for {} s from limits.velocity",
                  std::chrono::round<std::chrono::seconds>(time).count()),
      "lower limits.velocity, or say what the drive does: objects: { 6084h: { access: none } }");
}

void AxisChecks::check_speeds() {
  const auto& capabilities = model_->capabilities;
  check_speed("limits.velocity", axis_.limits.velocity, capabilities.minimum_rpm, maximum_rpm());
  check_braking();
  check_start_speed();
  if (!axis_.homing) return;
  const auto& homing = *axis_.homing;
  check_speed("homing.velocity", homing.velocity, capabilities.minimum_homing_rpm,
              std::min<double>(capabilities.maximum_homing_rpm, maximum_rpm()));
  check_speed("homing.search_velocity", homing.search_velocity, capabilities.minimum_search_rpm,
              std::min<double>(capabilities.maximum_search_rpm, maximum_rpm()));
  const auto offset = scale_->checked_pulses(homing.offset);
  const std::int64_t largest = capabilities.maximum_homing_offset_pulses;
  if (largest == 0 && usable("homing.offset") && homing.offset != 0) {
    add("homing.offset",
        fmt::format("model {} stops at the switch: it goes no 'offset' further", axis_.model),
        "leave it out; homing.position says where the axis is at the switch");
  } else if (usable("homing.offset") && (!offset || std::abs(*offset) > largest)) {
    add("homing.offset",
        fmt::format("'offset' {} {} is out of range", format_number(homing.offset), axis_.scale.unit),
        fmt::format("model {} takes up to {} {} either way", axis_.model,
                    format_number(std::abs(scale_->to_units(largest))), axis_.scale.unit));
  }
}

void AxisChecks::check_below(std::string_view key, double velocity, std::string_view limit_key,
                             double limit) {
  if (!usable(key) || !usable(limit_key) || velocity <= limit) return;
  add(key, fmt::format("{} {} is above {}", key, velocity_text(velocity), limit_key),
      fmt::format("write at most {}", velocity_text(limit)));
}

void AxisChecks::check_homing() {
  const auto& homing = *axis_.homing;
  if (model_ != nullptr && !model_->capabilities.homing)
    add("homing", fmt::format("this drive of model {} does not home", axis_.model),
        "leave it out; SetPosition tells the axis where it stands");
  if (model_ != nullptr && !model_->capabilities.homing_ramp && given("homing.acceleration_time"))
    add("homing.acceleration_time",
        fmt::format("'acceleration_time' has no effect: this drive of model {} has none for homing",
                    axis_.model),
        "leave it out");
  if (model_ != nullptr && model_->inputs.empty() && !homing.number && given("homing.backoff"))
    add("homing.backoff",
        fmt::format("'backoff' has no effect: this drive of model {} does not show its switches",
                    axis_.model),
        "leave it out: the drive leaves an active switch by itself");
  if (homing.number) check_homing_number();
  check_below("homing.velocity", homing.velocity, "limits.velocity", axis_.limits.velocity);
  check_below("homing.search_velocity", homing.search_velocity, "homing.velocity", homing.velocity);
}

void AxisChecks::check_homing_number() {
  if (given("homing.backoff"))
    add("homing.backoff", "'backoff' has no effect with a homing method by its number",
        "leave it out: the drive leaves an active switch by itself");
  if (model_ == nullptr || !model_->capabilities.homing || !usable("homing.method")) return;
  if (model_->specialise != nullptr) return;  // its data sheet could not be read: which it has is not known
  const auto numbers = model_->capabilities.homing_numbers;
  const int wanted = *axis_.homing->number;
  const auto found = std::ranges::find(numbers, wanted, &HomingNumber::number);
  if (numbers.empty() && axis_.own_descriptor != nullptr)
    add("homing.method",
        fmt::format("this drive of model {} has no homing method, by its data sheet", axis_.model),
        "where it has some, say so: drive: { objects: { 6098h: { minimum: NUMBER, maximum: NUMBER } } }");
  else if (numbers.empty())
    add("homing.method", fmt::format("homing methods of model {} have no numbers", axis_.model),
        "permitted: " + alternatives(homing_methods()));
  else if (found == numbers.end())
    add("homing.method", fmt::format("this drive of model {} has no homing method {}", axis_.model, wanted),
        "by its data sheet it may have " + text_of(numbers));
  else if (axis_.scale.invert && usable("scale.invert") && found->mirror == 0)
    add("homing.method", fmt::format("homing method {} cannot be mirrored for an inverted axis", wanted),
        "write another one, or turn the motor's direction instead of scale.invert");
}

void complete_axis(AxisEntry& entry, Diagnostics& diagnostics, const Places& places) {
  AxisChecks(entry, diagnostics, places).run();
}

}  // namespace axisd::config
