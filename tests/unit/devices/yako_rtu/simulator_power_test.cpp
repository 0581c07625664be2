// Power cycle, EEPROM rules (6.1), alarms and their reset rules (chapter 8).
#include "tests/unit/devices/yako_rtu/simulator_fixture.hpp"

namespace axisd::yako_rtu {
namespace {

TEST(SimulatorPower, APowerCycleLosesRamPositionAndHoming) {
  Bench bench;
  bench.move(3000, true, 120);
  bench.wait(10s);
  EXPECT_EQ(3000, bench.position());
  bench.power_cycle();
  EXPECT_EQ(0, bench.position());
  EXPECT_EQ(3000, bench.drive().shaft_pulses()) << "the shaft stays where it is";
  EXPECT_EQ(60, bench.reg(reg::maximum_speed));
  EXPECT_EQ(5000, bench.reg(reg::pulses_low));
  EXPECT_FALSE(bench.status(0));
  EXPECT_FALSE(bench.status(1));
}

TEST(SimulatorPower, IsSilentWhileOffAndWhileItBoots) {
  Bench bench;
  bench.velocity(60);
  bench.wait(1s);
  bench.drive().set_power(false);
  EXPECT_FALSE(bench.drive().shaft_moving());
  EXPECT_EQ(-1, bench.read(reg::status));
  bench.wait(10ms);
  bench.drive().set_power(true);
  bench.wait(299ms);
  EXPECT_EQ(-1, bench.read(reg::status));
  bench.wait(1ms);
  EXPECT_EQ(0, bench.read(reg::status));
  EXPECT_FALSE(bench.drive().shaft_moving());
}

TEST(SimulatorPower, IsEnabledAtPowerUpByItsSwitch) {
  for (const bool enabled : {false, true}) {
    Bench bench{with_switch("enabled_at_power_up", enabled)};
    EXPECT_EQ(!enabled, bench.status(4));
    bench.write(reg::enable, enabled ? 0 : 1);
    EXPECT_EQ(enabled, bench.status(4));
    bench.power_cycle();
    EXPECT_EQ(!enabled, bench.status(4));
  }
}

TEST(SimulatorPower, StartsWithItsEeprom) {
  simulation::SimulatedNodeSettings settings;
  settings.eeprom = {{reg::microstep, 13}, {reg::eeprom_update, 1}};
  Bench bench{settings};
  EXPECT_EQ(13, bench.reg(reg::microstep));
  bench.write(reg::microstep, 4);
  bench.power_cycle();
  EXPECT_EQ(13, bench.reg(reg::microstep)) << "not saved while 0x0016 is 1";
}

TEST(SimulatorEeprom, EveryWriteToASavedRegisterIsSavedAndCounted) {
  Bench bench;
  bench.write(reg::microstep, 4);
  bench.write(reg::microstep, 4);
  bench.write(reg::start_speed, 7);
  EXPECT_EQ(2U, bench.drive().eeprom_writes());
  bench.power_cycle();
  EXPECT_EQ(4, bench.reg(reg::microstep));
  EXPECT_EQ(5, bench.reg(reg::start_speed));
}

TEST(SimulatorEeprom, WithTheUpdateOffNothingIsSaved) {
  for (const bool saves_itself : {false, true}) {
    Bench bench{with_switch("eeprom_switch_saves_itself", saves_itself)};
    bench.write(reg::eeprom_update, 1);
    bench.write(reg::microstep, 4);
    EXPECT_EQ(saves_itself ? 1U : 0U, bench.drive().eeprom_writes());
    EXPECT_EQ(4, bench.reg(reg::microstep));
    bench.power_cycle();
    EXPECT_EQ(8, bench.reg(reg::microstep));
    EXPECT_EQ(saves_itself ? 1 : 0, bench.reg(reg::eeprom_update));
  }
}

TEST(SimulatorEeprom, PvSpeedsAreSavedAnywayByTheirSwitch) {
  for (const bool always : {false, true}) {
    Bench bench{with_switch("pv_speeds_always_saved", always)};
    bench.write(reg::eeprom_update, 1);
    bench.write(reg::segment_pv_speed, 90);
    bench.power_cycle();
    EXPECT_EQ(always ? 90 : 0, bench.reg(reg::segment_pv_speed));
  }
}

TEST(SimulatorEeprom, SaveAllKeepsTheMotionParametersToo) {
  Bench bench;
  bench.write_block(reg::start_speed, {9, 50, 60, 70, 0, 800});
  bench.write(reg::parameter_setting, 2);
  bench.power_cycle();
  EXPECT_EQ(9, bench.reg(reg::start_speed));
  EXPECT_EQ(800, bench.reg(reg::pulses_low));
}

TEST(SimulatorEeprom, FactoryResetRestoresRamAndEeprom) {
  simulation::SimulatedNodeSettings settings;
  settings.address = 40;
  Bench bench{settings};
  auto& drive = bench.drive();
  EXPECT_EQ(40, drive.address());
  drive.advance(TimePoint{1s});
  Bytes frame{40, 6, 0, 0x2B, 0, 1};
  simulation::append_frame_crc(frame);
  EXPECT_TRUE(drive.on_frame(frame));
  EXPECT_EQ(0, drive.peek(reg::custom_node));
  EXPECT_EQ(40, drive.address()) << "until the next power-up";
  drive.set_power(false);
  drive.set_power(true);
  drive.advance(TimePoint{2s});
  EXPECT_EQ(0, drive.address()) << "0..31 are undefined with the DIP switches off: nobody answers";
  EXPECT_FALSE(drive.on_frame(frame));
}

TEST(SimulatorAlarms, StopTheMotorAndAreShown) {
  for (int code = 1; code <= 5; ++code) {
    Bench bench;
    bench.write(reg::first_output_function, 1);
    bench.velocity(300);
    bench.wait(1s);
    bench.drive().raise_alarm(code);
    EXPECT_EQ(code, bench.reg(reg::alarm));
    EXPECT_TRUE(bench.status(3));
    EXPECT_EQ(1, bench.reg(reg::outputs) & 1);
    EXPECT_EQ(0, bench.reg(reg::moving));
    EXPECT_EQ(0, bench.move(100)) << "acknowledged, ignored";
    EXPECT_EQ(0, bench.reg(reg::moving));
  }
}

TEST(SimulatorAlarms, ResetAsChapter8Says) {
  struct Rule {
    int code;
    bool by_itself, by_command, by_power;
  };
  for (const auto& rule :
       {Rule{1, false, false, true}, Rule{2, true, false, false}, Rule{3, true, false, false},
        Rule{4, false, true, true}, Rule{5, false, false, true}}) {
    Bench gone, command, power;
    gone.drive().raise_alarm(rule.code);
    gone.drive().raise_alarm(0);
    EXPECT_EQ(rule.by_itself ? 0 : rule.code, gone.reg(reg::alarm));
    command.drive().raise_alarm(rule.code);
    command.write(reg::alarm_clear, 1);
    EXPECT_EQ(rule.by_command ? 0 : rule.code, command.reg(reg::alarm));
    power.drive().raise_alarm(rule.code);
    power.power_cycle();
    EXPECT_EQ(rule.by_power ? 0 : rule.code, power.reg(reg::alarm)) << "2 and 3: the voltage is still wrong";
  }
}

TEST(SimulatorAlarms, LockTheMotorUnlessTheSwitchReleasesIt) {
  for (const bool releases : {false, true}) {
    Bench bench{with_switch("alarm_releases", releases)};
    bench.drive().raise_alarm(2);
    EXPECT_EQ(releases, bench.status(4));
    bench.drive().raise_alarm(0);
    EXPECT_EQ(releases, bench.status(4)) << "nothing enables it again";
  }
}

}  // namespace
}  // namespace axisd::yako_rtu
