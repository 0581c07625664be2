#include "devices/ykd2405pr/parameters.hpp"

#include <gtest/gtest.h>

#include <set>

#include "devices/yako_rtu/registers.hpp"
#include "tests/unit/devices/yako_rtu/catalogue.hpp"

namespace axisd::ykd2405pr {

namespace reg = yako_rtu::reg;
using yako_rtu::RegisterGroup;
namespace {

const ParameterSpec* find(std::uint32_t address) { return find_parameter(parameters(), address); }

TEST(Ykd2405prParameters, AreThe148RegistersOfTheManualWithItsHoles) {
  const RegisterGroup groups[] = {{0x00, 0x0C}, {0x10, 0x18}, {0x20, 0x2C}, {0x30, 0x36},
                                  {0x40, 0x4F}, {0x90, 0xCF}, {0xE0, 0xEF}, {0x110, 0x119}};
  EXPECT_EQ(148U, parameters().size());
  yako_rtu::expect_groups(parameters(), groups);
  EXPECT_EQ(reg::last, parameters().back().address);
}

TEST(Ykd2405prParameters, HaveUniqueNamesAndADescription) { yako_rtu::expect_names_and_texts(parameters()); }

TEST(Ykd2405prParameters, PointFromEveryTriggerToTheRpcThatDoesIt) {
  yako_rtu::expect_triggers(parameters());
  EXPECT_EQ("AxisService.Stop", find(reg::stop)->instead);
  EXPECT_EQ("AxisService.Home", find(reg::homing_start)->instead);
}

TEST(Ykd2405prParameters, CorrectTheMisprintsOfTheManual) {
  EXPECT_EQ(0x0100, find(reg::version)->default_value);
  EXPECT_EQ(65535, find(reg::pulses_low)->maximum) << "the manual's own example: 0x86A0";
}

TEST(Ykd2405prParameters, HaveDefaultsWithinTheirRangeExceptTheSegmentTimes) {
  const RegisterGroup not_printed[] = {{0x110, 0x115}};
  yako_rtu::expect_defaults(parameters(), not_printed);
  // Printed so: 0 by default, 30..2000 in range.
  std::set<std::uint32_t> segment_times;
  for (std::uint32_t i = 0; i < 16; ++i) segment_times.insert(reg::segment_time + i);
  EXPECT_EQ(segment_times, yako_rtu::defaults_out_of_range(parameters()));
}

TEST(Ykd2405prParameters, NameTheSegmentsFrom1To16) {
  EXPECT_EQ("segment_1_pulses_high", find(reg::segment_pulses_high)->name);
  EXPECT_EQ("segment_16_pulses_low", find(reg::segment_pulses_low + 15)->name);
  EXPECT_EQ("PT segment 10: speed", find(reg::segment_speed + 9)->description);
  EXPECT_EQ("PT and PV segment 9: acceleration and deceleration time; its default 0 cannot be written back",
            find(reg::segment_time + 8)->description);
  EXPECT_EQ("segment_16_pv_speed", find(reg::segment_pv_speed + 15)->name);
}

TEST(Ykd2405prParameters, HaveWhatOnlyTheOpenLoopModelHas) {
  EXPECT_EQ("current", find(0x10)->name);
  EXPECT_EQ("lock_current", find(0x12)->name);
  EXPECT_EQ(Access::rw_saved, find(0x17)->access);
  EXPECT_EQ("control_mode", find(0x18)->name);
  EXPECT_EQ(2, find(reg::stop)->maximum) << "printed so; only bit 0 has a meaning";
  EXPECT_EQ("input_function_pu", find(0x41)->name);
  EXPECT_EQ("output_function_y3", find(0x4F)->name);
}

}  // namespace
}  // namespace axisd::ykd2405pr
