// Faults, memory, PDOs and NMT of the simulated standard drive.
#include <algorithm>

#include "tests/unit/devices/cia402_eds/standard_drive_bench.hpp"

namespace axisd::cia402_eds {
namespace {

TEST(StandardDrive, FaultsSwitchOffAndAreReported) {
  Bench bench;
  bench.enable(1);
  bench.move(100'000);
  bench.run(500ms);
  bench.drive().raise_alarm(0x2310);
  const auto sent = bench.run(1ms);
  const auto emergency = std::ranges::find(sent, 0x81U, &can::Frame::id);
  ASSERT_NE(emergency, sent.end());
  EXPECT_EQ(emergency->data[0] | emergency->data[1] << 8, 0x2310);
  EXPECT_EQ(emergency->data[2], 0x03);
  EXPECT_EQ(bench.status() & 0x4FU, 0x08U);
  EXPECT_EQ(bench.read(0x603F), 0x2310);
  EXPECT_EQ(bench.read(0x1003, 1), 0x2310);
  EXPECT_EQ(bench.velocity(), 0);
  bench.control(0x00);
  bench.control(0x80);
  EXPECT_EQ(bench.status() & 0x4FU, 0x40U);
  EXPECT_EQ(bench.read(0x603F), 0);
  bench.enable(1);
  bench.run(1s);
  EXPECT_EQ(bench.drive().starts(), 1) << "nothing resumes";
}

TEST(StandardDrive, ABlockedShaftIsAFollowingError) {
  Bench bench;
  bench.enable(1);
  bench.drive().block_shaft(true);
  bench.move(50'000);
  bench.run(2s);
  EXPECT_EQ(bench.read(0x603F), 0x8611);
  bench.drive().block_shaft(false);
  bench.control(0x80);
  bench.enable(1);
  bench.run(1s);
  EXPECT_EQ(bench.position(), 0) << "the controller takes over where the shaft stands";
  EXPECT_EQ(bench.drive().shaft_pulses(), 0);
  EXPECT_FALSE(bench.drive().push_shaft(10));
  bench.control(0x00);
  EXPECT_TRUE(bench.drive().push_shaft(10));
  EXPECT_EQ(bench.position(), 10);
}

TEST(StandardDrive, SavesAndRestoresWithSignatures) {
  constexpr std::int64_t save = 0x65766173, load = 0x64616F6C;
  Bench bench;
  const auto cycle = [&] {
    bench.drive().set_power(false);
    bench.run(100ms);
    bench.drive().set_power(true);
    bench.run(1s);
  };
  EXPECT_EQ(bench.write(0x6085, 4, 4'000), 0U);
  EXPECT_EQ(bench.write(0x60FF, 4, 4'000), 0U);
  EXPECT_EQ(bench.write(0x1010, 1, 4, load), 0x08000020U);
  cycle();
  EXPECT_EQ(bench.read(0x6085), 1'000'000);
  EXPECT_EQ(bench.drive().eeprom_writes(), 0U);
  EXPECT_EQ(bench.write(0x6085, 4, 4'000), 0U);
  EXPECT_EQ(bench.write(0x60FF, 4, 4'000), 0U);
  EXPECT_EQ(bench.write(0x1010, 1, 4, save), 0U);
  cycle();
  EXPECT_EQ(bench.read(0x6085), 4'000);
  EXPECT_EQ(bench.read(0x60FF), 0) << "commands are never stored";
  EXPECT_EQ(bench.write(0x1011, 1, 4, save), 0x08000020U);
  EXPECT_EQ(bench.write(0x1011, 1, 4, load), 0U);
  EXPECT_EQ(bench.read(0x6085), 4'000) << "valid with the next reset";
  cycle();
  EXPECT_EQ(bench.read(0x6085), 1'000'000);
  bench.enable(1);
  EXPECT_EQ(bench.write(0x1010, 1, 4, save), 0x08000022U);
}

TEST(StandardDrive, MapsPdosByTheProcedureOnly) {
  Bench bench;
  EXPECT_EQ(bench.write(0x1A00, 1, 4, 0x60640020), 0x08000022U) << "while it counts one entry";
  EXPECT_EQ(bench.write(0x1800, 1, 4, 0x80000181), 0U);
  EXPECT_EQ(bench.write(0x1A00, 0, 1, 0), 0U);
  EXPECT_EQ(bench.write(0x1A00, 1, 4, 0x60640010), 0x06040041U) << "half an object";
  EXPECT_EQ(bench.write(0x1A00, 1, 4, 0x605A0010), 0x06040041U) << "cannot be mapped";
  EXPECT_EQ(bench.write(0x1A00, 1, 4, 0x60640020), 0U);
  EXPECT_EQ(bench.write(0x1A00, 2, 4, 0x60410010), 0U);
  EXPECT_EQ(bench.write(0x1A00, 0, 1, 2), 0U);
  EXPECT_EQ(bench.write(0x1800, 2, 1, 1), 0U);
  EXPECT_EQ(bench.write(0x1800, 1, 4, 0x181), 0U);
  bench.put(0x000, {0x01, 0x01});
  bench.put(0x080, {});
  const auto sent = bench.run(2ms);
  const auto pdo = std::ranges::find(sent, 0x181U, &can::Frame::id);
  ASSERT_NE(pdo, sent.end());
  EXPECT_EQ(pdo->size, 6);
}

TEST(StandardDrive, BootsAndBeats) {
  Bench bench;
  EXPECT_EQ(bench.write(0x1017, 2, 100), 0U);
  const auto beats = bench.run(350ms);
  EXPECT_EQ(std::ranges::count(beats, 0x701U, &can::Frame::id), 3);
  bench.put(0x000, {0x81, 0x01});
  const auto boot = bench.run(1s);
  ASSERT_FALSE(boot.empty());
  EXPECT_EQ(boot.front().id, 0x701U);
  EXPECT_EQ(boot.front().data[0], 0);
  EXPECT_EQ(bench.read(0x1017), 0);
}

TEST(StandardDrive, SegmentsEveryUploadIfToldTo) {
  Bench bench({.switches = {{"segmented_uploads", true}}});
  EXPECT_EQ(bench.read_text(0x1009), "1.2");
  EXPECT_THROW(Bench({.switches = {{"no_such_switch", true}}}), std::invalid_argument);
  EXPECT_FALSE(switch_specs().empty());
}

}  // namespace
}  // namespace axisd::cia402_eds
