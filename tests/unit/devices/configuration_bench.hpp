// The configuration of a drive with two inputs, over a memory without a drive.
#pragma once

#include <gtest/gtest.h>

#include <cstdint>
#include <memory>
#include <optional>
#include <utility>
#include <vector>

#include "tests/unit/devices/fake_memory.hpp"

namespace axisd {

inline constexpr std::uint32_t microstep = 0x11, saving_switch = 0x16, overtravel = 0x17, levels = 0x40,
                               x0 = 0x41, x1 = 0x42, output_levels = 0x4B, row_speed = 0xB0;
inline constexpr std::int64_t no_function = 0, home = 1, jog = 12;

inline constexpr TerminalFunctionSpec functions[] = {
    {"none", no_function, {}}, {"home", home, {}}, {"jog_positive", jog, {}, true}};
inline constexpr ParameterSpec parameters[] = {
    {microstep, "microstep", Access::rw_saved, 0, 15, {}, "", ""},
    {saving_switch, "eeprom_update", Access::rw_saved, 0, 1, {}, "", ""},
    {overtravel, "overtravel_stop", Access::rw, 0, 2, {}, "", ""},
    {levels, "input_levels", Access::rw_saved, 0, 65535, {}, "", ""},
    {x0, "input_function_x0", Access::rw_saved, 0, 20, {}, "", ""},
    {x1, "input_function_x1", Access::rw_saved, 0, 20, {}, "", ""},
    {output_levels, "output_levels", Access::rw_saved, 0, 65535, {}, "", ""},
    {row_speed, "segment_1_speed", Access::rw_saved, 0, 3000, {}, "", ""},
};

inline MemoryTraits traits() {
  return {.saving_switch = saving_switch,
          .input_levels = levels,
          .input_functions = functions,
          .parameters = parameters,
          .longest_run = 16,
          .write_attempts = 3};
}

inline DriveSetting microstep_of(std::int64_t code, bool saved = false) {
  return {.address = microstep, .value = code, .key = "scale.microstep", .saved = saved};
}
inline DriveSetting levels_of(std::int64_t bits) {
  return {.address = levels, .value = bits, .key = "inputs"};
}
inline DriveSetting input_of(std::uint32_t address, std::int64_t function) {
  return {.address = address,
          .value = function,
          .key = address == x0 ? "inputs.X0" : "inputs.X1",
          .starts_motion = function == jog,
          .input_bits = 1U << (address - x0)};
}

inline Error no_reply() {
  return {.reason = Reason::no_reply, .message = "no reply", .outcome = Outcome::unknown};
}
inline Error refused() { return {.reason = Reason::refused, .message = "no", .outcome = Outcome::refused}; }

/// A drive that does not save, whose inputs have no function.
class DriveConfigurationSteps : public testing::Test {
 protected:
  DriveConfigurationSteps() { let(traits()); }
  /// Another drive.
  void let(MemoryTraits traits, Result<std::vector<DriveSetting>> required = {}) {
    auto memory = std::make_unique<FakeMemory>();
    memory->values = {{microstep, 8}, {saving_switch, 1},     {overtravel, 0}, {levels, 0}, {x0, 0},
                      {x1, 0},        {output_levels, 0b101}, {row_speed, 0}};
    memory_ = memory.get();
    configuration_.emplace(std::move(memory), traits, std::move(required));
  }
  Result<void> bring_to(std::vector<DriveSetting> required) {
    return run(configuration_->bring_to(std::move(required)));
  }

  FakeMemory* memory_ = nullptr;
  std::optional<DriveConfiguration> configuration_;
};

}  // namespace axisd
