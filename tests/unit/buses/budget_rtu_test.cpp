// The bounds of a line against what happens on it, in virtual time.
#include "buses/budget_rtu.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <map>
#include <numeric>
#include <random>
#include <string>
#include <tuple>

#include "tests/unit/buses/line_load.hpp"

namespace axisd::modbus_rtu::test {
namespace {

using namespace std::chrono_literals;

constexpr std::array<ExchangeSize, 4> start_chain = {reading(6), reading(6), writing(6), ExchangeSize{}};

LineDemand demand_of(int axes, int baud) {
  LineDemand demand{.line = {.name = "a", .port = "sim", .baud = baud}, .axes = {}};
  for (int i = 0; i < axes; ++i)
    demand.axes.push_back({.name = "axis" + std::to_string(i + 1),
                           .set = {.state = reading(10),
                                   .continuity = reading(6),
                                   .start = start_chain,
                                   .stop = {},
                                   .longest = writing(16)},
                           .poll_moving = 20ms,
                           .poll_idle = 200ms,
                           .poll_fastest = 2ms,
                           .continuity_period = 800ms,
                           .drift_check = 10s});
  return demand;
}

/// Every second drive answers late, the others sooner than the line's limit.
LineDemand mixed(LineDemand demand) {
  for (std::size_t i = 0; i < demand.axes.size(); ++i)
    demand.axes[i].turnaround_max = i % 2 == 0 ? Duration(5ms) : Duration(45ms);
  return demand;
}

struct Case {
  int axes, baud, moving;
  int silent;
  bool is_mixed = false;
  [[nodiscard]] LineDemand demand() const {
    return is_mixed ? mixed(demand_of(axes, baud)) : demand_of(axes, baud);
  }
};

std::string name_of(const testing::TestParamInfo<Case>& info) {
  const auto& one = info.param;
  return std::to_string(one.axes) + "At" + std::to_string(one.baud) + "With" + std::to_string(one.moving) +
         "Moving" + (one.silent > 0 ? std::to_string(one.silent) + "Silent" : "") +
         (one.is_mixed ? "Mixed" : "");
}

class Loads : public testing::TestWithParam<Case> {};

TEST_P(Loads, NothingIsReadLessOftenThanPredicted) {
  const auto [count, baud, moving, silent, is_mixed] = GetParam();
  const auto demand = GetParam().demand();
  const auto budget = budget_of(demand);
  const auto& load = budget.load.at(static_cast<std::size_t>(moving));
  for (unsigned seed = 1; seed <= 10; ++seed) {
    LineLoad line(demand, seed, silent);
    line.begin(moving, true);
    line.world().run_for(40s);
    for (int i = 0; i < count; ++i) {
      const auto& axis = *line.axes[static_cast<std::size_t>(i)];
      if (axis.silent) continue;
      EXPECT_GT(axis.longest_refresh, Duration{}) << "axis " << i + 1 << ", seed " << seed;
      EXPECT_LE(axis.longest_refresh, i < moving ? load.refresh_moving : load.refresh_idle)
          << "axis " << i + 1 << ", seed " << seed;
    }
    EXPECT_EQ(line.late_frames, 0) << "seed " << seed;
    EXPECT_GT(line.completed[TransactionClass::parameters], 0) << "seed " << seed;
  }
}

TEST_P(Loads, StopsComeAsSoonAsPredictedAndNotMuchSooner) {
  const auto [count, baud, moving, silent, is_mixed] = GetParam();
  const auto demand = GetParam().demand();
  const auto budget = budget_of(demand);
  std::map<std::size_t, LineLoad::Stopped> worst;
  for (unsigned seed = 1; seed <= 3; ++seed) {
    LineLoad line(demand, seed, silent);
    line.begin(moving, true);
    std::vector<std::size_t> all(static_cast<std::size_t>(count));
    std::iota(all.begin(), all.end(), std::size_t{0});
    for (int stop = 0; stop < 60; ++stop) {
      line.world().run_for(line.random(100'000, 900'000) * 1us);
      std::vector<std::size_t> which = all;
      if (stop % 2 == 0) which = {static_cast<std::size_t>(line.random(0, count - 1))};
      const auto seen = line.stop(which);
      const auto& bound = budget.stops.at(which.size() - 1);
      ASSERT_LE(seen.last_frame + demand.line.budget.host_allowance, bound.last_frame)
          << which.size() << " axes, seed " << seed;
      ASSERT_LE(seen.standstill + demand.line.budget.host_allowance, bound.standstill)
          << which.size() << " axes, seed " << seed;
      auto& most = worst[which.size()];
      most.last_frame = std::max(most.last_frame, seen.last_frame);
      most.standstill = std::max(most.standstill, seen.standstill);
    }
  }
  for (const auto& [axes, seen] : worst)
    EXPECT_GE(2 * (seen.last_frame + demand.line.budget.host_allowance), budget.stops.at(axes - 1).last_frame)
        << axes << " axes";
}

INSTANTIATE_TEST_SUITE_P(RtuBudget, Loads,
                         testing::Values(Case{1, 115200, 1, 0}, Case{6, 115200, 0, 0}, Case{6, 115200, 2, 1},
                                         Case{6, 19200, 6, 0}, Case{12, 115200, 11, 1}, Case{4, 9600, 2, 1},
                                         Case{5, 115200, 3, 1, true}),
                         name_of);

/// A cabinet has lost its supply, just now or a while ago; the rest of the line is as busy as it can be.
class SilentDrives : public testing::TestWithParam<std::tuple<int, int, bool>> {};

TEST_P(SilentDrives, StopsComeAsSoonAsPredictedHoweverManyThereAre) {
  const auto [baud, silent, just_now] = GetParam();
  constexpr std::size_t count = 16;
  const auto demand = demand_of(count, baud);
  const auto budget = budget_of(demand);
  Duration latest_answering{};
  for (unsigned seed = 1; seed <= 3; ++seed) {
    for (int round = 0; round < 6; ++round) {
      LineLoad line(demand, 10 * seed + static_cast<unsigned>(round), just_now ? 0 : silent);
      line.begin(static_cast<int>(count), true);
      line.world().run_for(3s + line.random(0, 900'000) * 1us);
      if (just_now) line.silence_last(silent);
      line.world().run_for(line.random(0, 50'000) * 1us);
      std::vector<std::size_t> all(count);
      std::iota(all.begin(), all.end(), std::size_t{0});
      std::ranges::shuffle(all, std::mt19937(seed));
      const auto sees = [&](const std::vector<std::size_t>& which) {
        const auto seen = line.stop(which);
        const auto& bound = budget.stops.at(which.size() - 1);
        EXPECT_LE(seen.last_frame + demand.line.budget.host_allowance, bound.last_frame) << which.size();
        EXPECT_LE(seen.standstill + demand.line.budget.host_allowance, bound.standstill) << which.size();
        return seen;
      };
      latest_answering = std::max(latest_answering, sees(all).last_answering);
      // Another one, while those that did not answer are told again.
      sees({static_cast<std::size_t>(line.random(0, static_cast<int>(count) - 1 - silent))});
      line.world().run_for(line.random(0, 300'000) * 1us);
      sees(all);
    }
  }
  RecordProperty("latest_answering_us", std::to_string(latest_answering / 1us));
}

INSTANTIATE_TEST_SUITE_P(RtuBudget, SilentDrives,
                         testing::Combine(testing::Values(115200, 9600), testing::Values(1, 4, 15),
                                          testing::Bool()),
                         [](const auto& info) {
                           return std::to_string(std::get<1>(info.param)) + "At" +
                                  std::to_string(std::get<0>(info.param)) +
                                  (std::get<2>(info.param) ? "JustNow" : "");
                         });

TEST(RtuBudget, SixteenDrivesAreStoppedWellWithinASecondAtWorst) {
  for (const auto& [baud, limit] : {std::pair{115200, 400ms}, std::pair{9600, 900ms}}) {
    const auto last = budget_of(demand_of(16, baud)).stops.back().last_frame;
    EXPECT_LE(last, limit) << baud;
  }
}

TEST(RtuBudget, FiguresOfOneDriveByHand) {
  const auto demand = demand_of(1, 115200);
  const auto budget = budget_of(demand);
  // 8N1: 86.8 us a character. The longest exchange, 16 registers: 41 + 8 characters and 20 ms.
  const auto longest = wire_time(demand.line, 41) + 20ms + wire_time(demand.line, 8);
  EXPECT_EQ(budget.stops[0].last_frame,
            demand.line.budget.host_allowance + longest + 1750us + wire_time(demand.line, 8));
  // Polls of 8 + 25 characters and twice 1.75 ms every 200 ms, canaries of 8 + 17 every 800 ms.
  EXPECT_NEAR(budget.load[0].utilisation, (3.5 + 33 * 0.0868) / 200 + (3.5 + 25 * 0.0868) / 800, 1e-4);
  EXPECT_GT(budget.load[1].utilisation, budget.load[0].utilisation);
}

TEST(RtuBudget, ASlowDriveCostsTheOthersOnlyWhatItTakes) {
  auto demand = demand_of(2, 115200);
  const auto before = budget_of(demand);
  demand.axes[1].turnaround_max = 120ms;
  const auto slow = budget_of(demand);
  EXPECT_EQ(slow.stops[1].last_frame - before.stops[1].last_frame, 2 * 100ms)
      << "of what is under way, and of its own stop before the other's";
  for (auto& axis : demand.axes) axis.turnaround_max = 4ms;
  EXPECT_EQ(before.stops[1].last_frame - budget_of(demand).stops[1].last_frame, 2 * 16ms);
  EXPECT_EQ(before.load[0].utilisation, budget_of(demand).load[0].utilisation);
  EXPECT_LT(budget_of(demand).load[0].utilisation_max, before.load[0].utilisation_max);
}

TEST(RtuBudget, SaysWhenItIsTheTurnaroundThatMakesTimesLong) {
  const auto notes_with = [](int axes, Duration turnaround_max, std::optional<Duration> of_each = {}) {
    auto demand = demand_of(axes, 115200);
    for (auto& axis : demand.axes) axis.turnaround_max = of_each;
    demand.line.turnaround_max = turnaround_max;
    std::string all;
    for (const auto& note : budget_of(demand).notes) all += note + "\n";
    return all;
  };
  EXPECT_NE(notes_with(8, 200ms).find("turnaround_max (up to 200.0 ms)"), std::string::npos)
      << notes_with(8, 200ms);
  EXPECT_NE(notes_with(8, 200ms, 100ms).find("turnaround_max (up to 100.0 ms)"), std::string::npos)
      << "what no node takes is no cause: " << notes_with(8, 200ms, 100ms);
  EXPECT_EQ(notes_with(8, 5ms).find("turnaround_max"), std::string::npos) << "there is time for it";
  EXPECT_EQ(notes_with(60, 200ms).find("turnaround_max"), std::string::npos) << "too much without it, too";
}

TEST(RtuBudget, TheHostsShareIsPartOfEachStop) {
  auto demand = demand_of(2, 115200);
  const auto before = budget_of(demand);
  demand.line.budget.host_allowance += 7ms;
  const auto after = budget_of(demand);
  for (std::size_t i = 0; i < before.stops.size(); ++i) {
    EXPECT_EQ(after.stops[i].last_frame - before.stops[i].last_frame, 7ms);
    EXPECT_EQ(after.stops[i].standstill - before.stops[i].standstill, 7ms);
  }
}

TEST(RtuBudget, MoreAxesAndSlowerLinesPromiseLess) {
  Duration before{};
  for (const int baud : {115200, 38400, 19200, 9600}) {
    const auto budget = budget_of(demand_of(8, baud));
    EXPECT_GT(budget.stops.back().last_frame, before) << baud;
    before = budget.stops.back().last_frame;
    for (std::size_t i = 1; i < budget.stops.size(); ++i)
      EXPECT_GT(budget.stops[i].last_frame, budget.stops[i - 1].last_frame);
    for (std::size_t i = 2; i < budget.load.size(); ++i)
      EXPECT_GT(budget.load[i].refresh_moving, budget.load[i - 1].refresh_moving);
  }
}

}  // namespace
}  // namespace axisd::modbus_rtu::test
