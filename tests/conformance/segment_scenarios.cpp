// The drive's own table of positions (PT, 7.3) and velocities (PV, 7.4), started by terminals.
#include <fmt/format.h>
#include <gtest/gtest.h>

#include <cmath>

#include "tests/conformance/scenario.hpp"

namespace axisd::conformance {

namespace {

using namespace std::chrono_literals;

constexpr double close = 0.06;

std::vector<std::string> pins_of(std::int64_t number) {
  std::vector<std::string> pins;
  for (int bit = 0; bit < 5; ++bit)
    if ((number >> bit & 1) != 0) pins.push_back(fmt::format("pin{}", bit));
  return pins;
}

/// Terminals for the table and nothing else: the smallest model has just enough of them.
Recipe table_recipe(const std::string& enable, const std::vector<std::string>& pins, std::string table = {}) {
  Recipe recipe{.home_switch = false, .limit_switches = false, .homing = ""};
  recipe.inputs.push_back({enable});
  for (const auto& pin : pins) recipe.inputs.push_back({pin});
  recipe.keys = "    stop_escalation: release\n" + std::move(table);
  return recipe;
}

bool has_table(const Manual& manual) { return manual.number("pt_segments") > 0; }

/// A model whose manual has no table: what would be for one is refused, the YAML when it is loaded, with the
/// reason.
std::string no_table(const Setup& setup) {
  try {
    const Bench bench(
        setup, {.keys = "    segments: { positions: { 1: { target: 60 mm, velocity: 50 mm/s } } }\n"}, false);
    ADD_FAILURE() << "segments in the YAML are accepted";
  } catch (const std::invalid_argument& refused) {
    EXPECT_NE(std::string_view(refused.what()).find("has no table of segments"), std::string_view::npos)
        << refused.what();
  }
  EXPECT_THROW(Bench(setup, table_recipe("pt_enable", {"pin0"}), false), std::invalid_argument);
  EXPECT_THROW(Bench(setup, table_recipe("pv_enable", {"pin0"}), false), std::invalid_argument);
  return "no";
}

void select(Bench& bench, std::int64_t number) {
  const auto wanted = pins_of(number);
  for (const auto& input : bench.recipe.inputs)
    if (input.function.starts_with("pin"))
      bench.set_input(input.function, std::ranges::find(wanted, input.function) != wanted.end());
  bench.pass(50ms);
}

/// Starts the selected position segment; returns once the load rests.
void run_position(Bench& bench) {
  bench.set_input("pt_enable", true);
  bench.pass(350ms);
  const auto state = bench.state();
  expect_state(state, v1::STATE_DISCRETE_MOTION);
  EXPECT_EQ(v1::MotionCause_Name(state.motion_cause()), "MOTION_CAUSE_TERMINAL");
  expect_refused(bench.client.move_to(1), v1::REASON_TERMINAL);
  bench.await([](const auto& s) { return !s.moving(); }, "at rest", 30s);
  bench.set_input("pt_enable", false);
  bench.pass(500ms);
  expect_state(bench.state(), v1::STATE_STANDSTILL);
}

std::string positions(const Setup& setup) {
  if (!has_table(setup.manual)) return no_table(setup);
  const auto highest = setup.manual.number("pt_segments");
  for (const bool absolute : {true, false}) {
    SCOPED_TRACE(absolute ? "absolute" : "relative");
    const auto pins = pins_of(highest);
    const auto low = std::int64_t{1} << (pins.front().back() - '0');
    std::string rows = fmt::format("{}: {{ target: 60 mm, velocity: 50 mm/s }}", highest);
    if (low != highest)
      rows += fmt::format(", {}: {{ target: {} mm, velocity: 30 mm/s }}", low, absolute ? 20 : -25);
    Bench bench(setup, table_recipe("pt_enable", pins,
                                    fmt::format("    segments: {{ mode: {}, positions: {{ {} }} }}\n",
                                                absolute ? "absolute" : "relative", rows)));
    bench.ready();
    select(bench, highest);
    run_position(bench);
    EXPECT_NEAR(bench.shaft().mm, 60, close);
    EXPECT_NEAR(bench.state().position(), 60, close);
    int starts = 1;
    if (low != highest) {
      select(bench, low);
      run_position(bench);
      EXPECT_NEAR(bench.shaft().mm, absolute ? 20 : 35, close);
      EXPECT_NEAR(bench.state().position(), bench.shaft().mm, close);
      ++starts;
    }
    expect_done(bench.client.move_to(5));  // the axis is the client's again, and knows where it is
    EXPECT_NEAR(bench.shaft().mm, 5, close);
    bench.finish(starts + 1);
  }
  return std::to_string(highest);
}

/// The highest velocity segment that the model's terminals can select. An inverted axis needs one of them for
/// the direction.
void run_highest_velocity(const Setup& setup) {
  const auto highest = setup.manual.number("pv_segments");
  auto recipe = table_recipe(
      "pv_enable", pins_of(highest),
      fmt::format("    segments: {{ velocities: {{ {}: {{ velocity: 40 mm/s }} }} }}\n", highest));
  recipe.limits = false;
  Bench bench(setup, recipe);
  bench.ready();
  select(bench, highest);
  bench.set_input("pv_enable", true);
  bench.pass(1s);
  EXPECT_NEAR(bench.state().velocity(), 40, 1);
  bench.set_input("pv_enable", false);
  bench.pass(1s);
  expect_done(bench.client.stop());
  bench.finish(1);
}

std::string velocities(const Setup& setup) {
  if (!has_table(setup.manual)) return no_table(setup);
  if (!setup.variant.invert) run_highest_velocity(setup);
  auto recipe =
      table_recipe("pv_enable", {"pv_direction", "pin0", "pin1"},
                   "    segments: { velocities: { 1: { velocity: 20 mm/s }, 3: { velocity: 60 mm/s } } }\n");
  recipe.limits = false;
  Bench bench(setup, recipe);
  bench.ready();
  for (const bool negative : {false, true}) {
    SCOPED_TRACE(negative ? "negative" : "positive");
    const double way = negative ? -1 : 1;
    const auto before = bench.shaft().mm;
    bench.set_input("pv_direction", negative);
    select(bench, 1);
    bench.set_input("pv_enable", true);
    bench.pass(1s);
    const auto state = bench.state();
    expect_state(state, v1::STATE_CONTINUOUS_MOTION);
    EXPECT_EQ(v1::MotionCause_Name(state.motion_cause()), "MOTION_CAUSE_TERMINAL");
    EXPECT_GT((bench.shaft().mm - before) * way, 10) << "wrong direction";
    if (!setup.on("unsigned_speed")) EXPECT_NEAR(state.velocity(), 20 * way, 1);
    select(bench, 3);
    bench.pass(1s);
    EXPECT_NEAR(std::abs(bench.state().velocity()), 60, 1);
    bench.set_input("pv_enable", false);
    bench.pass(2s);
    if (bench.shaft().moving) {
      EXPECT_TRUE(setup.on("pv_latched")) << "it runs on";
      expect_done(bench.client.stop());
    }
    EXPECT_FALSE(bench.shaft().moving);
    EXPECT_NEAR(bench.state().position(), bench.shaft().mm, close);
    if (bench.state().state() == v1::STATE_DISABLED) bench.enable();
  }
  bench.finish(bench.shaft().starts);
  return setup.manual.text("pv_segments");
}

/// A stop of the API ends a motion that a terminal started, with the terminal held active. Without a table it
/// is a jog.
std::string stopped_from_outside(const Setup& setup) {
  const bool table = has_table(setup.manual);
  const std::string starter = table ? "pt_enable" : "jog_positive";
  Bench bench(
      setup, table
                 ? table_recipe(starter, {"pin0"},
                                "    segments: { positions: { 1: { target: 300 mm, velocity: 50 mm/s } } }\n")
                 : table_recipe(starter, {}));
  bench.ready();
  if (table) select(bench, 1);
  bench.set_input(starter, true);
  bench.pass(1s);
  EXPECT_TRUE(bench.shaft().moving);
  EXPECT_EQ(v1::MotionCause_Name(bench.state().motion_cause()), "MOTION_CAUSE_TERMINAL");
  expect_done(bench.client.stop());
  bench.pass(1s);
  EXPECT_FALSE(bench.shaft().moving);
  bench.finish(1);
  return "yes";
}

v1::SegmentTable table_of(std::int64_t count) {
  v1::SegmentTable table;
  table.set_absolute(true);
  for (std::int64_t i = 1; i <= count; ++i) {
    auto& position = *table.add_positions();
    position.set_number(static_cast<std::uint32_t>(i));
    position.set_target(static_cast<double>(10 * i));
    position.set_velocity(30);
    to_proto(std::chrono::milliseconds(100 + i), *position.mutable_acceleration_time());
    auto& velocity = *table.add_velocities();
    velocity.set_number(static_cast<std::uint32_t>(i));
    velocity.set_velocity(static_cast<double>(5 * i));
    to_proto(std::chrono::milliseconds(100 + i), *velocity.mutable_acceleration_time());
  }
  return table;
}

std::string not_started_from_outside(const Setup& setup) {
  for (const std::string function : {"jog_positive", "homing_start"})
    expect_no_such_plant(
        setup, {.home_switch = false, .limit_switches = false, .inputs = {{function}}, .homing = ""},
        fmt::format("has no input function '{}'", function));
  return "no";
}

Answer<v1::WriteSegmentsResponse> write(Bench& bench, const v1::SegmentTable& table) {
  v1::WriteSegmentsRequest request;
  request.set_axis("axis");
  *request.mutable_segments() = table;
  return bench.client.call(&v1::DriveService::Stub::WriteSegments, request);
}

void expect_table(const v1::SegmentTable& table, const v1::SegmentTable& expected) {
  EXPECT_EQ(table.absolute(), expected.absolute());
  if (table.positions_size() != expected.positions_size() ||
      table.velocities_size() != expected.velocities_size())
    throw Broken("read back: " + table.ShortDebugString());
  for (int i = 0; i < table.positions_size(); ++i) {
    EXPECT_EQ(table.positions(i).number(), expected.positions(i).number());
    EXPECT_NEAR(table.positions(i).target(), expected.positions(i).target(), 0.011);
    EXPECT_NEAR(table.positions(i).velocity(), expected.positions(i).velocity(), 0.17);
    EXPECT_EQ(table.positions(i).acceleration_time().nanos(),
              expected.positions(i).acceleration_time().nanos());
    EXPECT_NEAR(table.velocities(i).velocity(), expected.velocities(i).velocity(), 0.17);
  }
}

std::string no_table_by_api(const Setup& setup) {
  Bench bench(setup);
  expect_done(bench.client.disable());
  v1::ReadSegmentsRequest request;
  request.set_axis("axis");
  expect_refused(bench.client.call(&v1::DriveService::Stub::ReadSegments, request), v1::REASON_NOT_SUPPORTED);
  expect_refused(write(bench, table_of(1)), v1::REASON_NOT_SUPPORTED);
  bench.finish(0);
  return "no";
}

std::string by_api(const Setup& setup) {
  if (!has_table(setup.manual)) return no_table_by_api(setup);
  const auto highest = setup.manual.number("pt_segments");
  Bench bench(setup, table_recipe("pt_enable", pins_of(highest)));
  bench.ready();
  const auto table = table_of(highest);
  EXPECT_FALSE(write(bench, table).ok()) << "written while enabled";
  expect_done(bench.client.disable());
  const auto written = write(bench, table);
  if (!written.ok()) throw Broken("WriteSegments: " + written.status.error_message());
  expect_table(written->segments(), table);
  v1::ReadSegmentsRequest request;
  request.set_axis("axis");
  const auto read = bench.client.call(&v1::DriveService::Stub::ReadSegments, request);
  if (!read.ok()) throw Broken("ReadSegments: " + read.status.error_message());
  expect_table(read->segments(), table);
  expect_refused(write(bench, table_of(highest + 1)), v1::REASON_OUT_OF_RANGE);

  bench.ready();
  select(bench, highest);
  run_position(bench);
  EXPECT_NEAR(bench.shaft().mm, static_cast<double>(10 * highest), close);
  bench.finish(1);

  Bench owned(setup,
              table_recipe("pt_enable", {"pin0"},
                           "    segments: { positions: { 1: { target: 10 mm, velocity: 50 mm/s } } }\n"));
  expect_done(owned.client.disable());
  expect_refused(write(owned, table_of(1)), v1::REASON_INVALID_ARGUMENT);
  owned.finish(0);
  return "yes";
}

constexpr Scenario scenarios[] = {
    {"positions", "position segments (PT) selected and started by terminals", &positions},
    {"velocities", "velocity segments (PV) selected and started by terminals", &velocities},
    {"stopped_from_outside", "stop of a motion that a terminal started", &stopped_from_outside,
     &not_started_from_outside},
    {"by_api", "segment table over the API, in user units", &by_api},
};

}  // namespace

std::span<const Scenario> segment_scenarios() { return scenarios; }

}  // namespace axisd::conformance
