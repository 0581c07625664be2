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

/// What the configuration must have for a switch to matter.
struct Need {
  std::string_view name, drive_keys, homing_keys;
};
constexpr Need needs[] = {
    {"free_stop_releases", "overtravel_stop: free", ""},
    {"zero_before_compensation", "", "offset: 2 mm"},
    {"offset_without_move", "", "offset: 2 mm"},
};

ModelRigOptions flipped(const std::string& model, const simulation::SwitchSpec& one) {
  ModelRigOptions options{.model = model};
  if (const auto* found = std::ranges::find(needs, one.name, &Need::name); found != std::end(needs)) {
    options.drive_keys = found->drive_keys;
    options.homing_keys = found->homing_keys;
  }
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
  for (auto i = part; i < switches.size(); i += parts) {
    const auto& one = switches[i];
    SCOPED_TRACE(std::string(one.name) + (one.default_value ? " off" : " on"));
    const auto options = flipped(model, one);
    travel(options);
    SCOPED_TRACE("inverted");
    travel(inverted(options));
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
