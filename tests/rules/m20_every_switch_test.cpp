// M19, M20: whatever a drive does where its manual leaves it open, no axis believes in a position at which
// the load is not, and each relative move that is Done went as far as was asked. The list of open points is
// that of the simulators: a new one is among the cases by being there.
#include <fmt/format.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <iterator>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "tests/rules/trust_journey.hpp"

namespace axisd::test {
namespace {

std::span<const simulation::SwitchSpec> switches_of(std::string_view model) {
  return simulation::find_simulator(model)->switches;
}

bool on_serial_line(std::string_view model) { return simulation::find_simulator(model)->make != nullptr; }

/// Switches of the drives on RS-485 that nothing in the journey depends on, each with its reason. One that
/// shows after all does not belong here.
struct Silent {
  std::string_view name, reason;
  bool closed_loop_only = false;  ///< it shows on the model without an encoder
};
constexpr Silent silent[] = {
    {"bad_register_skipped", "no block has a bad value"},
    {"commands_readable", "no command register is read"},
    {"configuration_makes_edges", "no terminal starts motion"},
    {"crc_error_answered", "all frames arrive whole"},
    {"function_error_code_1", "no unknown function is sent"},
    {"homing_accepts_active_switch", "an axis on the switch backs off before it homes"},
    {"homing_never_gives_up", "no homing meets both limits"},
    {"inputs_undefined_at_power_up", "the functions are compared and written after each power-up"},
    {"limit_block_writes", "no block has more than 16 registers"},
    {"one_frame_start", "block and trigger go apart"},
    {"one_frame_start_refused", "block and trigger go apart"},
    {"partial_block_write", "no block has a bad value"},
    {"position_clear_in_motion", "the counter is cleared on axes without end, and at rest"},
    {"position_clear_late", "the counter is cleared on axes without end"},
    {"pv_latched", "there are no segments"},
    {"pv_speeds_always_saved", "there are no segments"},
    {"stop_ignored_in_pt_pv", "there are no segments"},
    {"more_than_7_segments", "there are no segments"},
    {"reserved_start_moves", "no reserved start is sent"},
    {"reserved_start_refused", "no reserved start is sent"},
    {"speed_terminal_is_level", "no terminal starts motion"},
    {"start_in_motion", "it stops before it starts anew (M9)"},
    {"start_in_motion_from_target", "it stops before it starts anew (M9)"},
    {"start_in_motion_refused", "it stops before it starts anew (M9)"},
    {"start_refused_when_disabled", "nothing is started while it is released"},
    {"stop_terminal_only_edge", "there is no stop terminal"},
    {"stop_uses_new_deceleration", "the deceleration stays what it was at the start"},
    {"undefined_address_is_1", "its address is a defined one"},
    {"abrupt_stop_slips", "it slips in open loop only", true},
    {"homing_mode_1_either_edge", "it comes to rest beyond the switch, and passes it on its way back"},
    {"homing_same_edge", "its last approach is always forward", true},
    {"loop_mode_from_power_up", "the loop is closed from the beginning"},
    {"overtravel_stop_saved", "it is compared and written after each power-up"},
};

bool is_silent(std::string_view model, std::string_view name) {
  const auto* found = std::ranges::find(silent, name, &Silent::name);
  return found != std::end(silent) && (!found->closed_loop_only || model != "ykd2405pr");
}

/// What the configuration must have for a switch to matter.
struct Need {
  std::string_view name, drive_keys, homing_keys;
};
constexpr Need needs[] = {
    {"free_stop_releases", "overtravel_stop: free", ""},
    {"zero_before_compensation", "", "offset: 2 mm"},
    {"offset_without_move", "", "offset: 2 mm"},
};

bool has_needs(const simulation::SwitchSpec& one) {
  return std::ranges::find(needs, one.name, &Need::name) != std::end(needs);
}

ModelRigOptions usual(const std::string& model, const simulation::SwitchSpec& one) {
  ModelRigOptions options{.model = model};
  if (!has_needs(one)) return options;
  const auto* found = std::ranges::find(needs, one.name, &Need::name);
  options.drive_keys = found->drive_keys;
  options.homing_keys = found->homing_keys;
  return options;
}

ModelRigOptions flipped(const std::string& model, const simulation::SwitchSpec& one) {
  auto options = usual(model, one);
  options.switches[std::string(one.name)] = !one.default_value;
  // A drive that takes neither list of homing methods cannot be.
  if (one.name == "homing_codes_cia") options.switches["homing_codes_0_to_3"] = true;
  return options;
}

ModelRigOptions inverted(ModelRigOptions options) {
  options.invert = true;
  return options;
}

/// Every switch of a model, in parts that ctest runs side by side.
struct Part {
  std::string model;
  std::size_t part = 0;
};
constexpr std::size_t parts = 12;

void PrintTo(const Part& one, std::ostream* out) { *out << one.model << ' ' << one.part + 1; }

class EverySwitch : public ::testing::TestWithParam<Part> {};

TEST_P(EverySwitch, InBothPositions) {
  const auto& [model, part] = GetParam();
  const auto switches = switches_of(model);
  const auto by_default = travel({.model = model});
  for (auto i = part; i < switches.size(); i += parts) {
    const auto& one = switches[i];
    SCOPED_TRACE(std::string(one.name) + (one.default_value ? " off" : " on"));
    const auto options = flipped(model, one);
    const bool shows = travel(options) != (has_needs(one) ? travel(usual(model, one)) : by_default);
    if (on_serial_line(model) && is_silent(model, one.name)) {
      EXPECT_FALSE(shows) << "it shows in the journey: take it off the list of silent ones";
    } else if (on_serial_line(model)) {
      EXPECT_TRUE(shows)
          << "the journey does not depend on it: extend it, or say in the list why it does not";
    }
    SCOPED_TRACE("inverted");
    travel(inverted(options));
  }
}

/// Names that no model has would hide what they were meant for.
TEST(M20, EverySilentSwitchIsOneOfAModel) {
  for (const auto& one : silent) {
    const bool known = std::ranges::any_of(simulated_models(), [&](const auto& model) {
      const auto switches = switches_of(model);
      return std::ranges::find(switches, one.name, &simulation::SwitchSpec::name) != switches.end();
    });
    EXPECT_TRUE(known) << one.name;
    EXPECT_FALSE(one.reason.empty()) << one.name;
  }
}

std::vector<Part> all_parts() {
  std::vector<Part> all;
  for (const auto& model : simulated_models())
    for (std::size_t part = 0; part < std::min(parts, switches_of(model).size()); ++part)
      all.push_back({model, part});
  return all;
}

INSTANTIATE_TEST_SUITE_P(M20Each, EverySwitch, ::testing::ValuesIn(all_parts()), [](const auto& info) {
  auto name = fmt::format("{}_{}", info.param.model, info.param.part + 1);
  std::ranges::replace(name, '-', '_');
  return name;
});

class TrustOfEveryModel : public ::testing::TestWithParam<std::string> {};

TEST_P(TrustOfEveryModel, IsNeverBetterThanTheTruth) {
  const ModelRigOptions options{.model = GetParam()};
  travel(options);
  SCOPED_TRACE("inverted");
  travel(inverted(options));
}

/// Whose position is known to follow a shaft that is turned while it is released.
TEST_P(TrustOfEveryModel, OutlivesAReleaseWhereItIsCounted) {
  const auto switches = switches_of(GetParam());
  if (std::ranges::find(switches, "released_position_frozen", &simulation::SwitchSpec::name) ==
      switches.end())
    GTEST_SKIP() << "its position is counted in pulses, or always measured";
  const ModelRigOptions options{.model = GetParam(), .drive_keys = "released_position: counted"};
  travel(options);
  SCOPED_TRACE("inverted");
  travel(inverted(options));
}

INSTANTIATE_TEST_SUITE_P(M20, TrustOfEveryModel, ::testing::ValuesIn(simulated_models()),
                         [](const auto& info) {
                           auto name = info.param;
                           std::ranges::replace(name, '-', '_');
                           return name;
                         });

}  // namespace
}  // namespace axisd::test
