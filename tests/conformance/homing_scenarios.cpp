// Homing: four methods, with and without limit switches, on a switch, and without one.
#include <fmt/format.h>
#include <gtest/gtest.h>

#include "tests/conformance/scenario.hpp"

namespace axisd::conformance {

namespace {

using namespace std::chrono_literals;

bool searches_forwards(const std::string& method) { return method.find("positive") != std::string::npos; }

/// Homed, at the right end of the right switch, and what the API says of the position is true from then on.
void expect_homed(Bench& bench, const std::string& method, double home_centre) {
  const auto state = bench.state();
  expect_state(state, v1::STATE_STANDSTILL);
  EXPECT_EQ(state.trust(), v1::POSITION_TRUST_HOMED) << method;
  EXPECT_TRUE(state.homed()) << method;
  // A measured shaft may still follow: as far as the drive takes for in position, 10 pulses, and noise (M10).
  const double close = bench.setup.manual.says_yes("closed_loop") ? 0.13 : 0.06;
  EXPECT_NEAR(state.position(), 3, close) << method;
  const double where = method == "positive_limit"   ? positive_limit_at
                       : method == "negative_limit" ? negative_limit_at
                                                    : home_centre;
  EXPECT_NEAR(bench.shaft().mm, where, 1.2) << method;
  const auto offset = bench.shaft().mm - state.position();
  const double target = method == "positive_limit" ? 1 : 20;
  expect_done(bench.client.move_to(target));
  EXPECT_NEAR(bench.shaft().mm - target, offset, close) << method;
}

std::string all_methods(const Setup& setup) {
  for (const std::string method : {"home_positive", "home_negative", "positive_limit", "negative_limit"}) {
    if (method.starts_with("home") && !can_home_on_the_home_switch(setup.manual, setup.variant)) {
      // Said when the configuration is loaded, not found out on the machine.
      EXPECT_THROW(Bench(setup, {.homing = method}), std::invalid_argument);
      continue;
    }
    Bench bench(setup, {.homing = method});
    bench.enable();
    const auto home = bench.under_way(bench.client.home(v1::WAIT_UNTIL_STARTED));
    expect_state(bench.state(), v1::STATE_HOMING);
    EXPECT_EQ(bench.shaft().mm > 0, searches_forwards(method))
        << method << " searches in the wrong direction";
    bench.await([](const auto& s) { return s.state() != v1::STATE_HOMING; }, "homed", 60s);
    expect_command(bench.client.look_up(home), v1::COMMAND_STATE_DONE);
    expect_homed(bench, method, (home_from + home_to) / 2);
    bench.finish(2);
  }
  return setup.manual.text("homing_modes");
}

std::string without_limit_switches(const Setup& setup) {
  if (!can_home_on_the_home_switch(setup.manual, setup.variant)) return "yes";
  for (const std::string method : {"home_positive", "home_negative"}) {
    const bool forwards = searches_forwards(method);
    Recipe recipe{.limit_switches = false, .homing = method};
    recipe.home_at = forwards ? std::pair(50.0, 52.0) : std::pair(-52.0, -50.0);
    Bench bench(setup, recipe);
    bench.enable();
    expect_done(bench.client.home());
    expect_homed(bench, method, forwards ? 51 : -51);
    bench.finish(2);
  }
  return "yes";
}

std::string again_with_the_bit_left_over(const Setup& setup) {
  Bench bench(setup);
  bench.enable();
  expect_done(bench.client.home());
  expect_done(bench.client.move_to(43.21));
  expect_done(bench.client.home());
  expect_homed(bench, any_homing_method(setup.manual, setup.variant), (home_from + home_to) / 2);
  bench.finish(4);
  return "yes";
}

/// Drives onto the switch that homing searches for.
void go_onto_the_switch(Bench& bench) {
  bench.enable();
  expect_done(bench.client.set_position(200));
  const auto& setup = bench.setup;
  if (can_home_on_the_home_switch(setup.manual, setup.variant)) {
    expect_done(bench.client.move_to(200 + ((home_from + home_to) / 2)));
  } else {
    expect_end(bench.client.move_to(120), v1::COMMAND_STATE_ABORTED, v1::REASON_LIMIT_SWITCH);
  }
  bench.pass(500ms);
}

std::string on_the_switch(const Setup& setup) {
  {
    Bench backing(setup);
    go_onto_the_switch(backing);
    expect_done(backing.client.home());
    expect_homed(backing, any_homing_method(setup.manual, setup.variant), (home_from + home_to) / 2);
    backing.finish(4);  // onto the switch, off it, home, and the move of expect_homed()
  }
  Bench refusing(setup,
                 {.homing_keys = "velocity: 100 mm/s, search_velocity: 20 mm/s, position: 3, timeout: 40 s"});
  go_onto_the_switch(refusing);
  expect_refused(refusing.client.home(), v1::REASON_LIMIT_SWITCH);
  refusing.finish(1);
  return "yes";
}

std::string switch_never_found(const Setup& setup) {
  for (const std::string bound : {"timeout: 6 s", "timeout: 60 s, max_travel: 80 mm"}) {
    Bench bench(setup, {.mechanics = false,
                        .homing_keys = "velocity: 20 mm/s, search_velocity: 5 mm/s, " + bound,
                        .keys = "    stop_escalation: release\n"});
    bench.enable();
    expect_end(bench.client.home(), v1::COMMAND_STATE_ERROR,
               bound == "timeout: 6 s" ? v1::REASON_TOOK_TOO_LONG : v1::REASON_NOT_REACHED);
    bench.pass(3s);
    EXPECT_FALSE(bench.shaft().moving);
    EXPECT_EQ(bench.state().trust(), v1::POSITION_TRUST_UNKNOWN);
    bench.finish(1);
  }
  return "yes";
}

constexpr Scenario scenarios[] = {
    {"all_methods", "homing modes, with limit switches", &all_methods},
    {"without_limit_switches", "homing without limit switches", &without_limit_switches},
    {"again_with_the_bit_left_over", "homing again", &again_with_the_bit_left_over},
    {"on_the_switch", "homing from on the switch: backs off, or is refused", &on_the_switch},
    {"switch_never_found", "homing without a switch ends in time, and in its travel", &switch_never_found},
};

}  // namespace

std::span<const Scenario> homing_scenarios() { return scenarios; }

}  // namespace axisd::conformance
