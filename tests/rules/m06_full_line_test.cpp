// M6: each start is one uninterrupted chain on its node, also where all axes of a line start at once.
#include <fmt/format.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <vector>

#include "tests/rules/m22_group_rig.hpp"
#include "tests/rules/shared_line.hpp"
#include "tests/support/rig.hpp"

namespace axisd::test {
namespace {

using namespace std::chrono_literals;

constexpr std::uint16_t block = 0x0020, trigger = 0x0027;

/// Axes of one line that are moved to and fro, each as soon as its last move is done.
class Indexing {
 public:
  Indexing(int count, int baud) : line(count, baud), moves_(static_cast<std::size_t>(count)) {
    EXPECT_TRUE(line.world.run_until(
        [this] { return line.all([](const AxisSnapshot& axis) { return axis.link == LinkState::online; }); },
        60s));
    for (int i = 1; i <= count; ++i) end(line.submit(i, EnableRequest{}));
    for (int i = 1; i <= count; ++i) end(line.submit(i, SetPositionRequest{.position = 0}));
    line.line->forget_wire();
  }

  void run(Duration duration) {
    const auto until = line.world.now() + duration;
    while (line.world.now() < until) {
      for (std::size_t i = 0; i < moves_.size(); ++i) next(i);
      line.world.run_until([this] { return std::ranges::any_of(moves_, done); }, until - line.world.now());
    }
  }

  [[nodiscard]] int done_of(std::size_t axis) const { return moves_[axis].done; }
  [[nodiscard]] int all_done() const {
    int all = 0;
    for (const auto& axis : moves_) all += axis.done;
    return all;
  }

  SharedLine line;
  int refused = 0;
  std::vector<std::string> failures;
  Duration longest_wait{};

 private:
  struct Moves {
    CommandPtr command;
    int done = 0;
    bool away = false;
  };
  static bool done(const Moves& axis) { return axis.command && axis.command->has_ended(); }

  void end(const CommandPtr& command) {
    EXPECT_TRUE(line.world.run_until([&] { return command->has_ended(); }, 20s));
    EXPECT_EQ(command->value().state, CommandState::done) << describe(command->value());
  }

  void next(std::size_t i) {
    auto& axis = moves_[i];
    if (axis.command && !axis.command->has_ended()) return;
    if (axis.command) {
      const auto& ended = axis.command->value();
      if (ended.started_at)
        longest_wait = std::max<Duration>(longest_wait, *ended.started_at - ended.accepted_at);
      if (ended.state == CommandState::done)
        ++axis.done;
      else
        failures.push_back(describe(ended));
      axis.command.reset();
    }
    axis.away = !axis.away;
    const MoveAbsoluteRequest move{.position = axis.away ? 0.4 : 0.2, .with = {.acceleration_time = 20ms}};
    const auto command =
        line.machine().submit("a" + std::to_string(i + 1), move, {.arrived = line.world.now()});
    if (command) {
      axis.command = *command;
    } else {
      ++refused;
      axis.away = !axis.away;
    }
  }

