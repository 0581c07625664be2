#include "devices/yako_rtu/register_blocks.hpp"

#include <gtest/gtest.h>

#include <algorithm>

namespace axisd::yako_rtu {
namespace {

using Blocks = std::vector<RegisterBlock>;

bool hole_at_five(std::uint32_t address) { return address != 5 && address < 100; }

TEST(RegisterBlocks, NeighboursAndShortGapsAreOneRead) {
  EXPECT_EQ(blocks_of({3, 1, 2}, hole_at_five), (Blocks{{1, 3}}));
  EXPECT_EQ(blocks_of({10, 20}, hole_at_five), (Blocks{{10, 11}}));
}

TEST(RegisterBlocks, NeverLongerThanSixteen) {
  EXPECT_EQ(blocks_of({10, 25}, hole_at_five), (Blocks{{10, 16}}));
  EXPECT_EQ(blocks_of({10, 26}, hole_at_five), (Blocks{{10, 1}, {26, 1}}));
}

TEST(RegisterBlocks, NeverAcrossAHole) {
  EXPECT_EQ(blocks_of({4, 6}, hole_at_five), (Blocks{{4, 1}, {6, 1}}));
  EXPECT_EQ(blocks_of({4, 5, 6}, hole_at_five), (Blocks{{4, 1}, {6, 1}})) << "holes are left out";
}

TEST(RegisterBlocks, DuplicatesAndNothing) {
  EXPECT_EQ(blocks_of({7, 7, 7}, hole_at_five), (Blocks{{7, 1}}));
  EXPECT_TRUE(blocks_of({}, hole_at_five).empty());
}

TEST(RegisterBlocks, TheWholeCatalogueOfEachModelAvoidsItsHoles) {
  for (const char* name : {"ykd2405pr", "ssd2608pr", "ess42-r"}) {
    const auto catalogue = find_drive_model(name)->parameters;
    const auto readable = [&](std::uint32_t address) {
      const auto* parameter = find_parameter(catalogue, address);
      return parameter != nullptr && parameter->access != Access::wo;
    };
    std::vector<std::uint16_t> all;
    for (const auto& parameter : catalogue) all.push_back(static_cast<std::uint16_t>(parameter.address));
    std::size_t covered = 0;
    for (const auto& block : blocks_of(all, readable)) {
      EXPECT_LE(block.count, 16);
      for (unsigned i = 0; i < block.count; ++i) EXPECT_TRUE(readable(block.address + i)) << name;
      covered += block.count;
    }
    EXPECT_EQ(covered, static_cast<std::size_t>(std::ranges::count_if(
                           catalogue, [](const auto& parameter) { return parameter.access != Access::wo; })));
  }
}

TEST(RegisterBlocks, WordsAsTheNumbersThatTheirRangeMeans) {
  const auto catalogue = find_drive_model("ykd2405pr")->parameters;
  EXPECT_EQ(number_of(*find_parameter(catalogue, 0x0023), 0xFFFF), -1);
  EXPECT_EQ(number_of(*find_parameter(catalogue, 0x0025), 0x86A0), 0x86A0) << "one half of 32 bits";
  EXPECT_EQ(number_of(*find_parameter(catalogue, 0x0040), 0xFFFF), 65535);
  EXPECT_EQ(find_parameter(catalogue, 0x0019), nullptr);
}

}  // namespace
}  // namespace axisd::yako_rtu
