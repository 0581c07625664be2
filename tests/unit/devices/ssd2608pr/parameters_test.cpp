#include "devices/ssd2608pr/parameters.hpp"

#include <gtest/gtest.h>

#include "tests/unit/devices/yako_rtu/catalogue.hpp"

namespace axisd::ssd2608pr {

using yako_rtu::RegisterGroup;
namespace {

const ParameterSpec* find(std::uint32_t address) { return find_parameter(parameters(), address); }

TEST(Ssd2608prParameters, AreThe173RegistersOfTheManualWithItsHoles) {
  const RegisterGroup groups[] = {{0x00, 0x0C}, {0x10, 0x17}, {0x20, 0x2C}, {0x30, 0x36},  {0x40, 0x45},
                                  {0x4B, 0x4E}, {0x90, 0xCF}, {0xE0, 0xEF}, {0x110, 0x139}};
  EXPECT_EQ(173U, parameters().size());
  yako_rtu::expect_groups(parameters(), groups);
}

TEST(Ssd2608prParameters, HaveUniqueNamesAndADescription) { yako_rtu::expect_names_and_texts(parameters()); }

TEST(Ssd2608prParameters, PointFromEveryTriggerToTheRpcThatDoesIt) {
  yako_rtu::expect_triggers(parameters());
}

TEST(Ssd2608prParameters, HaveDefaultsWithinTheirRange) {
  yako_rtu::expect_defaults(parameters(), {});
  EXPECT_TRUE(yako_rtu::defaults_out_of_range(parameters()).empty());
  EXPECT_EQ(0, find(0xC0)->minimum) << "segment times are 0..2000 here";
}

TEST(Ssd2608prParameters, FollowTheTableOfTheManualNotTheExampleOf4_3) {
  EXPECT_EQ("input_function_x0", find(0x41)->name);
  EXPECT_EQ("input_function_x2", find(0x43)->name);
  EXPECT_EQ("input_function_x4", find(0x45)->name);
  EXPECT_EQ("output_function_y2", find(0x4E)->name);
}

TEST(Ssd2608prParameters, HaveWhatTheClosedLoopModelsHave) {
  EXPECT_EQ(0x0305, find(0x00)->default_value);
  EXPECT_EQ("pulse_polarity", find(0x10)->name);
  EXPECT_EQ("loop_mode", find(0x12)->name);
  EXPECT_EQ(Access::rw, find(0x17)->access) << "printed without /S";
  EXPECT_EQ(1, find(0x28)->maximum);
}

TEST(Ssd2608prParameters, HaveThePerformanceGroupOfTheManual) {
  struct Row {
    std::uint32_t address;
    std::int32_t minimum, maximum, default_value;
  };
  // Those whose printed range differs from 0..65535, and one of each repeated block.
  const Row printed[] = {
      {0x110, 0, 1, 0},       {0x112, 0, 150, 100},    {0x113, 0, 100, 50},     {0x114, 0, 100, 40},
      {0x115, 100, 500, 100}, {0x116, 0, 20000, 4000}, {0x117, 1, 4000, 10},    {0x118, 0, 1024, 5},
      {0x119, 1, 256, 16},    {0x11B, 0, 200, 162},    {0x11C, 0, 30000, 8000}, {0x11D, 0, 1000, 48},
      {0x11E, 0, 1024, 358},  {0x11F, 1, 200, 10},     {0x120, 0, 1, 0},        {0x122, 1, 50, 16},
      {0x123, 1, 50, 10},     {0x132, 1, 50, 45},      {0x134, 0, 65535, 640},  {0x139, 0, 65535, 10}};
  for (const auto& row : printed) {
    const auto* one = find(row.address);
    ASSERT_NE(nullptr, one) << row.address;
    EXPECT_EQ(row.minimum, one->minimum) << one->name;
    EXPECT_EQ(row.maximum, one->maximum) << one->name;
    EXPECT_EQ(row.default_value, one->default_value) << one->name;
    EXPECT_EQ(Access::rw_saved, one->access) << one->name;
  }
}

}  // namespace
}  // namespace axisd::ssd2608pr
