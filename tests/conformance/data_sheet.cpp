#include "tests/conformance/data_sheet.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <initializer_list>
#include <map>
#include <optional>
#include <stdexcept>
#include <string>
#include <utility>

#include "buses/canopen/eds.hpp"
#include "tests/conformance/scenario.hpp"
#include "tests/support/makers_files.hpp"

namespace axisd::conformance {

namespace {

/// Of every scenario: 100 mm/s at 10 mm/rev, reached within 0.1 s.
constexpr std::int64_t turns_per_second = 10, turns_per_second_squared = 100, usual_counts = 1000;
constexpr std::int64_t off = 0xFFFFFFFF;

using Skipped = std::map<std::string, std::string, std::less<>>;
using Changed = std::map<std::string, std::optional<std::string>>;

/// What the file says of its drive. Read here by CiA 402 and CiA 303-2, not as the driver does it.
class Sheet {
 public:
  explicit Sheet(const std::filesystem::path& file) {
    auto read = canopen::load_eds(file.string());
    if (!read) throw std::runtime_error(read.error().message);
    eds_ = std::move(*read);
  }

  [[nodiscard]] bool has(std::uint16_t index, std::uint8_t sub = 0) const {
    return eds_.find({index, sub}) != nullptr;
  }
  [[nodiscard]] bool can_write(std::uint16_t index, std::uint8_t sub = 0) const {
    const auto* object = eds_.find({index, sub});
    return object != nullptr && canopen::writable(object->access);
  }
  /// 0: it says nothing.
  [[nodiscard]] std::int64_t value(std::uint16_t index, std::uint8_t sub = 0) const {
    const auto* object = eds_.find({index, sub});
    return object != nullptr && object->known() ? object->known()->value : 0;
  }
  [[nodiscard]] bool says(std::uint16_t index) const {
    const auto* object = eds_.find({index, 0});
    return object != nullptr && object->known().has_value();
  }
  /// The largest that may be written.
  [[nodiscard]] std::int64_t most(std::uint16_t index) const {
    const auto* object = eds_.find({index, 0});
    return object != nullptr && object->high ? object->high->value : off;
  }

  [[nodiscard]] bool tells_velocities() const {
    constexpr std::int64_t rpm_dimension = 0xA4;
    return value(0x60A9) != 0 || (value(0x608C) & 0xFF) == rpm_dimension;
  }
  /// Velocities count r/min: it says so, or in counts the drive would be too slow for any use.
  [[nodiscard]] bool counts_rpm() const {
    if (tells_velocities()) return true;
    const auto limit = value(0x607F);
    const auto fastest = std::min({most(0x6081), most(0x60FF), limit == 0 ? off : limit});
    return fastest <= turns_per_second * counts() || most(0x6083) < turns_per_second_squared * counts();
  }
  [[nodiscard]] std::int64_t counts() const {
    constexpr std::int64_t degree = 0x41, in_a_turn = 360;
    if (const auto unit = value(0x60A8); (unit >> 16 & 0xFF) == degree)
      return std::llround(in_a_turn * std::pow(10.0, -static_cast<std::int8_t>(unit >> 24 & 0xFF)));
    const auto increments = value(0x608F, 1), turns = value(0x608F, 2);
    return increments > turns && turns > 0 ? increments / turns : usual_counts;
  }
  [[nodiscard]] bool runs_at_velocities() const {
    constexpr std::int64_t velocity_mode = 0x04;
    const auto modes = value(0x6502);
    return can_write(0x60FF) && (modes == 0 || (modes & velocity_mode) != 0);
  }
  [[nodiscard]] bool homes() const {
    constexpr std::int64_t homing_mode = 0x20;
    const auto modes = value(0x6502);
    return can_write(0x6098) && can_write(0x6099, 1) && can_write(0x6099, 2) &&
           (modes == 0 || (modes & homing_mode) != 0);
  }

