// The encoder of the simulated YSS-C: 6064h and 2002h waver, lag and settle, and 204Fh says when it is in
// position.
#include "tests/unit/devices/yss_c/simulator_fixture.hpp"

namespace axisd::yss_c {
namespace {

/// 10000 pulses and 4000 counts per revolution.
simulation::SimulatedNodeSettings noisy(int noise) {
  simulation::SimulatedNodeSettings settings;
  settings.encoder = {.noise = noise, .following = 8ms, .quantised = true, .compliance = 20};
  settings.eeprom[0x200600] = 13;
  return settings;
}

std::int32_t position(Bench& bench) { return static_cast<std::int32_t>(bench.drive().peek(0x606400)); }
std::int16_t velocity(Bench& bench) { return static_cast<std::int16_t>(bench.drive().peek(0x200200)); }
bool bit(Bench& bench, unsigned number) { return (bench.drive().peek(0x604100) >> number & 1U) != 0; }

/// 60 r/min to `target`, from Operation Enabled or before.
void move(Bench& bench, std::uint32_t target) {
  bench.put("601 2F 60 60 00 01 00 00 00");
  for (const auto* word : {"06", "07", "0F"}) bench.put(fmt::format("601 2B 40 60 00 {} 00 00 00", word));
  bench.drive().poke(0x607A00, target);
  bench.drive().poke(0x608100, 60);
  bench.put("601 2B 40 60 00 1F 00 00 00");
}

TEST(Encoder, MeasuresPositionAndVelocity) {
  Bench bench({}, noisy(2));
  move(bench, 10'000);
  bench.run(600ms);
  EXPECT_NEAR(bench.drive().shaft_pulses() - position(bench), 80, 8) << "behind in motion";
  EXPECT_NEAR(velocity(bench), 60, 1);
  while (bit(bench, 14)) bench.run(1ms);
  EXPECT_EQ(bench.drive().shaft_pulses(), 10'000);
  bench.run(100ms);
  int positions = 0, velocities = 0;
  for (int i = 0; i < 100; ++i) {
    bench.run(5ms);
    EXPECT_NEAR(position(bench), 10'000, 6);
    EXPECT_NEAR(velocity(bench), 0, 1);
    EXPECT_TRUE(bit(bench, 10));
    EXPECT_TRUE(bit(bench, 15));
    EXPECT_FALSE(bit(bench, 14));
    positions += position(bench) != 10'000 ? 1 : 0;
    velocities += velocity(bench) != 0 ? 1 : 0;
  }
  EXPECT_GT(positions, 50);
  EXPECT_GT(velocities, 40);
}

TEST(Encoder, InPositionIsWithinTheWindowOf204F) {
  auto settings = noisy(0);
  settings.encoder.following = 50ms;
  Bench bench({}, settings);
  move(bench, 10'000);
  while (bit(bench, 14)) bench.run(1ms);
  EXPECT_FALSE(bit(bench, 10)) << "still settling, off by " << 10'000 - position(bench);
  EXPECT_FALSE(bit(bench, 15));
  bench.run(500ms);
  EXPECT_TRUE(bit(bench, 10));
  EXPECT_TRUE(bench.drive().lean_on_shaft(11));
  EXPECT_FALSE(bit(bench, 10)) << "10 counts by default";
  bench.drive().poke(0x204F00, 11);
  EXPECT_TRUE(bit(bench, 15));
}

TEST(Encoder, AnOpenLoopHasNone) {
  Bench bench({}, noisy(2));
  bench.drive().poke(0x200700, 1);
  move(bench, 5000);
  bench.run(300ms);
  EXPECT_EQ(bench.drive().shaft_pulses(), position(bench));
  bench.run(5s);
  for (int i = 0; i < 20; ++i) {
    bench.run(5ms);
    EXPECT_EQ(position(bench), 5000);
    EXPECT_EQ(velocity(bench), 0);
    EXPECT_TRUE(bit(bench, 10));
  }
}

TEST(Encoder, ALoadTurnsAReleasedShaft) {
  auto settings = noisy(0);
  settings.encoder.slip = -1000;
  Bench bench({}, settings);
  bench.run(1s);
  EXPECT_NEAR(bench.drive().shaft_pulses(), -1000, 2);
  EXPECT_NEAR(position(bench), -1000, 3);
  for (const auto* word : {"06", "07", "0F"}) bench.put(fmt::format("601 2B 40 60 00 {} 00 00 00", word));
  const auto there = bench.drive().shaft_pulses();
  bench.run(1s);
  EXPECT_EQ(bench.drive().shaft_pulses(), there) << "held";
}

}  // namespace
}  // namespace axisd::yss_c
