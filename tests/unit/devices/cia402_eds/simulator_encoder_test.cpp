// The encoder of the simulated standard drive: 6064h and 606Ch waver, lag and settle; 6062h and 60F4h beside
// them; 6067h and 6068h say when it is in position.
#include "tests/unit/devices/cia402_eds/standard_drive_bench.hpp"

namespace axisd::cia402_eds {
namespace {

simulation::SimulatedNodeSettings noisy(int noise) {
  simulation::SimulatedNodeSettings settings;
  settings.encoder = {.noise = noise, .following = 8ms, .quantised = true, .compliance = 20};
  return settings;
}

TEST(Encoder, MeasuresPositionAndVelocity) {
  Bench bench(noisy(2));
  bench.enable(1);
  bench.move(10'000);
  bench.run(600ms);
  const auto behind = bench.drive().shaft_pulses() - bench.position();
  EXPECT_NEAR(behind, 80, 16) << "behind in motion";
  EXPECT_NEAR(static_cast<std::int32_t>(bench.read(0x60F4)), 80, 3);
  EXPECT_NEAR(bench.velocity(), 10'000, 17);
  bench.run(2s);
  EXPECT_EQ(bench.drive().shaft_pulses(), 10'000);
  EXPECT_EQ(bench.read(0x6062), 10'000) << "where it wants the shaft";
  int positions = 0, velocities = 0;
  for (int i = 0; i < 100; ++i) {
    bench.run(5ms);
    EXPECT_NEAR(bench.position(), 10'000, 2);
    EXPECT_NEAR(bench.velocity(), 0, 17) << "1 r/min of 1000 increments";
    EXPECT_TRUE(bench.bit(10));
    positions += bench.position() != 10'000 ? 1 : 0;
    velocities += bench.velocity() != 0 ? 1 : 0;
  }
  EXPECT_GT(positions, 50);
  EXPECT_GT(velocities, 40);
}

TEST(Encoder, ReachesTheTargetWhenItHasBeenInTheWindowForAWhile) {
  auto settings = noisy(0);
  settings.encoder.following = 50ms;
  Bench bench(settings);
  EXPECT_EQ(bench.write(0x6068, 2, 100), 0U);
  bench.enable(1);
  bench.move(10'000);
  while (bench.drive().shaft_moving()) bench.run(1ms);
  EXPECT_FALSE(bench.bit(10));
  while (std::abs(10'000 - bench.position()) > 10) bench.run(1ms);
  bench.run(80ms);
  EXPECT_FALSE(bench.bit(10));
  bench.run(30ms);
  EXPECT_TRUE(bench.bit(10));
  bench.run(1s);
  EXPECT_TRUE(bench.drive().lean_on_shaft(11));
  EXPECT_FALSE(bench.bit(10)) << "beyond 6067h";
  EXPECT_FALSE(bench.drive().lean_on_shaft(21)) << "held";
}

TEST(Encoder, ALoadTurnsAReleasedShaft) {
  auto settings = noisy(0);
  settings.encoder.slip = 1000;
  Bench bench(settings);
  bench.run(1s);
  EXPECT_NEAR(bench.drive().shaft_pulses(), 1000, 2);
  EXPECT_NEAR(bench.position(), 1000, 3);
  bench.enable(1);
  const auto there = bench.drive().shaft_pulses();
  bench.run(1s);
  EXPECT_EQ(bench.drive().shaft_pulses(), there);
}

}  // namespace
}  // namespace axisd::cia402_eds
