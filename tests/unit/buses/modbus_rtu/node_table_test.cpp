#include "buses/modbus_rtu/node_table.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <memory>
#include <stdexcept>
#include <string>

namespace axisd::modbus_rtu {
namespace {

using testing::ElementsAre;
using testing::Pair;

TEST(NodeTable, FindsWhatIsThereAndNothingElse) {
  NodeTable<std::string> table;
  EXPECT_EQ(table.find(7), nullptr);
  EXPECT_THROW((void)table.at(7), std::out_of_range);
  table[7] = "seven";
  ASSERT_NE(table.find(7), nullptr);
  EXPECT_EQ(*table.find(7), "seven");
  EXPECT_EQ(table.at(7), "seven");
  EXPECT_EQ(table.find(6), nullptr);
  EXPECT_EQ(table.find(255), nullptr);
}

TEST(NodeTable, IsInTheOrderOfTheAddressesWhateverCameFirst) {
  NodeTable<std::string> table;
  for (const auto node : {9, 0, 247, 3}) table[static_cast<std::uint8_t>(node)] = std::to_string(node);
  table[3] += "!";
  EXPECT_THAT(table, ElementsAre(Pair(0, "0"), Pair(3, "3!"), Pair(9, "9"), Pair(247, "247")));
}

TEST(NodeTable, HoldsAllAddresses) {
  NodeTable<std::unique_ptr<int>> table;
  for (int node = 255; node >= 0; --node)
    table[static_cast<std::uint8_t>(node)] = std::make_unique<int>(node);
  EXPECT_EQ(table.size(), 256U);
  for (int node = 0; node <= 255; ++node) EXPECT_EQ(*table.at(static_cast<std::uint8_t>(node)), node);
}

TEST(NodeTable, ACopyIsItsOwn) {
  NodeTable<int> table;
  table[1] = 10;
  auto copy = table;
  copy[1] = 11;
  copy[0] = 1;
  EXPECT_THAT(table, ElementsAre(Pair(1, 10)));
  EXPECT_THAT(copy, ElementsAre(Pair(0, 1), Pair(1, 11)));
}

}  // namespace
}  // namespace axisd::modbus_rtu
