// The function blocks of the YSS-C manual's appendix: each is one request of axisd, and does on the wire what
// the appendix prescribes, but for the steps that must not be copied.
#include <gtest/gtest.h>

#include <fstream>
#include <map>
#include <optional>
#include <sstream>

#include "tests/rules/m23_can_rig.hpp"
#include "tests/support/source_tree.hpp"

namespace axisd::test {
namespace {

using namespace std::chrono_literals;

/// One row of tests/golden/yss-c.function-blocks.csv.
struct Step {
  std::string block, number, action, value, alternative, rpc;
  std::uint32_t object = 0;
  std::uint32_t mask = 0xFFFFFFFF;
};

std::vector<Step> transcription() {
  std::ifstream file(test::in_source_tree("tests/golden/yss-c.function-blocks.csv"));
  std::vector<Step> steps;
  std::string line;
  std::getline(file, line);  // the titles
  while (std::getline(file, line)) {
    std::vector<std::string> cells;
    std::istringstream row(line);
    for (std::string cell; std::getline(row, cell, ',');) cells.push_back(cell);
    if (cells.size() < 8) throw std::runtime_error(line);
    Step step{.block = cells[0],
              .number = cells[1],
              .action = cells[2],
              .value = cells[5],
              .alternative = cells[6],
              .rpc = cells[7]};
    step.object = static_cast<std::uint32_t>(std::stoul(cells[3], nullptr, 0)) << 8U;
    if (!cells[4].empty()) step.mask = static_cast<std::uint32_t>(std::stoul(cells[4], nullptr, 0));
    steps.push_back(std::move(step));
  }
  return steps;
}

/// Steps that axisd leaves out or does otherwise, and why.
const std::map<std::pair<std::string, std::string>, std::string> not_copied = {
    {{"MC_POWER", "1"}, "the drive is not released first: a load that is held would drop"},
    {{"MC_STOP", "1"}, "clearing halt may resume a halted move (M12, M23)"},
    {{"MC_MOVREL", "4"}, "relative targets become absolute before the wire (M8)"},
    {{"MC_MOVREL", "6"}, "likewise"},
    {{"MC_MOVVEL", "1"}, "halt is released with 60FFh = 0 only, and only if it was set (M23)"},
    {{"MC_JOG", "1"}, "likewise"},
};

struct Block {
  std::string_view name, rpc;
  /// Does it on a ready axis; the symbols of the transcription by their values.
  std::map<std::string, std::int64_t> (*run)(CanRig& rig);
};

const Block blocks[] = {
    {"MC_POWER", "AxisService.Enable",
     [](CanRig& rig) {
       rig.done(DisableRequest{});
       rig.frames.clear();
       rig.done(EnableRequest{});
       return std::map<std::string, std::int64_t>{};
     }},
    {"MC_RESET", "AxisService.Reset",
     [](CanRig& rig) {
       rig.touch([](auto& node) { node.raise_alarm(4); });
       rig.run(1s);
       rig.touch([](auto& node) { node.raise_alarm(0); });
       rig.frames.clear();
       rig.done(ResetRequest{});
       return std::map<std::string, std::int64_t>{};
     }},
    {"MC_STOP", "AxisService.Stop",
     [](CanRig& rig) {
       rig.submit(MoveVelocityRequest{.velocity = 50});
       rig.run(700ms);
       rig.frames.clear();
       rig.done(StopRequest{.kind = StopKind::stop});
       return std::map<std::string, std::int64_t>{};
     }},
    {"MC_HOME", "AxisService.Home",
     [](CanRig& rig) {
       rig.done(HomeRequest{});
       return std::map<std::string, std::int64_t>{{"home_offset", 100}};
     }},
    {"MC_MOVABS", "AxisService.MoveAbsolute",
     [](CanRig& rig) {
       rig.done(MoveAbsoluteRequest{.position = 30, .with = {.velocity = 50}});
       return std::map<std::string, std::int64_t>{
           {"position", 3000}, {"velocity", 300}, {"acceleration_time", 100}, {"deceleration_time", 100}};
     }},
    {"MC_MOVREL", "AxisService.MoveRelative",
     [](CanRig& rig) {
       rig.done(MoveAbsoluteRequest{.position = 10});
       rig.done(MoveRelativeRequest{.distance = 20, .with = {.velocity = 50}});
       return std::map<std::string, std::int64_t>{
           {"position", 3000}, {"velocity", 300}, {"acceleration_time", 100}, {"deceleration_time", 100}};
     }},
    {"MC_MOVVEL", "AxisService.MoveVelocity",
     [](CanRig& rig) {
       rig.submit(MoveVelocityRequest{.velocity = 50});
       rig.run(700ms);
       rig.done(StopRequest{.kind = StopKind::stop});
       return std::map<std::string, std::int64_t>{
           {"velocity", 300}, {"acceleration_time", 100}, {"deceleration_time", 100}};
     }},
    {"MC_JOG", "AxisService.Jog",
     [](CanRig& rig) {
       for (const double velocity : {50.0, -50.0}) {
         rig.submit(JogRequest{.velocity = velocity, .hold = 1s});
         EXPECT_TRUE(rig.run_until([&] { return !rig.axis().at_rest(); }, 1s));
         EXPECT_TRUE(rig.run_until([&] { return rig.axis().at_rest(); }, 5s));
       }
       return std::map<std::string, std::int64_t>{
           {"velocity", 300}, {"-velocity", -300}, {"acceleration_time", 100}, {"deceleration_time", 100}};
     }},
};

struct Write {
  std::uint32_t object, value;
};

/// By SDO, in order. Sub-index 0 for 6099h, which has its values in 1 and 2.
std::vector<Write> writes_of(const CanRig& rig) {
  std::vector<Write> writes;
  for (const auto& [at, frame] : rig.frames) {
    const auto& data = frame.data;
    if (frame.id != 0x600U + CanRig::node_id || (data[0] & 0xE0U) != 0x20U) continue;
    writes.push_back({.object = (std::uint32_t{data[2]} << 8U | data[1]) << 8U,
                      .value = data[4] | std::uint32_t{data[5]} << 8U | std::uint32_t{data[6]} << 16U |
                               std::uint32_t{data[7]} << 24U});
  }
  return writes;
}

bool is_number(const std::string& text) { return !text.empty() && (std::isdigit(text[0]) != 0); }

class FunctionBlock : public testing::TestWithParam<Block> {};

TEST_P(FunctionBlock, IsOneRequestAndDoesWhatTheAppendixSays) {
  const auto& block = GetParam();
  CanRig rig({.limits = false, .adjust = [](AxisSettings& axis) {
                axis.homing->offset = 1;
                axis.homing->velocity = 50;
              }});
  rig.ready();
  const auto symbols = block.run(rig);
  const auto writes = writes_of(rig);
  auto from = writes.begin();
  int checked = 0;
  for (const auto& step : transcription()) {
    if (step.block != block.name) continue;
    EXPECT_EQ(step.rpc, block.rpc);
    SCOPED_TRACE(step.block + " step " + step.number + " " + step.action + " " + step.value);
    const auto of_object = [&](const Write& write) { return write.object == step.object; };
    if (step.action == "input") EXPECT_TRUE(std::ranges::any_of(writes, of_object));
    if (step.action != "write" || not_copied.contains({step.block, step.number})) continue;
    ++checked;
    if (!is_number(step.value)) {
      const auto wanted = static_cast<std::uint32_t>(symbols.at(step.value));
      EXPECT_TRUE(std::ranges::any_of(
          writes, [&](const Write& write) { return of_object(write) && write.value == wanted; }));
      continue;
    }
    const auto wanted = static_cast<std::uint32_t>(std::stoul(step.value, nullptr, 0));
    const auto fits = [&](const Write& write) {
      return of_object(write) && (write.value & step.mask) == (wanted & step.mask);
    };
    // What stands there already is not written again; alternatives and the two parts of one step have no
    // order.
    const bool ordered = step.object == 0x604000 && step.alternative.empty() && step.block != "MC_STOP";
    const auto found = std::find_if(ordered ? from : writes.begin(), writes.end(), fits);
    EXPECT_NE(found, writes.end());
    if (ordered && found != writes.end()) from = found;
  }
  EXPECT_GT(checked, 0);
}

INSTANTIATE_TEST_SUITE_P(YssC, FunctionBlock, testing::ValuesIn(blocks),
                         [](const auto& info) { return std::string(info.param.name); });

TEST(FunctionBlocks, NoneIsLeftOut) {
  for (const auto& step : transcription())
    EXPECT_TRUE(std::ranges::any_of(blocks, [&](const Block& block) { return block.name == step.block; }))
        << step.block;
}

}  // namespace
}  // namespace axisd::test
