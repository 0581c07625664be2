#include "tests/unit/devices/cia402_eds/standard_drive_bench.hpp"

namespace axisd::cia402_eds {
namespace {

simulation::SimulatedNodeSettings switched(const std::string& name) { return {.switches = {{name, true}}}; }

TEST(StandardDrive, SaysWhoItIs) {
  Bench bench;
  EXPECT_EQ(bench.read(0x1000), 0x00020192);
  EXPECT_EQ(bench.read(0x1018, 1), 0x0A5A);
  EXPECT_EQ(bench.read(0x1018, 2), 0x00402001);
  EXPECT_EQ(bench.read(0x1018, 4), 402017);
  EXPECT_EQ(bench.read_text(0x1008), "Standard servo 402");
  EXPECT_EQ(bench.read_text(0x1009), "1.2");
}

TEST(StandardDrive, GoesThroughItsStates) {
  Bench bench;
  EXPECT_EQ(bench.status() & 0x4FU, 0x40U);
  bench.control(0x06);
  EXPECT_EQ(bench.status() & 0x6FU, 0x21U);
  bench.control(0x0F);  // one step each
  EXPECT_EQ(bench.status() & 0x6FU, 0x23U);
  bench.control(0x0F);
  EXPECT_EQ(bench.status() & 0x6FU, 0x27U);
  bench.control(0x07);
  EXPECT_EQ(bench.status() & 0x6FU, 0x23U);
  bench.control(0x0F);
  bench.control(0x00);
  EXPECT_EQ(bench.status() & 0x4FU, 0x40U);
  EXPECT_EQ(bench.status() & 0xC100U, 0U) << "bits of a maker";
}

TEST(StandardDrive, MovesWithRates) {
  Bench bench;
  bench.enable(1);
  bench.move(10'000);  // 10,000 inc/s, 100,000 inc/s^2: 0.1 s of ramps and 0.9 s between them
  EXPECT_TRUE(bench.bit(12));
  EXPECT_FALSE(bench.bit(10));
  bench.run(500ms);
  EXPECT_EQ(bench.velocity(), 10'000);
  bench.run(550ms);
  EXPECT_FALSE(bench.bit(10));
  bench.run(60ms);
  EXPECT_EQ(bench.position(), 10'000);
  bench.run(5ms);  // 6068h
  EXPECT_TRUE(bench.bit(10));
  bench.control(0x0F);
  EXPECT_FALSE(bench.bit(12));
  bench.move(-4'000, 0x40);
  bench.run(2s);
  EXPECT_EQ(bench.position(), 6'000);
  EXPECT_EQ(bench.drive().starts(), 2);
}

TEST(StandardDrive, BuffersOneSetPointOrTakesItAtOnce) {
  for (const bool at_once : {false, true}) {
    Bench bench;
    bench.enable(1);
    bench.move(10'000);
    bench.run(300ms);
    bench.move(20'000, at_once ? 0x20 : 0);
    EXPECT_TRUE(bench.bit(12));
    bench.control(0x0F);
    EXPECT_EQ(bench.bit(12), !at_once) << "the buffer is full until the first is reached";
    bench.run(3s);
    EXPECT_EQ(bench.position(), 20'000);
    EXPECT_FALSE(bench.bit(12));
    bench.move(500, 0x20);
    bench.run(100ms);
    bench.move(25'000, 0x20);  // turns round
    bench.run(5s);
    EXPECT_EQ(bench.position(), 25'000);
  }
}

TEST(StandardDrive, HaltSuspendsASetPointOrDropsIt) {
  for (const bool drops : {false, true}) {
    Bench bench({.switches = {{"halt_release_drops", drops}}});
    bench.enable(1);
    bench.move(20'000);
    bench.run(500ms);
    bench.control(0x11F);
    bench.run(500ms);
    EXPECT_EQ(bench.velocity(), 0);
    EXPECT_TRUE(bench.bit(10)) << "velocity is 0";
    const auto halted = bench.position();
    bench.control(0x0F);
    bench.run(5s);
    EXPECT_EQ(bench.position(), drops ? halted : 20'000);
  }
}

TEST(StandardDrive, RunsAtTheTargetVelocityAsLongAsItIsEnabled) {
  Bench bench;
  EXPECT_EQ(bench.write(0x60FF, 4, 5'000), 0U);
  bench.enable(3);
  bench.run(500ms);
  EXPECT_EQ(bench.velocity(), 5'000) << "left over from before";
  EXPECT_TRUE(bench.bit(10));
  EXPECT_FALSE(bench.bit(12));
  EXPECT_EQ(bench.write(0x60FF, 4, -8'000), 0U);
  bench.run(1s);
  EXPECT_EQ(bench.velocity(), -8'000);
  bench.control(0x10F);
  bench.run(1s);
  EXPECT_EQ(bench.velocity(), 0);
  EXPECT_TRUE(bench.bit(12));
  bench.control(0x0F);
  bench.run(1s);
  EXPECT_EQ(bench.velocity(), -8'000) << "halt only interrupts";
  EXPECT_EQ(bench.write(0x60FF, 4, 0), 0U);
  bench.run(1s);
  EXPECT_EQ(bench.velocity(), 0);
}

TEST(StandardDrive, QuickStopEndsAsItsOptionSays) {
  for (const int option : {0, 1, 2, 5, 6}) {
    SCOPED_TRACE(option);
    Bench bench;
    EXPECT_EQ(bench.write(0x605A, 2, option), 0U);
    bench.enable(1);
    bench.move(1'000'000);
    bench.run(1s);
    const auto before = bench.position();
    bench.control(0x0B);
    EXPECT_EQ(bench.status() & 0x6FU, option == 0 ? 0x40U : 0x07U);
    bench.run(500ms);
    // 10,000 inc/s: 500 increments with 6084h, 50 with 6085h.
    const auto way = bench.position() - before;
    EXPECT_NEAR(way, option == 1 || option == 5 ? 500 : option == 0 ? 0 : 50, 20);
    EXPECT_EQ(bench.status() & 0x6FU, option >= 5 ? 0x07U : 0x40U);
    if (option >= 5) bench.control(0x0F);
    if (option >= 5) EXPECT_EQ(bench.status() & 0x6FU, 0x27U);
    EXPECT_EQ(bench.velocity(), 0);
  }
  Bench bench;
  EXPECT_EQ(bench.write(0x605A, 2, 3), 0x06090030U);
}

TEST(StandardDrive, SoftwareLimitsShortenMotions) {
  Bench bench;
  EXPECT_EQ(bench.write(0x607D, 2, 4, 5'000), 0U);
  bench.enable(1);
  bench.move(8'000);
  bench.run(3s);
  EXPECT_EQ(bench.position(), 5'000);
  EXPECT_TRUE(bench.bit(11));
  EXPECT_FALSE(bench.bit(10)) << "that is not the target";
  bench.move(0);
  bench.run(3s);
  EXPECT_EQ(bench.position(), 0);
  EXPECT_FALSE(bench.bit(11));
  EXPECT_EQ(bench.write(0x6060, 1, 3), 0U);
  EXPECT_EQ(bench.write(0x60FF, 4, 4'000), 0U);
  bench.run(5s);
  EXPECT_EQ(bench.position(), 5'000);
  EXPECT_TRUE(bench.bit(11));
}

TEST(StandardDrive, LimitSwitchesBrakeAndBlockOneDirection) {
  for (const bool ramp : {false, true}) {
    auto settings = with_switches();
    settings.switches["limit_stops_on_ramp"] = ramp;
    Bench bench(settings);
    bench.enable(1);
    bench.move(100'000);
    bench.run(10s);
    EXPECT_NEAR(bench.position(), ramp ? 50'500 : 50'050, 20);
    EXPECT_EQ(bench.read(0x60FD), 2);
    EXPECT_TRUE(bench.bit(11));
    EXPECT_EQ(bench.status() & 0x6FU, 0x27U);
    const auto there = bench.position();
    bench.move(200'000);
    bench.run(1s);
    EXPECT_EQ(bench.position(), there);
    bench.move(0);
    bench.run(10s);
    EXPECT_EQ(bench.position(), 0);
    EXPECT_EQ(bench.read(0x60FD), 0);
  }
}

TEST(StandardDrive, AfterALimitVelocityWaitsForTheSwitchOrForANewValue) {
  for (const bool resumes : {false, true}) {
    Bench bench({.switches = {{"velocity_resumes_after_limit", resumes}}});
    bench.enable(3);
    EXPECT_EQ(bench.write(0x60FF, 4, 5'000), 0U);
    bench.run(500ms);
    bench.drive().set_input("POS", true);
    bench.run(500ms);
    EXPECT_EQ(bench.velocity(), 0);
    bench.drive().set_input("POS", false);
    bench.run(500ms);
    EXPECT_EQ(bench.velocity(), resumes ? 5'000 : 0);
    EXPECT_EQ(bench.write(0x60FF, 4, 4'000), 0U);
    bench.run(500ms);
    EXPECT_EQ(bench.velocity(), 4'000);
  }
}

TEST(StandardDrive, ASetPointInHaltWaitsOrIsRefused) {
  for (const bool refused : {false, true}) {
    Bench bench({.switches = {{"set_point_in_halt_refused", refused}}});
    bench.enable(1);
    bench.control(0x10F);
    EXPECT_EQ(bench.write(0x607A, 4, 3'000), 0U);
    bench.control(0x11F);
    EXPECT_EQ(bench.bit(12), !refused);
    bench.run(1s);
    EXPECT_EQ(bench.position(), 0);
    bench.control(0x1F);
    bench.run(2s);
    EXPECT_EQ(bench.position(), refused ? 0 : 3'000);
  }
}

TEST(StandardDrive, VelocityAfterAHaltComesBackOrWaits) {
  Bench bench(switched("halt_release_keeps_velocity_at_0"));
  bench.enable(3);
  EXPECT_EQ(bench.write(0x60FF, 4, 2'000), 0U);
  bench.run(500ms);
  bench.control(0x10F);
  bench.run(500ms);
  bench.control(0x0F);
  bench.run(500ms);
  EXPECT_EQ(bench.velocity(), 0);
  EXPECT_EQ(bench.write(0x60FF, 4, 2'000), 0U);
  bench.run(500ms);
  EXPECT_EQ(bench.velocity(), 2'000);
}

}  // namespace
}  // namespace axisd::cia402_eds
