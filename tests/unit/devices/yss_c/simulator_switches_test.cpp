// Every switch of the simulator in both positions: what it decides can be seen from outside.
#include <gmock/gmock.h>

#include <algorithm>
#include <stdexcept>

#include "tests/unit/devices/yss_c/simulator_switch_readings.hpp"

namespace axisd::yss_c {
namespace {

std::vector<Reading> all_readings() {
  std::vector<Reading> all;
  for (const auto readings :
       {motion_readings(), homing_readings(), object_readings(), status_readings(), terminal_readings()})
    all.insert(all.end(), readings.begin(), readings.end());
  return all;
}

class YssCSwitch : public ::testing::TestWithParam<Reading> {};

TEST_P(YssCSwitch, DecidesWhatCanBeSeen) {
  const auto& reading = GetParam();
  for (const bool on : {false, true}) {
    SCOPED_TRACE(on ? "on" : "off");
    simulation::Switches switches{{reading.name, on}};
    // One of two readings that can both be taken: the other one off, or it shows nothing.
    if (std::string_view(reading.name) == "homing_codes_0_to_3") switches["homing_codes_cia"] = true;
    Bench bench(switches, reading.settings);
    EXPECT_EQ(on ? reading.on : reading.off, reading.probe(bench));
  }
}

INSTANTIATE_TEST_SUITE_P(Manual, YssCSwitch, ::testing::ValuesIn(all_readings()),
                         [](const auto& info) { return std::string(info.param.name); });

TEST(YssCSwitches, AreAllTestedAndHaveUniqueNames) {
  std::vector<std::string_view> tested, existing;
  for (const auto& one : all_readings()) tested.emplace_back(one.name);
  for (const auto& one : switch_specs()) existing.push_back(one.name);
  EXPECT_THAT(tested, ::testing::UnorderedElementsAreArray(existing));
  std::ranges::sort(existing);
  EXPECT_EQ(existing.end(), std::ranges::adjacent_find(existing));
}

TEST(YssCSwitches, RefuseUnknownNames) {
  EXPECT_THROW(behaviour_from({{"no_such_switch", true}}), std::invalid_argument);
}

}  // namespace
}  // namespace axisd::yss_c
