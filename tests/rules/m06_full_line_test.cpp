// M6: each start is one uninterrupted chain on its node, also where all axes of a line start at once.
#include <fmt/format.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <functional>
#include <string>
#include <utility>
#include <vector>

#include "tests/rules/m22_group_rig.hpp"
#include "tests/rules/shared_line.hpp"
#include "tests/support/indexing.hpp"
#include "tests/support/rig.hpp"

namespace axisd::test {
namespace {

using namespace std::chrono_literals;

constexpr std::uint16_t block = 0x0020, trigger = 0x0027;

struct WithLine {
  WithLine(int count, int baud, const std::function<void(AxisSettings&)>& adjust = {})
      : line(count, baud, adjust) {
    for (int i = 1; i <= count; ++i) names.push_back("a" + std::to_string(i));
  }
  SharedLine line;
  std::vector<std::string> names;
};

/// What comparisons with the configuration take at rest is not looked at here.
void compare_seldom(AxisSettings& axis) { axis.drift_check = 1h; }

/// All axes of one line index.
class Indexing : public WithLine, public IndexingAxes {
 public:
  Indexing(int count, int baud, Duration pause = {})
      : WithLine(count, baud, compare_seldom),
        IndexingAxes(line.world, line.machine(), std::move(names), {.pause = pause}) {
    make_ready();
    line.line->forget_wire();
  }
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
  // The reading at the target, which is the proof for the next start, too; block and trigger. Who has the
  // line alone is asked once more before: nobody else needs the line.
  EXPECT_LE(per_move, axes == 1 ? 4.1 : baud == 115200 ? 3.3 : 4.3);
  const auto budgets = indexing.line.machine().budgets();
  EXPECT_LE(indexing.longest_wait, budgets.front().predicted.load.at(static_cast<std::size_t>(axes)).start);
}

/// A client, and the disk, take a moment. Meanwhile the axis rests, but what it is asked at rest must not
/// come between its block and its trigger, and the proof by its arrival has to last.
TEST(M06, AClientThatTakesAMomentCostsNoExchange) {
  for (const auto baud : {115200, 19200}) {
    Indexing indexing(16, baud, 3ms);
    indexing.run(20s);
    EXPECT_EQ(indexing.failures, std::vector<std::string>{});
    const auto per_move = static_cast<double>(indexing.line.line->wire().size()) / indexing.all_done();
    fmt::print("16 axes at {} bit/s, after 3 ms: {:.1f} moves a second, {:.2f} exchanges a move\n", baud,
               indexing.all_done() / 20.0, per_move);
    // With what the first starts take, which all come at once, and behind a canary.
    EXPECT_LE(per_move, baud == 115200 ? 3.2 : 3.8);
  }
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
