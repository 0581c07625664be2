// Terminals: functions, active levels, states, edges, and a drive that no longer holds them.
#include <fmt/format.h>
#include <gtest/gtest.h>

#include <algorithm>

#include "tests/conformance/scenario.hpp"

namespace axisd::conformance {

namespace {

using namespace std::chrono_literals;

const v1::Terminal& terminal_in(const google::protobuf::RepeatedPtrField<v1::Terminal>& terminals,
                                const std::string& name) {
  const auto found = std::ranges::find(terminals, name, [](const auto& t) { return t.name(); });
  if (found == terminals.end()) throw Broken("no state of terminal " + name);
  return *found;
}

bool input_active(Bench& bench, const std::string& function) {
  const auto state = bench.state();
  const auto& terminal = terminal_in(state.inputs(), bench.terminal(function));
  EXPECT_EQ(terminal.function(), function);
  return terminal.active();
}

/// M29: the edge lies within the interval that the event gives, and that is no longer than a refresh.
void expect_edge(const v1::Event& event, const std::string& function, bool active, Duration at) {
  // The input's filter lets a level through after 10 ms (4.3); the pulse counts from then on.
  constexpr Duration filter = 11ms;
  const auto& edge = event.terminal_edge();
  EXPECT_EQ(edge.function(), function);
  EXPECT_EQ(edge.active(), active);
  EXPECT_LE(from_proto(edge.after()), at + filter) << "the edge came before the interval";
  EXPECT_GE(from_proto(edge.before()), at) << "the edge came after the interval";
  EXPECT_LT(from_proto(edge.before()) - from_proto(edge.after()), 300ms);
}

std::string levels_and_edges(const Setup& setup) {
  // Inputs that have their function for good have their level, too.
  const bool fixed = !setup.manual.terminal_of("home").empty();
  const std::string function = fixed ? "home" : "stop";
  for (const bool low : {false, true}) {
    SCOPED_TRACE(low ? "active low" : "active high");
    const Recipe recipe{
        .home_switch = !fixed, .limit_switches = false, .inputs = {{function, low}}, .homing = ""};
    if (fixed && low) {
      expect_no_such_plant(setup, recipe, "the level of terminal");
      return "active high";
    }
    Bench bench(setup, recipe, false);
    bench.set_input(function, false);
    bench.await_online();
    bench.pass(1s);
    EXPECT_FALSE(input_active(bench, function));
    const auto rising = bench.now();
    bench.set_input(function, true);
    bench.pass(500ms);
    EXPECT_TRUE(input_active(bench, function));
    const auto falling = bench.now();
    bench.set_input(function, false);
    bench.pass(500ms);
    EXPECT_FALSE(input_active(bench, function));
    std::vector<v1::Event> edges;
    bench.client.events_until([&](const v1::Event& event) {
      if (event.has_terminal_edge() && event.terminal_edge().terminal() == bench.terminal(function) &&
          from_proto(event.terminal_edge().before()) >= rising)
        edges.push_back(event);
      return edges.size() == 2;
    });
    if (edges.size() != 2) throw Broken("no events of both edges");
    expect_edge(edges[0], function, true, rising);
    expect_edge(edges[1], function, false, falling);
    EXPECT_LT(edges[0].sequence(), edges[1].sequence());
    bench.finish(0);
  }
  return "yes";
}

std::string stop_terminals(const Setup& setup) {
  for (const std::string function : {"stop", "quick_stop"}) {
    SCOPED_TRACE(function);
    Bench bench(setup, {.limit_switches = false, .inputs = {{function}}, .homing = ""});
    bench.ready();
    const auto move = bench.under_way(bench.client.move_to(300, {}, v1::WAIT_UNTIL_STARTED));
    bench.set_input(function, true);
    bench.pass(2s);
    EXPECT_FALSE(bench.shaft().moving);
    expect_command(bench.client.look_up(move), v1::COMMAND_STATE_ABORTED, v1::REASON_TERMINAL);
    bench.set_input(function, false);
    bench.pass(1s);
    if (bench.state().state() == v1::STATE_ERROR_STOP) expect_done(bench.client.reset());
    bench.ready();
    expect_done(bench.client.move_to(5));
    bench.finish(2);
  }
  return "yes";
}

std::string outputs(const Setup& setup) {
  for (const bool low : {false, true}) {
    SCOPED_TRACE(low ? "active low" : "active high");
    Bench bench(setup, {.outputs = {{"alarm", low}, {"in_position", !low}}});
    const auto alarm = [&] {
      const auto state = bench.state();
      const auto& output = terminal_in(state.outputs(), setup.manual.list("outputs").front());
      EXPECT_EQ(output.function(), "alarm");
      return output.active();
    };
    bench.ready();
    expect_done(bench.client.move_to(5));
    EXPECT_FALSE(alarm());
    bench.outside("alarm @1 2");
    bench.pass(1s);
    EXPECT_TRUE(alarm());
    const auto early = expect_end(bench.client.reset(), v1::COMMAND_STATE_ERROR, v1::REASON_ALARM);
    EXPECT_FALSE(early.cause().remedy().empty()) << "it does not say what to do";
    EXPECT_TRUE(alarm());
    bench.outside("alarm @1 0");
    bench.pass(1s);
    EXPECT_EQ(alarm(), setup.on("fault_needs_reset")) << "the output follows the drive's alarm";
    expect_done(bench.client.reset());
    EXPECT_FALSE(alarm());
    bench.ready();
    expect_done(bench.client.move_to(5));
    bench.finish(2);
  }
  return "yes";
}

/// Somebody else changes the function of a terminal: reported, and nobody works with it unknowingly.
std::string drift(const Setup& setup) {
  Bench bench(setup, {.keys = "    drift_check: 2 s\n"});
  expect_done(bench.client.disable());
  const auto title = fmt::format("Input terminal {} function", bench.terminal("positive_limit"));
  const auto* found = setup.manual.find_title(title);
  if (found == nullptr) throw Broken("the manual has no parameter \"" + title + "\"");
  const auto address = found->address + (setup.on("input_functions_at_0043") ? 2 : 0);
  const auto held = bench.outside(fmt::format("peek @1 {}", address));
  bench.outside(fmt::format("poke @1 {} 0", address));
  bench.pass(5s);
  bool reported = false;
  bench.client.events_until([&](const v1::Event& event) {
    reported = event.has_configuration_drift() && !event.configuration_drift().text().empty();
    return reported;
  });
  EXPECT_TRUE(reported) << "no event says that the drive lost its configuration";
  const auto enable = bench.client.enable();
  if (enable.ok() && enable->state() == v1::COMMAND_STATE_DONE)
    EXPECT_EQ(bench.outside(fmt::format("peek @1 {}", address)), held) << "enabled without a limit switch";
  bench.pass(5s);
  bench.finish(0);
  return "yes";
}

/// What cannot work is refused when the configuration is loaded.
std::string conflicts(const Setup& setup) {
  const auto refused = [&](const Recipe& recipe, std::string_view text) {
    expect_no_such_plant(setup, recipe, text);
  };
  if (setup.manual.terminal_of("home").empty())
    refused({.limit_switches = false, .inputs = {{"home"}}, .homing = ""}, "function 'home' is assigned to");
  refused({.home_switch = false, .limit_switches = false, .homing = "home_negative"},
          "needs an input with function");
  refused({.keys = "    outputs: { Y7: alarm }\n"}, "has no output terminal");
  if (!setup.manual.says_yes("brake_output") && !setup.manual.list("outputs").empty())
    refused({.outputs = {{"brake"}}}, "has no output function");
  return "refused";
}

/// Only an input that there is for good.
Recipe one_input(const std::string& function, std::string keys = {}) {
  return {.home_switch = false,
          .limit_switches = false,
          .inputs = {{function}},
          .homing = "",
          .keys = std::move(keys)};
}

std::string no_stop_terminals(const Setup& setup) {
  for (const std::string function : {"stop", "quick_stop"})
    expect_no_such_plant(setup, one_input(function), fmt::format("has no input function '{}'", function));
  return "no";
}

std::string no_outputs(const Setup& setup) {
  expect_no_such_plant(setup, one_input("home", "    outputs: { Y0: alarm }\n"), "has no output terminal");
  return "no";
}

/// What cannot be changed cannot be lost.
std::string fixed_functions(const Setup& setup) {
  const auto home = setup.manual.terminal_of("home");
  expect_no_such_plant(
      setup,
      {.home_switch = false,
       .limit_switches = false,
       .homing = "",
       .keys = fmt::format("    inputs: {{ {}: positive_limit }}\n", home)},
      fmt::format("terminal {} of model {} is always the drive's", home, setup.manual.model()));
  return "no";
}

constexpr Scenario scenarios[] = {
    {"levels_and_edges", "inputs as state and as edge, both active levels", &levels_and_edges},
    {"stop_terminals", "stop terminals end a motion", &stop_terminals, &no_stop_terminals},
    {"outputs", "outputs as state, both active levels", &outputs, &no_outputs},
    {"drift", "lost terminal functions are reported", &drift, &fixed_functions},
    {"conflicts", "impossible terminals", &conflicts},
};

}  // namespace

std::span<const Scenario> terminal_scenarios() { return scenarios; }

}  // namespace axisd::conformance
