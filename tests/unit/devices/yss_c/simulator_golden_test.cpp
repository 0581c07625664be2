// Every example frame of the manual (tests/golden/yss-c.frames), played to the simulator byte for byte, in
// its order.
#include <fstream>

#include "tests/support/source_tree.hpp"
#include "tests/unit/devices/yss_c/simulator_fixture.hpp"

namespace axisd::yss_c {
namespace {

struct Exchange {
  std::string section, request, reply, status;
};

std::vector<Exchange> read_exchanges() {
  std::ifstream file(test::in_source_tree("tests/golden/yss-c.frames"));
  std::vector<Exchange> all;
  for (std::string line; std::getline(file, line);) {
    if (line.starts_with("# section: "))
      all.push_back({.section = line.substr(11), .request = {}, .reply = {}, .status = {}});
    if (line.starts_with("# status: ")) all.back().status = line.substr(10);
    if (line.starts_with("> ")) all.back().request = line.substr(2);
    if (line.starts_with("< ")) all.back().reply = line.substr(2);
  }
  return all;
}

bool fits(std::uint16_t status, std::string_view pattern) {
  for (std::size_t i = 0; i < 16; ++i)
    if (pattern[i] != 'x' && (pattern[i] == '1') != ((status >> (15 - i) & 1) != 0)) return false;
  return true;
}

/// Plays the exchanges of one chapter; the number of them.
int play(Bench& bench, std::string_view chapter) {
  int played = 0;
  for (const auto& one : read_exchanges()) {
    if (!one.section.starts_with(chapter)) continue;
    SCOPED_TRACE(one.section);
    EXPECT_EQ(one.reply.empty() ? "silence" : one.reply, bench.ask(one.request));
    if (!one.status.empty()) {
      const auto status = bench.status();
      EXPECT_TRUE(fits(status, one.status)) << status;
    }
    ++played;
  }
  return played;
}

TEST(GoldenFrames, InitialisationEndsInOperationEnabled) {
  Bench bench;
  EXPECT_EQ(5, play(bench, "6.2.2"));
  EXPECT_EQ(0x27, bench.status() & 0x6F);
  EXPECT_TRUE(bench.bit(13));
  EXPECT_EQ(0, bench.drive().starts());
}

TEST(GoldenFrames, RelativeMoveTurnsBy5000) {
  Bench bench;
  play(bench, "6.2.2");
  EXPECT_EQ(8, play(bench, "6.2.4"));
  EXPECT_EQ(1, bench.drive().starts());
  EXPECT_TRUE(bench.drive().shaft_moving());
  bench.run(6s);
  EXPECT_EQ(5000, bench.position());
  EXPECT_TRUE(bench.bit(10) && bench.bit(15) && !bench.bit(14));
}

TEST(GoldenFrames, SpeedModeStartsWithItsLastFrame) {
  Bench bench;
  EXPECT_EQ(9, play(bench, "6.2.5"));
  EXPECT_EQ(1, bench.drive().starts());
  bench.run(1s);
  EXPECT_EQ(60, bench.read(0x2002));
  EXPECT_TRUE(bench.bit(14) && bench.bit(10) && !bench.bit(12));
}

TEST(GoldenFrames, HomingEndsAtTheSwitch) {
  simulation::SimulatedNodeSettings settings;
  settings.mechanics = {.home_switch_from = 3000, .home_switch_to = 3400, .positive_limit_from = 9000};
  Bench bench({}, settings);
  bench.assign(0, 1);
  bench.assign(1, 2);
  EXPECT_EQ(11, play(bench, "6.2.6"));
  EXPECT_EQ(1, bench.drive().starts());
  bench.run(10s);
  EXPECT_TRUE(bench.bit(8) && bench.bit(10) && bench.bit(12));
  EXPECT_EQ(0, bench.position());
  EXPECT_EQ(3000, bench.drive().shaft_pulses());
}

}  // namespace
}  // namespace axisd::yss_c
