// Motion and its ends: halt, quick stop, release, alarms: what each switch decides.
#include "tests/unit/devices/yss_c/simulator_switch_readings.hpp"

namespace axisd::yss_c {
namespace {

std::int64_t halt_and_release(Bench& bench) {
  bench.enable(1);
  bench.move(5000);
  bench.run(1s);
  bench.control(0x10F);
  bench.run(1s);
  bench.control(0x0F);
  return moving(bench);
}
/// Still moving 20 ms after a quick stop that came into the ramp of a stop.
std::int64_t quick_stop_in_ramp(Bench& bench) {
  bench.enable(1);
  bench.write(0x6084, 4, 2000);
  bench.move(50000);
  bench.run(1s);
  bench.control(0x10F);
  bench.run(100ms);
  EXPECT_EQ(1, moving(bench));
  bench.write(0x605D, 2, 1);
  bench.control(0x10F);
  bench.run(20ms);
  EXPECT_EQ(1, moving(bench)) << "bit 8 has no edge";
  bench.write(0x6060, 1, 3);
  bench.control(0x0F);
  bench.control(0x10F);
  bench.run(20ms);
  return moving(bench);
}

const Reading readings[] = {
    {"halt_edge_cuts_ramp", &quick_stop_in_ramp, 1, 0},
    {"halt_release_resumes", &halt_and_release, 0, 1},
    {"halt_release_restarts_velocity",
     [](Bench& b) {
       run_velocity(b, 60);
       b.control(0x10F);
       b.run(1s);
       EXPECT_EQ(0, moving(b));
       b.control(0x0F);
       return moving(b);
     },
     0, 1},
    {"velocity_cleared_on_disable",
     [](Bench& b) {
       run_velocity(b, 60);
       b.control(0x06);
       return b.read(0x60FF);
     },
     60, 0},
    {"mode_change_keeps_setpoint",
     [](Bench& b) {
       b.enable(1);
       b.move(5000);
       b.run(1s);
       b.control(0x10F);
       b.run(1s);
       b.write(0x6060, 1, 3);
       b.write(0x6060, 1, 1);
       b.control(0x0F);
       return moving(b);
     },
     0, 1},
    {"setpoint_in_motion_ignored",
     [](Bench& b) {
       b.enable(1);
       b.move(5000);
       b.control(0x2F);
       b.control(0x7F);
       return std::int64_t{b.bit(12)};
     },
     1, 0},
    {"start_of_enabled_edge",
     [](Bench& b) {
       b.write(0x6060, 1, 1);
       b.control(6);
       b.control(7);
       b.control(0x5F);
       return starts(b);
     },
     0, 1},
    {"position_clear_in_motion",
     [](Bench& b) {
       b.enable(1);
       b.move(5000);
       b.run(1s);
       b.write(0x2012, 2, 1);
       return std::int64_t{b.position() < 100};
     },
     0, 1},
    {"quick_stop_releases",
     [](Bench& b) {
       b.enable(1);
       b.control(0x0B);
       return std::int64_t{b.status() & 0x206F};
     },
     0x2007, 0x40},
    {"disable_operation_cuts",
     [](Bench& b) {
       run_velocity(b, 60);
       b.control(0x07);
       return moving(b);
     },
     1, 0},
    {"release_keeps_state",
     [](Bench& b) {
       b.enable(1);
       b.write(0x200F, 2, 0);
       return std::int64_t{b.status() & 0x206F};
     },
     0x60, 0x27},
    {"free_stop_releases",
     [](Bench& b) {
       b.assign(0, 2);
       run_velocity(b, 60);
       b.run(3s);
       return std::int64_t{b.bit(13)};
     },
     1, 0, with({.positive_limit_from = 1000})},
    {"abrupt_stop_slips",
     [](Bench& b) {
       b.write(0x2007, 2, 1);
       b.assign(0, 2);
       run_velocity(b, 600);
       b.run(3s);
       return b.drive().shaft_pulses() - b.position();
     },
     0, 100, with({.positive_limit_from = 5000})},
    {"alarm_keeps_torque",
     [](Bench& b) {
       b.enable(1);
       b.drive().raise_alarm(4);
       return std::int64_t{b.bit(13)};
     },
     0, 1},
    {"fault_needs_reset",
     [](Bench& b) {
       b.drive().raise_alarm(3);
       b.drive().raise_alarm(0);
       const auto shown = b.read(0x603F);
       b.control(0x80);
       EXPECT_EQ(0, b.read(0x603F));
       return shown;
     },
     0, 0xFF03},
};

}  // namespace

std::span<const Reading> motion_readings() { return readings; }

}  // namespace axisd::yss_c
