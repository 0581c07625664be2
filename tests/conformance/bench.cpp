#include "tests/conformance/bench.hpp"

#include <fmt/format.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdio>

#include "devices/simulation/simulator.hpp"

namespace axisd::conformance {

using namespace std::chrono_literals;

bool Setup::on(std::string_view switch_name) const {
  if (const auto found = variant.switches.find(std::string(switch_name)); found != variant.switches.end())
    return found->second;
  const auto switches = simulation::find_simulator(manual.model())->switches;
  const auto spec = std::ranges::find(switches, switch_name, &simulation::SwitchSpec::name);
  return spec != switches.end() && spec->default_value;
}

Bench::Bench(const Setup& setup_of, const Recipe& recipe_of, bool connect)
    : Bench(setup_of, make_plant(setup_of.manual, setup_of.variant, recipe_of), recipe_of, connect) {}

Bench::Bench(const Setup& setup_of, const Plant& plant, const Recipe& recipe_of, bool connect)
    : setup(setup_of),
      recipe(recipe_of),
      target(setup_of.make_target(plant)),
      client(*target, "axis"),
      terminals_(terminals_of(setup_of.manual, setup_of.variant, recipe_of)) {
  if (!connect) return;
  await([](const auto& s) { return s.link() != v1::LINK_STATE_OFFLINE; }, "reached");
  pass(1s);
  if (state().link() == v1::LINK_STATE_CONFIGURING && state().enabled()) expect_done(client.disable());
  await_online();
}

v1::AxisState Bench::await(const std::function<bool(const v1::AxisState&)>& condition, std::string_view what,
                           Duration limit) {
  constexpr Duration step = 20ms;
  v1::AxisState now = state();
  for (Duration waited{}; !condition(now); waited += step) {
    if (waited >= limit) throw Broken(fmt::format("not {}: {}", what, now.ShortDebugString()));
    pass(step);
    now = state();
  }
  return now;
}

Duration Bench::now() {
  const auto known = state();
  return from_proto(known.measured_at()) + std::chrono::seconds(known.age().seconds()) +
         std::chrono::nanoseconds(known.age().nanos());
}

std::string Bench::outside(const std::string& line) {
  const auto answer = target->control(line);
  if (!answer.starts_with("ok")) throw Broken(fmt::format("{}: {}", line, answer));
  return answer.size() > 3 ? answer.substr(3) : std::string();
}

Shaft Bench::shaft() {
  const auto text = outside("shaft @1");
  long long pulses = 0;
  int moving = 0, starts = 0;
  if (std::sscanf(text.c_str(), "position=%lld moving=%d starts=%d", &pulses, &moving, &starts) != 3)
    throw Broken("shaft @1: " + text);
  const double direction = setup.variant.invert ? -1 : 1;
  return {.mm = static_cast<double>(pulses) / pulses_per_mm(setup.manual) * direction,
          .moving = moving != 0,
          .starts = starts};
}

void Bench::set_input(const std::string& function, bool active) {
  const auto wanted = std::ranges::find(recipe.inputs, function, &Wanted::function);
  const bool low = wanted != recipe.inputs.end() && wanted->active_low;
  outside(fmt::format("input @1 {} {}", terminal(function), active != low ? "on" : "off"));
}

void Bench::free_input(const std::string& function) {
  outside(fmt::format("input @1 {} auto", terminal(function)));
}

void Bench::cycle_power(Duration off) {
  outside("power @1 off");
  pass(off);
  outside("power @1 on");
}

void Bench::enable() { expect_done(client.enable()); }

void Bench::ready() {
  enable();
  expect_done(client.set_position(0));
}

v1::Command Bench::under_way(const Answer<v1::Command>& answer, Duration after) {
  if (!answer.ok()) throw Broken("not accepted: " + answer.status.error_message());
  pass(after);
  if (!shaft().moving) throw Broken("it does not move: " + describe(client.look_up(answer.response)));
  return answer.response;
}

void Bench::finish(int starts) {
  pass(2s);
  const auto before = shaft();
  EXPECT_FALSE(before.moving) << "it still moves at the end";
  pass(2s);
  const auto after = shaft();
  EXPECT_EQ(after.mm, before.mm) << "it moved by itself";
  EXPECT_EQ(after.starts, starts) << "starts of motion that the drive has executed";
}

double close_to_target(const Setup& setup) {
  constexpr double usual_mm = 0.05, window_pulses = 10, window_turns = 0.001, noise_pulses = 3;
  if (!setup.manual.is_a_make()) return usual_mm + (setup.variant.noise / pulses_per_mm(setup.manual));
  const auto counts = static_cast<double>(setup.manual.counts());
  const auto pulses = std::max(window_pulses, window_turns * counts) + noise_pulses;
  return std::max(usual_mm, pulses / pulses_per_mm(setup.manual));
}

void expect_command(const v1::Command& command, v1::CommandState state, v1::Reason cause) {
  EXPECT_EQ(v1::CommandState_Name(command.state()), v1::CommandState_Name(state)) << describe(command);
  if (cause != v1::REASON_UNSPECIFIED)
    EXPECT_EQ(v1::Reason_Name(command.cause().reason()), v1::Reason_Name(cause)) << describe(command);
  if (command.has_cause()) EXPECT_FALSE(command.cause().message().empty());
}

v1::Command expect_end(const Answer<v1::Command>& answer, v1::CommandState state, v1::Reason cause) {
  if (!answer.ok())
    throw Broken(fmt::format("refused: {} ({})", answer.status.error_message(),
                             v1::Reason_Name(answer.error.reason())));
  expect_command(answer.response, state, cause);
  return answer.response;
}

v1::ErrorDetail expect_refused(const grpc::Status& status, const v1::ErrorDetail& error, v1::Reason reason) {
  EXPECT_FALSE(status.ok()) << "accepted, but it had to be refused: " << v1::Reason_Name(reason);
  EXPECT_EQ(v1::Reason_Name(error.reason()), v1::Reason_Name(reason)) << status.error_message();
  EXPECT_FALSE(error.message().empty());
  EXPECT_FALSE(error.remedy().empty()) << "it does not say what to do: " << status.error_message();
  return error;
}

void expect_no_such_plant(const Setup& setup, const Recipe& recipe, std::string_view text) {
  try {
    const Bench bench(setup, recipe, false);
    ADD_FAILURE() << "accepted, although: " << text;
  } catch (const std::invalid_argument& error) {
    EXPECT_NE(std::string_view(error.what()).find(text), std::string_view::npos) << error.what();
  }
}

void expect_state(const v1::AxisState& state, v1::State expected) {
  EXPECT_EQ(v1::State_Name(state.state()), v1::State_Name(expected)) << state.ShortDebugString();
}

}  // namespace axisd::conformance
