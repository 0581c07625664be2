#include "devices/cia402_eds/eds_drive.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <limits>

#include "devices/cia402/encoding.hpp"
#include "devices/cia402/objects.hpp"

namespace axisd::cia402_eds {

namespace {

using canopen::Eds;
using canopen::Object;

constexpr Object identity_vendor{0x1018, 1}, identity_product{0x1018, 2}, commanded_position{0x6062, 0},
    position_window{0x6067, 0}, velocity_value{0x606C, 0}, inputs_value{0x60FD, 0}, drive_modes{0x6502, 0},
    store_all{0x1010, 1}, restore_all{0x1011, 1};

struct Needed {
  Object object;
  std::string_view name;
  bool written;
};
/// What each start, stop and reading of the driver uses, whatever else a drive has.
constexpr auto needed = std::to_array<Needed>({
    {cia402::object::control_word, "control word", true},
    {cia402::object::status_word, "status word", false},
    {cia402::object::mode, "modes of operation", true},
    {cia402::object::mode_display, "modes of operation display", false},
    {cia402::object::position, "position actual value", false},
    {velocity_value, "velocity actual value: nothing else tells standstill", false},
    {cia402::object::target_position, "target position", true},
    {cia402::object::profile_velocity, "profile velocity", true},
    {cia402::object::acceleration, "profile acceleration", true},
    {cia402::object::deceleration, "profile deceleration", true},
    {cia402::object::target_velocity, "target velocity", true},
});

std::string_view text_setting(const std::map<std::string, SettingValue>& settings, const std::string& key) {
  const auto found = settings.find(key);
  const auto* text = found == settings.end() ? nullptr : std::get_if<std::string>(&found->second);
  return text == nullptr ? std::string_view() : std::string_view(*text);
}

std::optional<std::uint32_t> identity_of(const Eds& eds, Object object, std::optional<std::uint32_t> device) {
  // Without a number (0, or an empty default) nothing is compared.
  const auto* entry = eds.find(object);
  if (entry != nullptr && entry->initial && entry->initial->value != 0)
    return static_cast<std::uint32_t>(entry->initial->value);
  return device.value_or(0) == 0 ? std::nullopt : device;
}

/// 6502h; without it, or without its value, a drive is taken to have every mode.
bool supports(const Eds& eds, unsigned mode_bit) {
  const auto* modes = eds.find(drive_modes);
  return modes == nullptr || !modes->initial || modes->initial->value == 0 ||
         (static_cast<std::uint64_t>(modes->initial->value) >> mode_bit & 1U) != 0;
}

bool can_home(const Eds& eds) {
  constexpr unsigned homing_bit = 5;
  for (const auto object :
       {cia402::object::homing_method, cia402::object::homing_speed, cia402::object::homing_search_speed})
    if (eds.find(object) == nullptr || !canopen::writable(eds.find(object)->access)) return false;
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

int as_int(std::int64_t value) {
  return static_cast<int>(std::clamp<std::int64_t>(value, 0, std::numeric_limits<std::int32_t>::max()));
}

/// In the units that axisd plans in: r/min, pulses per second, ms.
Capabilities capabilities_of(const Capabilities& base, std::span<const ParameterSpec> rows,
                             const Conventions& conventions) {
  const auto row = [rows](Object object) { return find_parameter(rows, object.key()); };
  auto all = base;
  const auto fastest =
      std::min(row(cia402::object::profile_velocity)->maximum, row(cia402::object::target_velocity)->maximum);
  if (conventions.velocity_in_rpm)
    all.maximum_rpm = as_int(fastest);
  else
    all.maximum_pulse_rate_hz = fastest;
  all.minimum_target_pulses = static_cast<std::int32_t>(row(cia402::object::target_position)->minimum);
  all.maximum_target_pulses = static_cast<std::int32_t>(row(cia402::object::target_position)->maximum);
  const auto* ramp = row(cia402::object::acceleration);
  if (conventions.ramps_are_times) {
    all.minimum_time_ms = as_int(ramp->minimum);
    all.maximum_time_ms = std::min(all.maximum_time_ms, as_int(ramp->maximum));
    all.minimum_homing_time_ms = all.minimum_time_ms;
  }
  all.maximum_homing_rpm = all.maximum_search_rpm = all.maximum_rpm;
  all.closed_loop = conventions.closed_loop;
  all.position_source = conventions.closed_loop ? PositionSource::encoder : PositionSource::commanded;
  return all;
}

}  // namespace

Conventions conventions_of(const std::map<std::string, SettingValue>& settings) {
  return {.velocity_in_rpm = text_setting(settings, "velocity_unit") == "rpm",
          .ramps_are_times = text_setting(settings, "ramps") == "time",
          .closed_loop = text_setting(settings, "loop_mode") != "open"};
}

std::vector<std::string> check_eds(const Eds& eds) {
  std::vector<std::string> found;
  constexpr unsigned position_bit = 0, velocity_bit = 2;
  for (const auto& [bit, name] : {std::pair(position_bit, "position"), std::pair(velocity_bit, "velocity")})
    if (!supports(eds, bit))
      found.push_back(
          fmt::format("by object {} the drive has no profile {} mode", to_string(drive_modes), name));
  for (const auto& [object, name, written] : needed) {
    const auto* entry = eds.find(object);
    if (entry == nullptr)
      found.push_back(fmt::format("object {} ({}) is missing", to_string(object), name));
    else if (const auto [kind, bits] = canopen::info(entry->type);
             (kind != canopen::TypeInfo::Kind::integer && kind != canopen::TypeInfo::Kind::natural) ||
             (bits != 8 && bits != 16 && bits != 32))
      found.push_back(
          fmt::format("object {} ({}) is no whole number of 8, 16 or 32 bits", to_string(object), name));
    else if (written ? !canopen::writable(entry->access) : !canopen::readable(entry->access))
      found.push_back(
          fmt::format("object {} ({}) cannot be {}", to_string(object), name, written ? "written" : "read"));
  }
  return found;
}

EdsDrive::EdsDrive(const DriveDescriptor& base, const Eds& eds, const Conventions& conventions)
    : DriveDescriptor(base), catalogue_(catalogue_of(eds)), homing_codes_(homing_codes_of(eds)) {
  parameters = catalogue_.rows;
  capabilities = capabilities_of(base.capabilities, parameters, conventions);
  capabilities.homing = !homing_codes_.empty();
  capabilities.homing_ramp = eds.find(cia402::object::homing_acceleration) != nullptr;
  const bool has_inputs = eds.find(inputs_value) != nullptr;
  if (!has_inputs) inputs = {};
  specialise = nullptr;
  model_.descriptor = this;
  model_.identity.vendor = identity_of(eds, identity_vendor, eds.vendor);
  model_.identity.product = identity_of(eds, identity_product, eds.product);
  model_.homing_codes = homing_codes_;
  model_.objects.velocity = velocity_value;
  if (has_inputs) model_.objects.inputs = inputs_value;
  if (eds.find(position_window) != nullptr) model_.objects.position_window = position_window;
  const auto* commanded = eds.find(commanded_position);
  if (conventions.closed_loop && commanded != nullptr && commanded->mappable)
    model_.objects.commanded_position = commanded_position;
  // CiA 301 7.5.2.13, 7.5.2.14: "save" and "load".
  constexpr std::int64_t save = 0x65766173, load = 0x64616F6C;
  if (eds.find(store_all) != nullptr) model_.objects.save = cia402::MemoryCommand{store_all, save};
  if (eds.find(restore_all) != nullptr) model_.objects.restore = cia402::MemoryCommand{restore_all, load};
  model_.meaning.ramps_are_times = conventions.ramps_are_times;
  model_.meaning.velocity_in_rpm = conventions.velocity_in_rpm;
  can_transactions = cia402::transactions_of(model_, 0);  // it has nothing that could drift
}

Result<std::shared_ptr<const DriveDescriptor>> specialise(
    const DriveDescriptor& base, const std::map<std::string, SettingValue>& settings) {
  const std::string path(text_setting(settings, "eds"));
  if (path.empty())
    return fail(Reason::invalid_argument, "no EDS is named",
                "add drive: { eds: FILE }, the data sheet of the drive");
  const auto eds = canopen::load_eds(path);
  if (!eds) return fail(eds.error());
  std::string message;
  for (const auto& problem : check_eds(*eds))
    message += fmt::format("{}{}: {}", message.empty() ? "" : "\n", path, problem);
  if (!message.empty())
    return fail(Reason::invalid_argument, std::move(message),
                "model cia402 needs a drive with profile position and profile velocity mode");
  return std::make_shared<const EdsDrive>(base, *eds, conventions_of(settings));
}

}  // namespace axisd::cia402_eds