 private:
  canopen::Eds eds_;
};

void skip(Skipped& skipped, std::initializer_list<const char*> scenarios, const std::string& why) {
  for (const auto* scenario : scenarios) skipped.emplace(scenario, why);
}

/// 1000h of a drive that follows another profile, or none: axisd refuses such a node at bring-up.
void skip_other_profiles(const Sheet& sheet, Skipped& skipped) {
  constexpr std::int64_t drives = 402, profile_of = 0xFFFF;
  const auto profile = sheet.value(0x1000) & profile_of;
  if (!sheet.says(0x1000) || profile == drives) return;
  for (const auto& subject : subjects())
    for (const auto& scenario : subject.scenarios)
      skipped.emplace(scenario.name, fmt::format("by its 1000h it follows profile {}, not 402", profile));
}

Skipped skipped_by(const Sheet& sheet) {
  Skipped skipped;
  skip_other_profiles(sheet, skipped);
  skip(skipped, {"every_parameter", "writing", "refusals", "save_and_restore", "description"},
       "its parameters are those of the file, which nobody has transcribed");
  skip(skipped, {"wrong_model", "one_address_twice", "scan", "other_nodes", "full_bus"},
       "what a network has of several drives does not depend on the file");
  skip(skipped, {"thousand_moves"}, "CiA 301 drives save on command: it does not depend on the file");
  if (!sheet.has(0x60FD))
    skip(skipped,
         {"run_into_limits", "limits_at_standstill", "levels_and_edges", "conflicts", "on_the_switch",
          "released_by_terminal", "stop_terminals", "outputs", "drift", "stopped_from_outside", "positions",
          "velocities"},
         "no 60FDh: the drive shows no inputs");
  if (!sheet.homes())
    skip(skipped,
         {"all_methods", "without_limit_switches", "again_with_the_bit_left_over", "on_the_switch",
          "switch_never_found", "stop_while_homing", "power_cycle_at_rest", "restarts", "conflicts"},
         "no 6098h, 6099h or bit 5 of 6502h: the drive does not home");
  if (!sheet.runs_at_velocities())
    skip(skipped,
         {"velocity_moves", "velocity_to_the_software_limit", "jogging", "jogging_untrusted",
          "run_into_limits", "limits_at_standstill"},
         "no 60FFh, or no bit 2 of 6502h: the drive has no profile velocity mode");
  return skipped;
}

/// What is set with the drive's own tool before axisd has to do with it: axisd writes none of these objects.
std::string set_by_tool(const Sheet& sheet) {
  constexpr std::int64_t rpm = 60, window = 10;
  const auto counts = sheet.counts();
  std::string options;
  const auto set = [&](std::uint16_t index, std::int64_t value) {
    options += fmt::format(",eeprom.{}={}", std::uint32_t{index} << 8U, std::min(value, sheet.most(index)));
  };
  if (sheet.can_write(0x6085)) set(0x6085, turns_per_second_squared * (sheet.counts_rpm() ? rpm : counts));
  // Narrower than what an encoder lags behind in 20 ms.
  if (const auto following = sheet.value(0x6065); following > 0 && following < counts / 5)
    set(0x6065, 2 * counts);
  if (const auto target = sheet.value(0x6067); target > window && target != off) set(0x6067, window);
  return options;
}

}  // namespace

Manual manual_of_sheet(const std::filesystem::path& file) {
  const Sheet sheet(file);
  const Manual standard("cia402");
  const bool tells = sheet.tells_velocities(), rpm = sheet.counts_rpm();
  Changed changed{{"data_sheet", file.string()},
                  {"counts", std::to_string(sheet.counts())},
                  {"velocity_unit", tells ? ""
                                    : rpm ? "rpm"
                                          : "pulses_per_second"},
                  {"simulated", (rpm && !tells ? ",velocity_unit=rpm" : "") + set_by_tool(sheet)}};
  if (!sheet.has(0x60FD)) changed["inputs"] = "";
  if (!sheet.homes()) changed["homing_modes"] = "";
  if (!sheet.can_write(0x6084)) changed["one_ramp"] = "yes";
  if (!sheet.can_write(0x605D)) changed["one_halt"] = "yes";
  // One of each class: the codes are those of CiA 402, whatever the file says.
  constexpr int some[] = {0x2310, 0x3210, 0x8611};
  for (const auto& [code, rule] : standard.alarms())
    if (std::ranges::find(some, code) == std::end(some))
      changed[fmt::format("alarm.{}", code)] = std::nullopt;
  return standard.of_make(file.filename().string(), changed, skipped_by(sheet));
}

std::vector<std::filesystem::path> data_sheets() {
  std::vector<std::filesystem::path> all;
  for (const auto name : test::accepted_makers_files) all.push_back(test::makers_file(name));
  return all;
}

}  // namespace axisd::conformance
