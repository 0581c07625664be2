#include "devices/ykd2405pr/parameters.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <set>
#include <string>

#include "devices/yako_rtu/registers.hpp"

namespace axisd::ykd2405pr {

namespace reg = yako_rtu::reg;
namespace {

const ParameterSpec* find(std::uint32_t address) {
  const auto all = parameters();
  const auto found = std::ranges::find(all, address, &ParameterSpec::address);
  return found == all.end() ? nullptr : &*found;
}

TEST(Parameters, AreThe148RegistersOfTheManualInOrder) {
  const auto all = parameters();
  ASSERT_EQ(148U, all.size());
  EXPECT_TRUE(std::ranges::is_sorted(all, std::ranges::less_equal{}, &ParameterSpec::address));
  EXPECT_EQ(reg::last, all.back().address);
}

TEST(Parameters, HaveUniqueAddressesNamesAndADescription) {
  std::set<std::uint32_t> addresses;
  std::set<std::string> names;
  for (const auto& one : parameters()) {
    EXPECT_TRUE(addresses.insert(one.address).second) << one.name;
    EXPECT_TRUE(names.insert(std::string(one.name)).second) << one.name;
    EXPECT_FALSE(one.description.empty()) << one.name;
    EXPECT_LT(one.minimum, one.maximum) << one.name;
  }
}

TEST(Parameters, LeaveTheManualsHolesOut) {
  // Groups of 6.1: 0x00-0x0C, 0x10-0x18, 0x20-0x2C, 0x30-0x36, 0x40-0x4F, 0x90-0xCF, 0xE0-0xEF, 0x110-0x119.
  for (const std::uint32_t hole : {0x0DU, 0x0FU, 0x19U, 0x1FU, 0x2DU, 0x2FU, 0x37U, 0x3FU, 0x50U, 0x8FU,
                                   0xD0U, 0xDFU, 0xF0U, 0x10FU, 0x11AU})
    EXPECT_EQ(nullptr, find(hole)) << std::hex << hole;
  for (const std::uint32_t edge : {0x00U, 0x0CU, 0x10U, 0x18U, 0x20U, 0x2CU, 0x30U, 0x36U, 0x40U, 0x4FU,
                                   0x90U, 0xCFU, 0xE0U, 0xEFU, 0x110U, 0x119U})
    EXPECT_NE(nullptr, find(edge)) << std::hex << edge;
}

TEST(Parameters, CorrectTheMisprintsOfTheManual) {
  for (const std::uint32_t command : {0x27U, 0x28U, 0x29U, 0x2AU, 0x2BU, 0x2CU, 0x30U})
    EXPECT_EQ(Access::wo, find(command)->access) << std::hex << command;
  EXPECT_EQ(0x0100, find(reg::version)->default_value);
  EXPECT_EQ("segment_1_pulses_high", find(0x90)->name);
  EXPECT_EQ("segment_16_pv_speed", find(0xEF)->name);
}

TEST(Parameters, PointFromEveryTriggerRegisterToTheRpcThatDoesIt) {
  for (const auto& one : parameters()) EXPECT_EQ(one.access == Access::wo, !one.instead.empty()) << one.name;
  EXPECT_EQ("AxisService.Stop", find(reg::stop)->instead);
  EXPECT_EQ("AxisService.Home", find(0x30)->instead);
}

TEST(Parameters, HaveDefaultsWithinTheirRangeExceptTheSegmentTimes) {
  for (const auto& one : parameters()) {
    const bool segment_time = one.address >= reg::segment_time && one.address < reg::segment_time + 16;
    if (!one.default_value || segment_time) continue;
    EXPECT_GE(*one.default_value, one.minimum) << one.name;
    EXPECT_LE(*one.default_value, one.maximum) << one.name;
  }
  // Printed so: 0 by default, 30..2000 in range.
  EXPECT_EQ(0, find(reg::segment_time)->default_value);
  EXPECT_EQ(30, find(reg::segment_time)->minimum);
}

}  // namespace
}  // namespace axisd::ykd2405pr
