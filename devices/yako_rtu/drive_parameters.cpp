// The catalogue by number, the segment table, the drive's memory, and its address.
#include <fmt/format.h>

#include <algorithm>
#include <utility>

#include "devices/yako_rtu/drive.hpp"
#include "devices/yako_rtu/register_blocks.hpp"
#include "devices/yako_rtu/registers.hpp"

namespace axisd::yako_rtu {

namespace {

/// The manuals give no figure for how long 150 registers take to be saved; the drive may be silent meanwhile.
constexpr auto eeprom_patience = std::chrono::seconds(3);
constexpr int canary_attempts = 3;
constexpr std::array<std::string_view, 4> formats = {"8N1", "8N2", "8E1", "8O1"};  // codes of 0x0015

TransactionOptions parameters() { return {.transaction_class = TransactionClass::parameters}; }
/// What a client wants to know, and no part of what is done to the drive.
TransactionOptions reading_of_client() {
  return {.transaction_class = TransactionClass::parameters, .of_others = true};
}
TransactionOptions eeprom() {
  auto options = parameters();
  options.turnaround_max = eeprom_patience;
  return options;
}

struct Owner {
  std::uint16_t address;
  std::string_view key;
};
/// Written with every motion, and what the canary is made of.
constexpr Owner motion_owners[] = {{reg::start_speed, "limits.start_speed"},
                                   {reg::acceleration_time, "limits.acceleration_time"},
                                   {reg::deceleration_time, "limits.deceleration_time"},
                                   {reg::maximum_speed, "limits.velocity"},
                                   {reg::pulses_high, "each motion command"},
                                   {reg::pulses_low, "each motion command"},
                                   {reg::eeprom_update, "persist"},
                                   {reg::custom_node, "DriveService.Readdress"},
                                   {reg::custom_baud, "DriveService.SetSerial"},
                                   {reg::serial_format, "DriveService.SetSerial"}};

}  // namespace

std::string YakoRtuDrive::configured_by(std::uint32_t address) const {
  if (auto key = configuration_.key_of(address); !key.empty()) return key;
  const auto owner = std::ranges::find(motion_owners, address, &Owner::address);
  return owner == std::end(motion_owners) ? std::string() : std::string(owner->key);
}

Task<Result<std::vector<ParameterValue>>> YakoRtuDrive::read_parameters(
    std::vector<std::uint32_t> addresses) {
  co_return co_await read_values(std::move(addresses), reading_of_client());
}

Task<Result<std::vector<ParameterValue>>> YakoRtuDrive::read_values(std::vector<std::uint32_t> addresses,
                                                                    TransactionOptions options) const {
  std::vector<std::uint16_t> wanted(addresses.begin(), addresses.end());
  const auto registers = co_await read_registers(std::move(wanted), std::move(options));
  if (!registers) co_return fail(registers.error());
  std::vector<ParameterValue> values;
  values.reserve(addresses.size());
  for (const auto address : addresses) {
    const auto* parameter = find_parameter(model_->descriptor->parameters, address);
    const auto word = registers->find(static_cast<std::uint16_t>(address));
    if (parameter == nullptr || word == registers->end())
      co_return fail(error_at(Reason::not_supported, static_cast<std::uint16_t>(address),
                              "the drive as it is configured has no such register",
                              "see drive.terminal_registers"));
    values.push_back({.address = address, .value = number_of(*parameter, word->second)});
  }
  co_return values;
}

Task<Result<std::vector<ParameterValue>>> YakoRtuDrive::write_parameters(std::vector<ParameterValue> values) {
  auto present = co_await configuration_.write_parameters(std::move(values));
  if (!present) co_return present;
  for (const auto& value : *present)
    note_register(static_cast<std::uint16_t>(value.address),
                  static_cast<std::uint16_t>(value.value & 0xFFFF));
  co_return present;
}

Task<Result<DriveSegments>> YakoRtuDrive::read_segments() {
  std::vector<std::uint16_t> addresses{reg::terminal_move_mode};
  for (const auto first : {reg::segment_pulses_high, reg::segment_pulses_low, reg::segment_speed,
                           reg::segment_time, reg::segment_pv_speed})
    for (std::uint16_t i = 0; i < reg::segment_rows; ++i)
      addresses.push_back(static_cast<std::uint16_t>(first + i));
  const auto registers = co_await read_registers(std::move(addresses), reading_of_client());
  if (!registers) co_return fail(registers.error());
  DriveSegments segments{.absolute = registers->at(reg::terminal_move_mode) == 1};
  segments.rows.resize(reg::segment_rows);
  for (std::uint16_t i = 0; i < reg::segment_rows; ++i) {
    const auto at = [&](std::uint16_t first) { return registers->at(static_cast<std::uint16_t>(first + i)); };
    segments.rows.at(i) = {
        .pulses = static_cast<std::int32_t>(std::uint32_t{at(reg::segment_pulses_high)} << 16U |
                                            at(reg::segment_pulses_low)),
        .velocity_rpm = at(reg::segment_speed),
        .acceleration_time = std::chrono::milliseconds(at(reg::segment_time)),
        .pv_velocity_rpm = at(reg::segment_pv_speed)};
  }
  co_return segments;
}

Task<Result<void>> YakoRtuDrive::write_segments(DriveSegments segments) {
  co_return co_await configuration_.bring_to(
      segment_registers(segments, segment_enables(*model_, setup_), setup_.persist.segments));
}

Task<Result<void>> YakoRtuDrive::save_parameters() {
  if (const auto permitted = permit_saves(1); !permitted) co_return permitted;
  // What is saved now stands there after the next power-up, when a terminal may start it: nothing that moves
  // (M27).
  MotionBlock neutral = fresh_neutral_block();
  neutral[3] = 0;
  neutral = distinct(neutral);
  if (auto written = co_await replace_canary(neutral); !written) {
    if (written.error().outcome == Outcome::unknown) written.error().outcome = Outcome::not_executed;
    co_return written;
  }
  const auto saved = co_await node_.write(reg::parameter_setting, 2, eeprom());
  const bool executed = saved || saved.error().outcome == Outcome::unknown;
  proven_at_.reset();
  if (executed) {
    count_save(static_cast<std::uint64_t>(
        std::ranges::count_if(model_->descriptor->parameters, [](const auto& parameter) {
          return parameter.access == Access::rw || parameter.access == Access::rw_saved;
        })));
    // Saved, this block would no longer tell a power-up (M7): whatever comes now, it is no proof any more.
    canary_.note_power_up(neutral);
  }
  if (saved) {
    const auto fresh = distinct(fresh_neutral_block());
    for (int attempt = 0; attempt < canary_attempts; ++attempt)
      if (co_await write_canary(fresh, parameters())) break;
    canary_.distrust(neutral);
  } else if (executed) {
    canary_.forget();  // since the request it may have been restarted, and come up with what it saved
  }
  if (!saved) co_return failed(saved.error());
  co_return co_await check_continuity(TransactionClass::parameters);
}

Task<Result<std::string>> YakoRtuDrive::restore_factory(std::vector<std::uint8_t> taken) {
  // The drive stays out of use until it is configured again, and what is kept there is saved once more.
  const auto saves = 1 + configuration_.saves_of_setup();
  if (const auto permitted = permit_saves(saves); !permitted) co_return fail(permitted.error());
  const auto before = co_await read_registers({reg::node, reg::custom_node}, parameters());
  if (!before) co_return fail(before.error());
  const auto node = before->at(reg::node);
  const bool custom = before->at(reg::custom_node) == node;
  if (custom && std::ranges::find(taken, model_->factory_custom_node) != taken.end())
    co_return fail(
        error_at(Reason::misconfigured, reg::custom_node,
                 fmt::format("after the next power-up the drive would answer at address {}, which "
                             "another axis of this bus has",
                             model_->factory_custom_node),
                 "set the drive's address switches first, or give the other drive another address"));
  const auto restored = co_await node_.write(reg::parameter_setting, 1, eeprom());
  if (restored || restored.error().outcome == Outcome::unknown) {
    count_save(static_cast<std::uint64_t>(
        std::ranges::count(model_->descriptor->parameters, Access::rw_saved, &ParameterSpec::access)));
    canary_.forget();  // whatever stands there now, it is not ours
    proven_at_.reset();
    terminal_move_mode_.reset();
    configuration_.forget_power_cycle();
  }
  if (!restored) co_return failed(restored.error());
  auto text = custom ? fmt::format("address {}", model_->factory_custom_node != 0
                                                     ? std::to_string(model_->factory_custom_node)
                                                     : "undefined (set the address switches first)")
                     : fmt::format("address {} by its switches", node);
  co_return text + ", format 8N1, baud by its switches" +
      (model_->custom_bauds.empty() ? "" : fmt::format(" or {}", model_->custom_bauds.front()));
}

Result<std::vector<ParameterValue>> YakoRtuDrive::serial_registers(const SerialChange& change) const {
  std::vector<ParameterValue> values;
  if (change.node) {
    if (*change.node < model_->minimum_custom_node || *change.node > model_->maximum_custom_node) {
      auto error = error_at(Reason::out_of_range, reg::custom_node,
                            fmt::format("address {} cannot be set by register", *change.node),
                            "use the address switches, or another address");
      error.permitted = Range{.minimum = static_cast<double>(model_->minimum_custom_node),
                              .maximum = static_cast<double>(model_->maximum_custom_node)};
      return fail(std::move(error));
    }
    values.push_back({.address = reg::custom_node, .value = *change.node});
  }
  if (change.baud) {
    const auto code = std::ranges::find(model_->custom_bauds, *change.baud);
    if (code == model_->custom_bauds.end())
      return fail(error_at(Reason::out_of_range, reg::custom_baud,
                           fmt::format("{} baud cannot be set by register", *change.baud),
                           fmt::format("possible: {}", fmt::join(model_->custom_bauds, ", "))));
    values.push_back({.address = reg::custom_baud, .value = code - model_->custom_bauds.begin()});
  }
  if (change.format) {
    const auto code = std::ranges::find(formats, to_string(*change.format));
    if (code == formats.end())
      return fail(error_at(Reason::out_of_range, reg::serial_format, "the drive has no such format",
                           "possible: 8N1, 8N2, 8E1, 8O1"));
    values.push_back({.address = reg::serial_format, .value = code - formats.begin()});
  }
  if (values.empty())
    return fail(error_at(Reason::invalid_argument, reg::custom_node, "nothing to change",
                         "name an address, a baud rate or a format"));
  return values;
}

std::string YakoRtuDrive::serial_advice(const SerialChange& change) const {
  std::string text = "it counts from the next power-up";
  if (change.node && model_->custom_node_switches[0] != '\0')
    text += fmt::format(", with {}", model_->custom_node_switches);
  if (change.baud && model_->custom_baud_switches[0] != '\0')
    text += fmt::format(", with {}", model_->custom_baud_switches);
  return text;
}

Task<Result<std::string>> YakoRtuDrive::change_serial(SerialChange change) {
  auto values = serial_registers(change);
  if (!values) co_return fail(values.error());
  const auto saved = co_await configuration_.write_saved(std::move(*values));
  if (!saved) co_return fail(saved.error());
  co_return serial_advice(change);
}

}  // namespace axisd::yako_rtu
