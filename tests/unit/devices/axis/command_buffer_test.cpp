#include "devices/axis/command_buffer.hpp"

#include <gtest/gtest.h>

#include <vector>

#include "tests/support/virtual_world.hpp"

namespace axisd {
namespace {

using State = CommandBuffer::State;

class CommandBufferTest : public testing::Test {
 protected:
  CommandPtr push() {
    const auto command = std::make_shared<CommandRecord>(Command{}, world_.clock());
    buffer_.push({.command = command,
                  .action = MoveAbsoluteRequest{},
                  .options = {},
                  .end = PositionTracker(Scale({.pulses_per_revolution = 1000}))});
    return command;
  }
  static std::vector<CommandPtr> commands(const std::deque<Buffered>& buffered) {
    std::vector<CommandPtr> commands;
    for (const auto& each : buffered) commands.push_back(each.command);
    return commands;
  }

  test::VirtualWorld world_;
  CommandBuffer buffer_;
};

TEST_F(CommandBufferTest, CommandsStartInTheirOrder) {
  EXPECT_EQ(buffer_.state(), State::empty);
  const auto first = push(), second = push();
  EXPECT_EQ(buffer_.state(), State::waiting);
  EXPECT_EQ(buffer_.last().command, second);
  EXPECT_EQ(buffer_.take_next().command, first);
  EXPECT_EQ(buffer_.state(), State::starting);
  EXPECT_EQ(buffer_.take_starting(), first);
  EXPECT_EQ(buffer_.state(), State::waiting);
  EXPECT_EQ(buffer_.take_next().command, second);
  buffer_.end_start();
  EXPECT_EQ(buffer_.state(), State::empty);
  EXPECT_EQ(buffer_.take_starting(), nullptr);
}

TEST_F(CommandBufferTest, ItHoldsSoMany) {
  for (std::size_t i = 0; i < CommandBuffer::most; ++i) {
    EXPECT_FALSE(buffer_.full());
    push();
  }
  EXPECT_TRUE(buffer_.full());
}

TEST_F(CommandBufferTest, AllLeaveTogether) {
  const auto first = push(), second = push();
  EXPECT_EQ(commands(buffer_.take_all()), (std::vector{first, second}));
  EXPECT_EQ(buffer_.state(), State::empty);
}

TEST_F(CommandBufferTest, WhoeverIsCutOutTakesThoseBehindAlong) {
  const auto first = push(), second = push(), third = push();
  EXPECT_EQ(commands(buffer_.cut(second)), (std::vector{second, third}));
  EXPECT_EQ(buffer_.size(), 1U);
  EXPECT_TRUE(buffer_.cut(second).empty()) << "it waits no longer";
  EXPECT_EQ(commands(buffer_.cut(first)), (std::vector{first}));
  EXPECT_EQ(buffer_.state(), State::empty);
}

}  // namespace
}  // namespace axisd
