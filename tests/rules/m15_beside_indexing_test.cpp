// M15: what is published of an axis that turns, and is stopped on its way, while all others of its line
// index.
#include <fmt/format.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <optional>
#include <random>
#include <string>
#include <utility>
#include <vector>

#include "daemon/core/drive_access_service.hpp"
#include "tests/rules/shared_line.hpp"
#include "tests/support/indexing.hpp"
#include "tests/support/rig.hpp"

namespace axisd::test {
namespace {

using namespace std::chrono_literals;

struct Beside {
  int others;
  bool one_frame;
  bool endless;  ///< it turns by a velocity; else towards a target that is far away
};

double ms(Duration time) { return std::chrono::duration<double, std::milli>(time).count(); }

class BesideIndexing : public testing::TestWithParam<Beside> {
 protected:
  BesideIndexing() : line_(GetParam().others + 1, 115200, adjust) {
    for (int i = 1; i <= GetParam().others + 1; ++i) names_.push_back("a" + std::to_string(i));
    IndexingAxes(line_.world, line_.machine(), names_).make_ready();
    far_ = names_.back();
    names_.pop_back();
  }
  static void adjust(AxisSettings& axis) {
    axis.turnaround_max = 3ms;  // the drives take 2 ms: what is published is near what happens
    if (GetParam().one_frame) axis.model_settings["start_in_one_frame"] = true;
  }
  [[nodiscard]] CommandPtr submit(const Action& action) {
    auto command = line_.machine().submit(far_, action, {.arrived = line_.world.now()});
    EXPECT_TRUE(command) << (command ? "" : to_string(command.error()));
    return command.value_or(nullptr);
  }

  SharedLine line_;
  std::vector<std::string> names_;
  std::string far_;
};

TEST_P(BesideIndexing, IsReadAndStoppedAsPublished) {
  IndexingAxes indexing(line_.world, line_.machine(), names_);
  Duration latest_stop{};
  for (int round = 0; round < 40; ++round) {
    const auto move =
        submit(GetParam().endless ? Action(MoveVelocityRequest{.velocity = 5})
                                  : Action(MoveAbsoluteRequest{.position = 1000, .with = {.velocity = 5}}));
    ASSERT_NE(move, nullptr);
    indexing.run(300ms + round * 1700us);
    ASSERT_EQ(move->value().state, CommandState::active) << describe(move->value());
    const auto asked = line_.world.now();
    const auto stop = submit(StopRequest{});
    while (!stop->has_ended() && line_.world.now() < asked + 5s) indexing.run(1ms);
    ASSERT_EQ(stop->value().state, CommandState::done) << describe(stop->value());
    latest_stop = std::max<Duration>(latest_stop, line_.world.now() - asked);
  }
  EXPECT_EQ(indexing.failures, std::vector<std::string>{});
  const auto report = line_.machine().budgets().front();
  for (const auto& axis : report.axes)
    EXPECT_LE(axis.observed.refresh_moving, axis.predicted.refresh_moving_all) << axis.predicted.axis;
  const auto& far = report.axes.back();
  // What is published counts retries and late answers, which are none here: of each other axis one reading
  // and one start come first, and what was under way.
  constexpr Duration period = 20ms, exchange = 8ms;
  const auto shortest = period + (GetParam().others * (GetParam().one_frame ? 2 : 3) + 2) * exchange;
  EXPECT_GT(far.observed.refresh_moving, Duration{});
  EXPECT_LE(far.observed.refresh_moving, shortest);
  fmt::print(
      "{} axes index: read after {:.1f} ms at most, published {:.1f} ms; standstill {:.1f} ms, {:.1f} ms\n",
      GetParam().others, ms(far.observed.refresh_moving), ms(far.predicted.refresh_moving_all),
      ms(far.observed.standstill), ms(far.predicted.alone.standstill + far.deceleration));
  EXPECT_GT(far.observed.standstill, Duration{});
  EXPECT_LE(far.observed.standstill, far.predicted.alone.standstill + far.deceleration);
  EXPECT_LE(latest_stop, far.predicted.alone.standstill + far.deceleration + 1ms)
      << "as this looks each 1 ms";
}

std::vector<Beside> all_of(const std::vector<int>& others) {
  std::vector<Beside> all;
  for (const auto count : others)
    for (const bool one_frame : {false, true})
      for (const bool endless : {false, true}) all.push_back({count, one_frame, endless});
  return all;
}

INSTANTIATE_TEST_SUITE_P(M15, BesideIndexing, testing::ValuesIn(all_of({1, 2, 3, 8})), [](const auto& info) {
  const auto& one = info.param;
  return fmt::format("{}{}{}", one.others, one.one_frame ? "InOneFrame" : "",
                     one.endless ? "Velocity" : "Far");
});

/// A line of axes that index, each compared with its configuration as often as that can be.
struct ComparedAxes {
  explicit ComparedAxes(int count) : line(count, 115200, adjust) {
    std::vector<std::string> names;
    for (int i = 1; i <= count; ++i) names.push_back("a" + std::to_string(i));
    axes.emplace(line.world, line.machine(), std::move(names), IndexingAxes::Way{.pause = 1ms});
    axes->make_ready();
  }
  static void adjust(AxisSettings& axis) {
    axis.turnaround_max = 3ms;
    axis.drift_check = 1s;
    axis.inputs.push_back({.terminal = "X1", .function = "positive_limit"});
  }
  SharedLine line;
  std::optional<IndexingAxes> axes;
};

/// Looks at the drives themselves: since when each stands.
class Standing {
 public:
  Standing(SharedLine& line, std::size_t axes) : line_(&line), moving_(axes), since_(axes) { look(); }
  Standing(const Standing&) = delete;
  /// Since the end of the motion that was seen last; nothing: none was. Once.
  std::optional<TimePoint> take(std::size_t axis) { return std::exchange(since_.at(axis), std::nullopt); }

