#include "devices/cia402_eds/eds_drive.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <limits>
#include <set>
#include <utility>

#include "devices/cia402/encoding.hpp"
#include "devices/cia402/objects.hpp"
#include "devices/cia402_eds/eds_checks.hpp"
#include "devices/cia402_eds/unit_plan.hpp"

namespace axisd::cia402_eds {

namespace {

using canopen::Eds;
using canopen::Object;

std::string_view text_setting(const std::map<std::string, SettingValue>& settings, const std::string& key) {
  const auto found = settings.find(key);
  const auto* text = found == settings.end() ? nullptr : std::get_if<std::string>(&found->second);
  return text == nullptr ? std::string_view() : std::string_view(*text);
}

/// Without a number (0, an empty default, or the FFFFFFFFh of templates) nothing is compared.
std::optional<std::uint32_t> identity_of(const Eds& eds, Object object, std::optional<std::uint32_t> device) {
  constexpr std::uint32_t nobody = 0xFFFFFFFF;
  const auto is_number = [](std::uint32_t value) { return value != 0 && value != nobody; };
  const auto* entry = eds.find(object);
  if (entry != nullptr && entry->known())
    if (const auto told = static_cast<std::uint32_t>(entry->known()->value); is_number(told)) return told;
  return device && is_number(*device) ? device : std::nullopt;
}

bool can_home(const Eds& eds) {
  constexpr unsigned homing_bit = 5;
  for (const auto object :
       {cia402::object::homing_method, cia402::object::homing_speed, cia402::object::homing_search_speed})
    if (!can_write(eds, object)) return false;
  return supports(eds, homing_bit);
}

/// 24 and 28 mirror each other: the rising edge of the home switch in the direction of the search.
std::vector<cia402::HomingCode> homing_codes_of(const Eds& eds) {
  if (!can_home(eds)) return {};
  return {{.method = HomingMethod::home_positive, .code = 24},
          {.method = HomingMethod::home_negative, .code = 28},
          {.method = HomingMethod::positive_limit, .code = 18},
          {.method = HomingMethod::negative_limit, .code = 17}};
}

/// Of the methods of CiA 402 the one that does the same in the other direction; 0: none is known, as of a
/// maker's own.
int mirror_of(int number) {
  static constexpr std::pair<int, int> mirrors[] = {
      {1, 2},   {3, 5},   {4, 6},   {7, 11},  {8, 12},  {9, 13},  {10, 14}, {17, 18}, {19, 21},
      {20, 22}, {23, 27}, {24, 28}, {25, 29}, {26, 30}, {33, 34}, {35, 35}, {37, 37}};
  for (const auto& [one, other] : mirrors) {
    if (number == one) return other;
    if (number == other) return one;
  }
  return 0;
}

/// 60E3h, where the file has all of it; else what 6098h takes: a maker's own methods, and those of CiA 402.
std::set<int> homing_methods_of(const Eds& eds) {
  std::set<int> all, listed;
  const auto known = [&eds](Object object) -> std::optional<std::int64_t> {
    const auto* entry = eds.find(object);
    return entry == nullptr || !entry->known() ? std::nullopt : std::optional(entry->known()->value);
  };
  constexpr std::int64_t most_subs = 254;
  const auto count = std::clamp<std::int64_t>(known(object::homing_methods).value_or(0), 0, most_subs);
  bool complete = count > 0;
  for (std::int64_t sub = 1; sub <= count; ++sub) {
    const auto number = known({object::homing_methods.index, static_cast<std::uint8_t>(sub)});
    complete = complete && number;
    if (number) listed.insert(static_cast<std::int8_t>(*number));
  }
  const auto* method = eds.find(cia402::object::homing_method);
  const auto low = method->low ? method->low->value : std::numeric_limits<std::int8_t>::min();
  constexpr std::int64_t last_of_profile = 37;
  const auto high = std::min(last_of_profile, method->high ? method->high->value : last_of_profile);
  for (auto number = std::max<std::int64_t>(low, std::numeric_limits<std::int8_t>::min()); number <= high;
       ++number)
    all.insert(static_cast<int>(number));
  if (complete) all = std::move(listed);
  all.erase(0);
  return all;
}

std::vector<HomingNumber> homing_numbers_of(const Eds& eds) {
  if (!can_home(eds)) return {};
  const auto methods = homing_methods_of(eds);
  std::vector<HomingNumber> numbers;
  numbers.reserve(methods.size());
  for (const int number : methods) {
    const int mirror = mirror_of(number);
    numbers.push_back({.number = static_cast<std::int8_t>(number),
                       .mirror = static_cast<std::int8_t>(methods.contains(mirror) ? mirror : 0)});
  }
  return numbers;
}

int as_int(std::int64_t value) {
  return static_cast<int>(std::clamp<std::int64_t>(value, 0, std::numeric_limits<std::int32_t>::max()));
}

/// The fastest and the slowest motion that the drive's own range and unit of velocities permit.
void limit_velocities(Capabilities& all, std::int64_t most_counts, cia402::Rate unit) {
  const auto fastest = std::min<std::int64_t>(most_counts, std::numeric_limits<std::int32_t>::max());
  all.velocity_count = {.rpm = cia402::rpm_of_count(unit), .of_pulse = unit.angle == cia402::Angle::pulse};
  if (unit.angle == cia402::Angle::pulse) {
    all.maximum_pulse_rate_hz = cia402::fastest_pulse_rate(unit, fastest);
  } else {
    all.maximum_rpm = cia402::fastest_rpm(unit, fastest);
    all.minimum_rpm = std::max(all.minimum_rpm, cia402::slowest_rpm(unit));
    all.minimum_homing_rpm = std::max(all.minimum_homing_rpm, all.minimum_rpm);
    all.minimum_search_rpm = std::max(all.minimum_search_rpm, all.minimum_rpm);
  }
  all.maximum_homing_rpm = all.maximum_search_rpm = all.maximum_rpm;
}

/// By the file, of a drive that shows its deceleration and does not let it be written; 0: it has none.
std::int64_t fixed_deceleration_of(const Eds& eds) {
  const auto* entry = eds.find(cia402::object::deceleration);
  if (entry == nullptr || canopen::writable(entry->access) || !entry->known()) return 0;
  return std::max<std::int64_t>(0, entry->known()->value);
}

/// 6085h counts where 605Dh can choose it.
QuickStopRamp quick_stop_ramp_of(const Eds& eds, std::span<const ParameterSpec> rows) {
  const auto* ramp = find_parameter(rows, cia402::object::quick_stop_deceleration.key());
  const bool shown = ramp != nullptr && ramp->access != Access::wo;
  return shown && can_write(eds, cia402::object::halt_option) ? QuickStopRamp::own : QuickStopRamp::of_stop;
}

/// In the units that axisd plans in: r/min, pulses per second, ms.
Capabilities capabilities_of(const Capabilities& base, std::span<const ParameterSpec> rows,
                             const Conventions& conventions) {
  const auto row = [rows](Object object) { return find_parameter(rows, object.key()); };
  auto all = base;
  auto fastest = row(cia402::object::profile_velocity)->maximum;
  if (all.velocity_mode) fastest = std::min(fastest, row(cia402::object::target_velocity)->maximum);
  limit_velocities(all, fastest, conventions.units.velocity);
  const auto* target = row(cia402::object::target_position);
  const auto whole = [](std::int64_t value) {
    using Limits = std::numeric_limits<std::int32_t>;
    return static_cast<std::int32_t>(std::clamp<std::int64_t>(value, Limits::min(), Limits::max()));
  };
  all.minimum_target_pulses = whole(target->minimum);
  all.maximum_target_pulses = whole(target->maximum);
  const auto* ramp = row(cia402::object::acceleration);
  if (conventions.units.ramps == cia402::Ramps::times) {
    all.minimum_time_ms = as_int(ramp->minimum);
    all.maximum_time_ms = std::min(all.maximum_time_ms, as_int(ramp->maximum));
    all.minimum_homing_time_ms = all.minimum_time_ms;
  } else {
    const auto unit = conventions.units.acceleration;
    all.acceleration_count = {.rpm = cia402::rpm_of_count(unit),
                              .of_pulse = unit.angle == cia402::Angle::pulse};
  }
  all.closed_loop = conventions.closed_loop;
  all.position_source = conventions.closed_loop ? PositionSource::encoder : PositionSource::commanded;
  return all;
}

}  // namespace

Result<Conventions> conventions_of(const Eds& eds, const std::map<std::string, SettingValue>& settings) {
  const auto units = plan_units(eds, settings);
  if (!units) return fail(units.error());
  return Conventions{.units = *units, .closed_loop = text_setting(settings, "loop_mode") != "open"};
}

EdsDrive::EdsDrive(const DriveDescriptor& base, const Eds& eds, const Conventions& conventions,
                   std::vector<std::string> warnings_of_file)
    : DriveDescriptor(base),
      catalogue_(catalogue_of(eds)),
      homing_codes_(homing_codes_of(eds)),
      homing_numbers_(homing_numbers_of(eds)),
      velocity_lack_(velocity_mode_lack(eds)),
      warnings_(std::move(warnings_of_file)),
      unit_objects_(unit_objects_of(eds)) {
  warnings = warnings_;
  parameters = catalogue_.rows;
  capabilities.velocity_mode_lack = velocity_lack_;
  capabilities.velocity_mode = velocity_lack_.empty();
  capabilities = capabilities_of(capabilities, parameters, conventions);
  capabilities.homing = !homing_codes_.empty();
  capabilities.homing_numbers = homing_numbers_;
  capabilities.homing_ramp = eds.find(cia402::object::homing_acceleration) != nullptr;
  capabilities.own_deceleration = can_write(eds, cia402::object::deceleration);
  capabilities.fixed_deceleration = fixed_deceleration_of(eds);
  capabilities.quick_stop_ramp = quick_stop_ramp_of(eds, parameters);
  const bool has_inputs = eds.find(object::inputs_value) != nullptr;
  if (!has_inputs) inputs = {};
  specialise = nullptr;
  model_.descriptor = this;
  model_.identity.vendor = identity_of(eds, object::identity_vendor, eds.vendor);
  model_.identity.product = identity_of(eds, object::identity_product, eds.product);
  model_.homing_codes = homing_codes_;
  model_.neutral_mode = neutral_mode_of(eds);
  capabilities.passes_no_mode = model_.neutral_mode == cia402::OperationMode::none;
  model_.objects.velocity = object::velocity_value;
  if (has_inputs) model_.objects.inputs = object::inputs_value;
  if (eds.find(object::position_window) != nullptr) model_.objects.position_window = object::position_window;
  if (eds.find(object::velocity_threshold) != nullptr)
    model_.objects.velocity_threshold = object::velocity_threshold;
  const auto* commanded = eds.find(object::commanded_position);
  if (conventions.closed_loop && commanded != nullptr && commanded->mappable)
    model_.objects.commanded_position = object::commanded_position;
  // CiA 301 7.5.2.13, 7.5.2.14: "save" and "load".
  constexpr std::int64_t save = 0x65766173, load = 0x64616F6C;
  if (eds.find(object::store_all) != nullptr)
    model_.objects.save = cia402::MemoryCommand{object::store_all, save};
  if (eds.find(object::restore_all) != nullptr)
    model_.objects.restore = cia402::MemoryCommand{object::restore_all, load};
  model_.meaning.units = conventions.units;
  model_.unit_objects = unit_objects_;
  model_.halts_in_one_way = !can_write(eds, cia402::object::halt_option);
  const std::size_t braking = (capabilities.fixed_deceleration > 0 ? 1 : 0) +
                              (capabilities.quick_stop_ramp == QuickStopRamp::own ? 1 : 0);
  can_transactions =
      cia402::transactions_of(model_, static_cast<std::uint8_t>(unit_objects_.size() + braking));
}

Result<std::shared_ptr<const DriveDescriptor>> specialise(
    const DriveDescriptor& base, const std::map<std::string, SettingValue>& settings) {
  const std::string path(text_setting(settings, "eds"));
  if (path.empty())
    return fail(Reason::invalid_argument, "no EDS is named",
                "add drive: { eds: FILE }, the data sheet of the drive");
  auto eds = canopen::load_eds(path);
  if (!eds) return fail(eds.error());
  const auto refused = [&path](const std::vector<EdsFinding>& findings, std::string remedy) {
    std::string message;
    for (const auto& [line, what, settled_by] : findings)
      message += fmt::format("{}{}{}: {}", message.empty() ? "" : "\n", path,
                             line == 0 ? std::string() : fmt::format(":{}", line), what);
    return fail(Reason::invalid_argument, std::move(message), std::move(remedy));
  };
  const auto overrides = overrides_of(settings);
  std::vector<EdsFinding> findings;
  for (auto& problem : apply_overrides(overrides, *eds)) findings.push_back({0, std::move(problem)});
  if (!findings.empty()) return refused(findings, "correct drive: { objects: ... } by the drive's manual");
  findings = check_eds(*eds, overrides);
  if (!findings.empty()) return refused(findings, remedy_of(findings));
  const auto conventions = conventions_of(*eds, settings);
  if (!conventions) return refused({{0, conventions.error().message}}, conventions.error().remedy);
  auto warnings = warnings_of(*eds, overrides, path);
  if (const auto doubt = doubtful_units(*eds, conventions->units))
    warnings.push_back(fmt::format("{}: {}; a drive that was not set otherwise is refused at bring-up: {}",
                                   path, doubt->message, doubt->remedy));
  return std::make_shared<const EdsDrive>(base, *eds, *conventions, std::move(warnings));
}

}  // namespace axisd::cia402_eds
