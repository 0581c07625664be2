#include "devices/yako_rtu/configuration.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <utility>

#include "devices/setup_codes.hpp"
#include "devices/yako_rtu/codec.hpp"
#include "devices/yako_rtu/registers.hpp"

namespace axisd::yako_rtu {

namespace {

constexpr std::int64_t word = 0xFFFF;

std::vector<DriveSetting> homing_registers(const HomingProfile& homing) {
  static constexpr std::string_view keys[] = {"method", "velocity", "search_velocity", "acceleration_time",
                                              "offset", "offset"};
  const auto block = encode(homing);
  std::vector<DriveSetting> all;
  for (std::uint32_t i = 0; i < block.size(); ++i)
    all.push_back(
        {.address = reg::homing_mode + i, .value = block.at(i), .key = fmt::format("homing.{}", keys[i])});
  return all;
}

/// Homing's block is compared before each homing, the performance group moves nothing.
bool is_watched(std::uint32_t address) {
  return address < reg::homing_start || (address >= reg::input_levels && address < reg::performance);
}

}  // namespace

std::uint16_t first_input_function(const Model& model, const DriveSetup& setup) {
  const auto found = setup.model_settings.find("terminal_registers");
  const auto* reading =
      found == setup.model_settings.end() ? nullptr : std::get_if<std::string>(&found->second);
  const bool wiring = reading != nullptr && *reading == "wiring" && model.first_input_function_of_wiring != 0;
  return wiring ? model.first_input_function_of_wiring : model.first_input_function;
}

std::uint32_t segment_enables(const Model& model, const DriveSetup& setup) {
  std::uint32_t bits = 0;
  for (const auto& input : setup.inputs)
    if (input.function == "pt_enable" || input.function == "pv_enable")
      bits |= terminal_bit(model.descriptor->inputs, input.terminal).value_or(1U << 31U);
  return bits;
}

std::vector<DriveSetting> segment_registers(const DriveSegments& segments, std::uint32_t enables,
                                            bool saved) {
  std::vector<DriveSetting> all;
  const auto add = [&](std::uint32_t address, std::int64_t value, const char* key) {
    all.push_back({.address = address,
                   .value = value & word,
                   .key = key,
                   .saved = saved,
                   .starts_motion = true,
                   .input_bits = enables});
  };
  const auto add_row = [&](std::uint32_t first, std::size_t row, std::int64_t value) {
    add(first + static_cast<std::uint32_t>(row), value, "segments");
  };
  add(reg::terminal_move_mode, segments.absolute ? 1 : 0, "segments.mode");
  // Also those that the inputs cannot select.
  auto rows = segments.rows;
  rows.resize(reg::segment_rows);
  for (std::size_t i = 0; i < rows.size(); ++i) add_row(reg::segment_pulses_high, i, rows.at(i).pulses >> 16);
  for (std::size_t i = 0; i < rows.size(); ++i) add_row(reg::segment_pulses_low, i, rows.at(i).pulses);
  for (std::size_t i = 0; i < rows.size(); ++i)
    // Printed 30..2000 with the default 0, which cannot be written back: rows without motion keep theirs.
    if (rows.at(i).velocity_rpm != 0 || rows.at(i).pv_velocity_rpm != 0)
      add_row(reg::segment_time, i, rows.at(i).acceleration_time / std::chrono::milliseconds(1));
  // Last, so that a row can be started only when all of it is there.
  for (std::size_t i = 0; i < rows.size(); ++i) add_row(reg::segment_speed, i, rows.at(i).velocity_rpm);
  for (std::size_t i = 0; i < rows.size(); ++i) add_row(reg::segment_pv_speed, i, rows.at(i).pv_velocity_rpm);
  return all;
}

std::vector<DriveSetting> silenced_segments(std::span<const DriveSetting> required,
                                            const SettingValues& present, std::uint32_t enables, bool saved) {
  const auto differs = [&](std::uint32_t address) {
    const auto found = std::ranges::find(required, address, &DriveSetting::address);
    return found != required.end() && !found->holds(present.at(address));
  };
  std::vector<DriveSetting> silenced;
  for (std::uint32_t row = 0; row < reg::segment_rows; ++row) {
    const bool changes = differs(reg::terminal_move_mode) || differs(reg::segment_pulses_high + row) ||
                         differs(reg::segment_pulses_low + row) || differs(reg::segment_time + row);
    for (const auto speed : {reg::segment_speed + row, reg::segment_pv_speed + row}) {
      const auto held = present.find(speed);
      if (!changes || held == present.end() || held->second == 0) continue;
      silenced.push_back({.address = speed,
                          .key = "segments",
                          .saved = saved,
                          .starts_motion = true,
                          .input_bits = enables});
    }
  }
  return silenced;
}

Result<std::vector<DriveSetting>> required_registers(const Model& model, const DriveSetup& setup) {
  const auto places = SettingPlaces{.input_levels = reg::input_levels,
                                    .first_input_function = first_input_function(model, setup),
                                    .output_levels = reg::output_levels,
                                    .first_output_function = reg::first_output_function,
                                    .microstep = reg::microstep,
                                    .microstep_codes = model.descriptor->identification.microstep_codes};
  auto all = required_settings(*model.descriptor, setup, places,
                               setup.homing ? homing_registers(*setup.homing) : std::vector<DriveSetting>());
  if (!all) return all;
  if (setup.segments)
    for (auto& row :
         segment_registers(*setup.segments, segment_enables(model, setup), setup.persist.segments))
      all->push_back(std::move(row));
  for (auto& setting : *all) {
    setting.value &= word;
    setting.watched = is_watched(setting.address);
  }
  return all;
}

}  // namespace axisd::yako_rtu