 private:
  void look() {
    auto& network = line_->line->network();
    network.advance(line_->world.now());
    for (std::size_t i = 0; i < moving_.size(); ++i) {
      const bool moves = network.node(static_cast<std::uint8_t>(i + 1))->shaft_moving();
      if (moving_[i] != 0 && !moves) since_[i] = line_->world.now();
      moving_[i] = moves ? 1 : 0;
    }
    next_ = line_->world.clock().call_at(line_->world.now() + 500us, [this] { look(); });
  }
  SharedLine* line_;
  std::vector<char> moving_;
  std::vector<std::optional<TimePoint>> since_;
  Clock::Timer next_;
};

/// What a comparison still has to read keeps nobody from seeing how a motion that has begun since goes on.
TEST(M15, AComparisonKeepsNoMotionFromBeingSeen) {
  constexpr std::size_t count = 8;
  ComparedAxes compared(count);
  auto& world = compared.line.world;
  auto& indexing = *compared.axes;
  Standing standing(compared.line, count);
  Duration latest_done{};
  indexing.on_end = [&](std::size_t axis, const Command& move) {
    const auto since = standing.take(axis);
    const bool of_it = since && world.clock().wall(*since) >= move.accepted_at;
    if (of_it && move.state == CommandState::done)
      latest_done = std::max<Duration>(latest_done, world.now() - *since);
  };
  std::mt19937_64 random(1);
  for (int round = 0; round < 150; ++round) {
    indexing.run(150ms + Duration(random() % Duration(100ms).count()));
    indexing.stop(random() % count);
  }
  indexing.run(1s);
  EXPECT_EQ(indexing.failures, std::vector<std::string>{});
  Duration longest_standstill{};
  const auto report = compared.line.machine().budgets().front();
  for (const auto& axis : report.axes) {
    SCOPED_TRACE(axis.predicted.axis);
    EXPECT_LE(axis.observed.refresh_moving, axis.predicted.refresh_moving_all);
    EXPECT_GT(axis.observed.standstill, Duration{});
    EXPECT_LE(axis.observed.standstill, axis.predicted.alone.standstill + axis.deceleration);
    longest_standstill = std::max(longest_standstill, axis.observed.standstill);
    // The reading that shows it, and its answer.
    EXPECT_LE(latest_done, axis.predicted.refresh_moving_all + 10ms);
  }
  const auto& first = report.axes.front();
  fmt::print("done {:.1f} ms after the end, published {:.1f} ms; standstill {:.1f} ms, {:.1f} ms\n",
             ms(latest_done), ms(first.predicted.refresh_moving_all), ms(longest_standstill),
             ms(first.predicted.alone.standstill + first.deceleration));
}

/// The reply to a stop may be the late one of that before it: then the drive is read, and the stop goes out
/// once more. Neither waits for what others read of their drives (M15: no bound counts that).
TEST(M15, AStopThatIsNotCertainWaitsForNoAwaitedReading) {
  constexpr std::uint16_t stop = 0x0028, moving = 0x0004;
  ComparedAxes compared(4);
  auto& line = compared.line;
  auto& indexing = *compared.axes;
  std::mt19937_64 random(1);
  int uncertain = 0;
  for (int round = 0; round < 150; ++round) {
    indexing.run(100ms + Duration(random() % Duration(100ms).count()));
    line.line->network().faults().add(
        {.kind = simulation::FaultKind::drop_reply, .node = 1, .register_address = stop});
    line.line->forget_wire();
    indexing.stop(0);
    indexing.run(100ms);
    // Its frames, and where they stand among all.
    std::vector<std::size_t> of_stop;
    const auto& wire = line.line->wire();
    for (std::size_t i = 0; i < wire.size(); ++i) {
      const bool read = !wire[i].is_write() && wire[i].address() == moving;
      if (wire[i].node() == 1 && (wire[i].address() == stop || read)) of_stop.push_back(i);
    }
    if (of_stop.size() < 4) continue;  // a reading of its state came between
    ++uncertain;
    ASSERT_EQ(wire[of_stop[2]].address(), moving);
    // One may have been under way as the stop was heard, one have its turn by the reservation, and one be the
    // next frame of a start that waited before it.
    EXPECT_LE(of_stop[2] - of_stop[1], 4U) << round;
    EXPECT_LE(of_stop[3] - of_stop[2], 2U) << round;
  }
  EXPECT_GT(uncertain, 50);
  EXPECT_EQ(indexing.failures, std::vector<std::string>{});
}

/// What a client reads of a drive is not ended by its starts.
TEST(M32Reading, ParametersAreReadThoughTheAxisIndexes) {
  ComparedAxes compared(4);
  auto& line = compared.line;
  core::DriveAccessService drives(line.world.executor(), line.world.clock(), line.machine());
  for (int i = 0; i < 100; ++i) {
    std::optional<Result<std::vector<ParameterValue>>> found;
    drives.read_parameters("a1", {0x0011, 0x0034, 0x0044}, [&](auto result) { found = std::move(result); });
    const auto since = line.world.now();
    while (!found && line.world.now() < since + 10s) compared.axes->run(3ms);
    ASSERT_TRUE(found);
    ASSERT_TRUE(*found) << to_string(found->error());
  }
  EXPECT_EQ(compared.axes->failures, std::vector<std::string>{});
}

/// A comparison with the configuration comes to its end though the axis starts meanwhile, again and again.
TEST(M3, WhatAnotherMasterChangedIsFoundThoughTheAxisIndexes) {
  constexpr std::uint16_t x1_function = 0x0044;
  for (const int count : {1, 4, 8}) {
    SCOPED_TRACE(count);
    ComparedAxes compared(count);
    auto& line = compared.line;
    auto& indexing = *compared.axes;
    indexing.run(3s);
    EXPECT_EQ(indexing.failures, std::vector<std::string>{});
    line.line->network().node(1)->poke(x1_function, 0);
    const auto since = line.world.now();
    const auto found = [&] { return !line.machine().find("a1")->snapshot()->drift.empty(); };
    while (!found() && line.world.now() < since + 30s) indexing.run(100ms);
    EXPECT_TRUE(found());
    fmt::print("{} axes: found after {:.0f} ms\n", count, ms(line.world.now() - since));
  }
}

}  // namespace
}  // namespace axisd::test
