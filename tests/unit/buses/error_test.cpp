#include "buses/error.hpp"

#include <gtest/gtest.h>

namespace axisd {
namespace {

Error refused_at(std::uint32_t object) {
  return {.reason = Reason::refused,
          .message = "the drive refused",
          .remedy = "check the value",
          .where = {.bus = "line-a", .node = 3, .object = object}};
}

TEST(Error, NamesARegisterAsTheModbusManualsDo) {
  EXPECT_EQ(to_string(refused_at(0x0027)),
            "line-a node 3 register 0x0027: the drive refused; check the value");
  EXPECT_EQ(object_text(0xFFFF), "register 0xFFFF");
}

TEST(Error, NamesAnObjectAsCanopenManualsDo) {
  EXPECT_EQ(to_string(refused_at(0x604100)),
            "line-a node 3 object 6041h:00: the drive refused; check the value");
  EXPECT_EQ(object_text(0x20300C), "object 2030h:0C");
}

TEST(Error, SaysItsReasonWhereThereIsNoText) {
  EXPECT_EQ(to_string(Error{.reason = Reason::no_reply}), "no_reply");
}

}  // namespace
}  // namespace axisd
