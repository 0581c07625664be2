// Every example frame that a manual prints (tests/golden, transcribed by reading), played to the simulator of
// its model, byte for byte.
#include <fstream>

#include "tests/support/source_tree.hpp"
#include "tests/unit/devices/yako_rtu/simulator_fixture.hpp"

namespace axisd::yako_rtu {
namespace {

struct Exchange {
  std::string section, state, request, reply;
  std::string misprint;  ///< the request as printed, where it is wrong
};

/// The format is described at the head of each file.
std::vector<Exchange> read_exchanges(std::string_view model) {
  std::ifstream file(test::in_source_tree("tests/golden/") + std::string(model) + ".frames");
  std::vector<Exchange> all;
  for (std::string line; std::getline(file, line);) {
    const std::string_view text = line;
    if (text.starts_with("# section: "))
      all.push_back({.section = line.substr(11), .state = {}, .request = {}, .reply = {}, .misprint = {}});
    else if (text.starts_with("# state: "))
      all.back().state = line.substr(9);
    else if (text.starts_with("> "))
      all.back().request = line.substr(2);
    else if (text.starts_with("< "))
      all.back().reply = line.substr(2);
    else if (text.starts_with("!> "))
      all.back().misprint = line.substr(3);
    else
      EXPECT_TRUE(text.empty() || text.starts_with('#') || text.starts_with("!< ")) << line;
  }
  return all;
}

/// A new drive has its defaults, is enabled, at rest and without alarm. False: `state` says something else.
bool bring_about(Bench& bench, std::string_view state) {
  constexpr std::string_view as_new[] = {"",
                                         "0x0020 = 5, 0x0021 = 100, 0x0022 = 100, 0x0023 = 60 (defaults)",
                                         "0x0023 = 60 (default)",
                                         "motor at rest again",
                                         "motor enabled and at rest, no alarm",
                                         "the request is broken on purpose (sound CRC 85 C0)"};
  if (std::ranges::find(as_new, state) != std::end(as_new)) return true;
  if (state.starts_with("motor moving")) {
    bench.velocity(60);
    return bench.drive().shaft_moving();
  }
  if (!state.ends_with("a terminal has the home signal (mode 0)")) return false;
  bench.assign("X0", Input::home);
  return true;
}

class GoldenFile : public ::testing::TestWithParam<std::string_view> {};

TEST_P(GoldenFile, IsAnsweredAsPrinted) {
  const auto exchanges = read_exchanges(GetParam());
  EXPECT_GE(exchanges.size(), 25U);
  for (const auto& one : exchanges) {
    SCOPED_TRACE(one.section);
    Bench bench({}, GetParam());
    ASSERT_TRUE(bring_about(bench, one.state)) << one.state;
    ASSERT_FALSE(one.request.empty() && one.misprint.empty());
    // What is sound stands in the lines without a mark; an exchange without them gets no answer.
    if (one.request.empty())
      EXPECT_EQ("silence", bench.send(one.misprint));
    else
      EXPECT_EQ(one.reply, bench.send(one.request));
  }
}

INSTANTIATE_TEST_SUITE_P(Manual, GoldenFile, ::testing::Values("ykd2405pr", "ssd2608pr", "ess42-r"));

}  // namespace
}  // namespace axisd::yako_rtu
