// Alarms: each of chapter 8 of the manual, in mid-move, with its reset rule.
#include <fmt/format.h>
#include <gtest/gtest.h>

#include <map>
#include <string>
#include <vector>

#include "tests/conformance/scenario.hpp"

namespace axisd::conformance {

namespace {

using namespace std::chrono_literals;

void raise_in_mid_move(Bench& bench, int code) {
  bench.ready();
  const auto move = bench.under_way(bench.client.move_to(300, {.velocity = 60}, v1::WAIT_UNTIL_STARTED));
  bench.outside(fmt::format("alarm @1 {}", code));
  const auto state =
      bench.await([](const auto& s) { return s.state() == v1::STATE_ERROR_STOP; }, "in ErrorStop");
  EXPECT_EQ(state.alarm_code(), static_cast<unsigned>(code));
  EXPECT_FALSE(state.alarm_name().empty());
  EXPECT_EQ(v1::Reason_Name(state.fault().reason()), "REASON_ALARM");
  EXPECT_EQ(state.fault().native_code(), static_cast<unsigned>(code));
  EXPECT_FALSE(state.fault().remedy().empty()) << "it does not say what to do";
  const auto ended = bench.client.look_up(move);
  expect_command(ended, v1::COMMAND_STATE_ERROR, v1::REASON_ALARM);
  bench.pass(2s);
  EXPECT_FALSE(bench.shaft().moving);
  expect_refused(bench.client.move_by(1), v1::REASON_ALARM);
}

/// Refused at once, or an Error after the drive was asked: either way the axis stays as it is.
void expect_no_reset(Bench& bench) {
  const auto reset = bench.client.reset();
  if (reset.ok()) {
    expect_command(reset.response, v1::COMMAND_STATE_ERROR, v1::REASON_ALARM);
  } else {
    expect_refused(reset, v1::REASON_ALARM);
  }
  expect_state(bench.state(), v1::STATE_ERROR_STOP);
}

void leave(Bench& bench, const std::string& rule) {
  if (rule == "by_command") return;
  expect_no_reset(bench);
  bench.outside("alarm @1 0");
  bench.pass(1s);
  expect_state(bench.state(), v1::STATE_ERROR_STOP);  // latched, although 2 and 3 clear themselves (M5)
  if (rule == "by_itself") {
    EXPECT_EQ(bench.state().alarm_code(), 0U);
    expect_refused(bench.client.move_by(1), v1::REASON_ALARM);
    return;
  }
  expect_no_reset(bench);
  bench.cycle_power();
  bench.pass(1s);
  bench.await_online();
  expect_state(bench.state(), v1::STATE_ERROR_STOP);
}

void raise_and_leave(Bench& bench, int code, const std::string& rule) {
  const auto starts = bench.shaft().starts;
  raise_in_mid_move(bench, code);
  leave(bench, rule);
  bench.pass(2s);
  expect_done(bench.client.reset());
  EXPECT_EQ(bench.state().alarm_code(), 0U);
  EXPECT_EQ(bench.state().trust(), v1::POSITION_TRUST_UNKNOWN);
  bench.pass(2s);
  EXPECT_EQ(bench.shaft().starts, starts + 1) << "nothing resumes by itself";
  bench.ready();
  expect_done(bench.client.move_to(5));
}

/// All of one rule one after another on the same axis: none leaves anything behind for the next.
std::string every_alarm(const Setup& setup) {
  constexpr std::size_t most_listed = 9;
  const auto alarms = setup.manual.alarms();
  std::map<std::string, std::vector<int>> by_rule;
  std::string codes;
  for (const auto& [code, rule] : alarms) {
    by_rule[rule].push_back(code);
    codes += fmt::format("{}{}", codes.empty() ? "" : " ", code);
  }
  for (const auto& [rule, same] : by_rule) {
    // The load goes on from where each alarm left it: without switches on its way.
    Bench bench(setup, {.mechanics = false});
    for (const auto code : same) {
      SCOPED_TRACE(fmt::format("alarm {} ({})", code, rule));
      raise_and_leave(bench, code, rule);
    }
    bench.finish(2 * static_cast<int>(same.size()));
  }
  return alarms.size() <= most_listed ? codes : fmt::format("{} codes", alarms.size());
}

constexpr Scenario scenarios[] = {{"every_alarm", "alarms, each with its reset rule", &every_alarm}};

}  // namespace

std::span<const Scenario> alarm_scenarios() { return scenarios; }

}  // namespace axisd::conformance