  std::vector<Moves> moves_;
};

int exchanges(const Indexing& indexing, const std::function<bool(const WireEntry&)>& counts) {
  return static_cast<int>(std::ranges::count_if(indexing.line.line->wire(), counts));
}

struct Full {
  int axes, baud;
};

class FullLine : public ::testing::TestWithParam<Full> {};

TEST_P(FullLine, NoChainIsTriedTwiceAndNoCommandExpires) {
  const auto [axes, baud] = GetParam();
  Indexing indexing(axes, baud);
  indexing.run(20s);
  EXPECT_EQ(indexing.failures, std::vector<std::string>{});
  const auto triggers = exchanges(indexing, [](const WireEntry& one) { return one.address() == trigger; });
  const auto blocks =
      exchanges(indexing, [](const WireEntry& one) { return one.is_write() && one.address() == block; });
  EXPECT_GT(triggers, 100);
  EXPECT_LE(blocks - triggers, 1) << "one was under way at the end";
  // Nobody is kept waiting for others: each has its share.
  const auto share = indexing.all_done() / axes;
  for (int i = 0; i < axes; ++i)
    EXPECT_NEAR(indexing.done_of(static_cast<std::size_t>(i)), share, 1 + share / 10);
  if (baud == 115200) EXPECT_EQ(indexing.refused, 0);
  const auto per_move = static_cast<double>(indexing.line.line->wire().size()) / indexing.all_done();
  fmt::print("{} axes at {} bit/s: {:.1f} moves a second, {:.2f} exchanges a move\n", axes, baud,
             indexing.all_done() / 20.0, per_move);
  // The reading at the target, which is the proof for the next start, too; block and trigger.
  EXPECT_LE(per_move, baud == 115200 ? 3.6 : 4.5);
  const auto budgets = indexing.line.machine().budgets();
  EXPECT_LE(indexing.longest_wait, budgets.front().predicted.load.at(static_cast<std::size_t>(axes)).start);
}

/// Starts that could not come in time are told so at once; the line goes on at its own rate.
TEST(M06, ALineThatIsTooFullRefusesAtOnce) {
  Indexing indexing(30, 19200);
  indexing.run(20s);
  EXPECT_EQ(indexing.failures, std::vector<std::string>{});
  EXPECT_GT(indexing.refused, 0);
  EXPECT_GT(indexing.all_done(), 150);
  for (std::size_t i = 0; i < 30; ++i) EXPECT_GT(indexing.done_of(i), 2) << i;
}

/// What starts between two of its members would make them start further apart.
TEST(M06, AGroupHasOneTurnForAllItsMembers) {
  const std::vector<std::string> others = {"e", "f", "g", "h"};
  const std::map<std::string, double> there = {{"a", 1}, {"b", 1}, {"c", 1}, {"d", 1}},
                                      back = {{"a", 0}, {"b", 0}, {"c", 0}, {"d", 0}};
  const auto in_group = [](const WireEntry& one) { return one.node() >= 11 && one.node() <= 14; };
  const auto loads = [](const WireEntry& one) { return one.is_write() && one.address() == block; };
  GroupRig rig({.can_axes = 0, .more_serial_axes = 8});
  std::map<std::string, CommandPtr> moves;
  const auto index = [&] {
    for (const auto& name : others) {
      auto& command = moves[name];
      if (command && !command->has_ended()) continue;
      if (command) EXPECT_EQ(command->value().state, CommandState::done) << describe(command->value());
      const auto away = rig.load_mm(name) < 0.3;
      command = *rig.machine->submit(name, MoveAbsoluteRequest{.position = away ? 0.4 : 0.2}, {});
    }
  };
  for (int round = 0; round < 10; ++round) {
    rig.line->forget_wire();
    const auto run = rig.move(GroupRig::to(round % 2 == 0 ? there : back));
    while (!ended(run->state())) {
      index();
      rig.run(1ms);
    }
    ASSERT_EQ(run->state(), CommandState::done);
    const auto& wire = rig.line->wire();
    const auto first =
        std::ranges::find_if(wire, [&](const auto& one) { return in_group(one) && loads(one); });
    const auto last = std::find_if(wire.rbegin(), wire.rend(), [&](const auto& one) {
                        return in_group(one) && one.is_write() && one.address() == trigger;
                      }).base();
    EXPECT_EQ(std::count_if(first, last, [&](const auto& one) { return in_group(one) && loads(one); }), 4);
    EXPECT_EQ(std::count_if(first, last, [&](const auto& one) { return !in_group(one) && loads(one); }), 0);
    EXPECT_GT(std::ranges::count_if(wire, [&](const auto& one) { return !in_group(one) && loads(one); }), 4);
  }
}

INSTANTIATE_TEST_SUITE_P(M06, FullLine,
                         ::testing::Values(Full{1, 115200}, Full{4, 115200}, Full{16, 115200},
                                           Full{30, 115200}, Full{1, 19200}, Full{4, 19200}, Full{16, 19200}),
                         [](const auto& parameter) {
                           return fmt::format("{}AxesAt{}", parameter.param.axes, parameter.param.baud);
                         });

}  // namespace
}  // namespace axisd::test
