#include "devices/ess42_r/parameters.hpp"

#include <gtest/gtest.h>

#include "devices/ssd2608pr/parameters.hpp"
#include "tests/unit/devices/yako_rtu/catalogue.hpp"

namespace axisd::ess42_r {

using yako_rtu::RegisterGroup;
namespace {

const ParameterSpec* find(std::uint32_t address) { return find_parameter(parameters(), address); }

TEST(Ess42rParameters, AreThe171RegistersOfTheManualWithItsHoles) {
  const RegisterGroup groups[] = {{0x00, 0x0C}, {0x10, 0x17}, {0x20, 0x2C}, {0x30, 0x36}, {0x40, 0x40},
                                  {0x43, 0x46}, {0x4B, 0x4D}, {0x90, 0xCF}, {0xE0, 0xEF}, {0x110, 0x139}};
  EXPECT_EQ(171U, parameters().size());
  yako_rtu::expect_groups(parameters(), groups);
}

TEST(Ess42rParameters, HaveUniqueNamesAndADescription) { yako_rtu::expect_names_and_texts(parameters()); }

TEST(Ess42rParameters, PointFromEveryTriggerToTheRpcThatDoesIt) { yako_rtu::expect_triggers(parameters()); }

TEST(Ess42rParameters, HaveDefaultsWithinTheirRange) {
  yako_rtu::expect_defaults(parameters(), {});
  EXPECT_TRUE(yako_rtu::defaults_out_of_range(parameters()).empty());
}

TEST(Ess42rParameters, BeginTheInputsAt0x43) {
  EXPECT_EQ("input_function_x0", find(0x43)->name);
  EXPECT_EQ("input_function_x3", find(0x46)->name);
  EXPECT_EQ("output_function_y1", find(0x4D)->name);
  EXPECT_EQ("input_filter_x4", find(0x139)->name) << "printed, although there is no X4";
}

TEST(Ess42rParameters, HaveTheirOwnBitRateCodes) {
  EXPECT_EQ("0 115200, 1 38400, 2 19200, 3 9600 bit/s; from the next power-up", find(0x14)->description);
  EXPECT_EQ(0, find(0x14)->default_value);
  EXPECT_EQ(127, find(0x13)->maximum) << "range of the write; 1..32 take effect";
}

/// Same model code, same version: only these addresses tell the two closed-loop models apart.
TEST(Ess42rParameters, DifferFromTheSsd2608prInTheTerminalsOnly) {
  for (std::uint32_t address = 0; address <= 0x139; ++address) {
    const bool ours = find(address) != nullptr;
    const bool theirs = find_parameter(ssd2608pr::parameters(), address) != nullptr;
    const bool differs = address == 0x41 || address == 0x42 || address == 0x46 || address == 0x4E;
    EXPECT_EQ(differs, ours != theirs) << std::hex << address;
  }
}

}  // namespace
}  // namespace axisd::ess42_r
