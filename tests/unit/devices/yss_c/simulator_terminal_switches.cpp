// Terminals: what each switch decides.
#include "tests/unit/devices/yss_c/simulator_switch_readings.hpp"

namespace axisd::yss_c {
namespace {

void start_by_terminal(Bench& bench, int function) {
  bench.assign(0, function);
  bench.drive().set_input("X0", true);
  bench.run(100ms);
}

const Reading readings[] = {
    {"velocity_resumes_after_terminal",
     [](Bench& b) {
       b.assign(1, 8);
       run_velocity(b, 60);
       b.drive().set_input("X1", true);
       b.run(3s);
       EXPECT_FALSE(b.drive().shaft_moving());
       b.drive().set_input("X1", false);
       b.run(500ms);
       return moving(b);
     },
     0, 1},
    {"terminals_need_operation",
     [](Bench& b) {
       b.write(0x200F, 2, 1);
       start_by_terminal(b, 10);
       return starts(b);
     },
     1, 0},
    {"stop_terminal_only_edge",
     [](Bench& b) {
       start_by_terminal(b, 8);
       b.enable(1);
       b.move(100);
       return starts(b);
     },
     0, 1},
    {"speed_terminal_is_level",
     [](Bench& b) {
       b.write(0x60FF, 4, 60);
       b.write(0x200F, 2, 1);
       start_by_terminal(b, 11);
       EXPECT_EQ(1, moving(b));
       b.drive().set_input("X0", false);
       b.run(1s);
       return moving(b);
     },
     1, 0},
    {"configuration_makes_edges",
     [](Bench& b) {
       b.write(0x200F, 2, 1);
       b.drive().set_input("X0", true);
       b.run(100ms);
       b.assign(0, 10);
       b.run(100ms);
       return starts(b);
     },
     0, 1},
    {"filter_home_and_limits",
     [](Bench& b) {
       b.assign(0, 2);
       run_velocity(b, 60);
       b.run(3s);
       return b.drive().shaft_pulses();
     },
     1000, 1010, with({.positive_limit_from = 1000})},
    {"inputs_undefined_at_power_up",
     [](Bench& b) {
       b.assign(0, 2);
       return after_power_cycle(b, 0x2030, 2);
     },
     2, 0},
    {"states_are_levels",
     [](Bench& b) {
       b.write(0x2030, 0x01, 2, 0b1001);  // X0 and X3 active low
       b.write(0x2030, 0x0C, 2, 0b10);    // Y1 likewise
       b.drive().set_input("X0", true);   // high; X3 is open, low
       b.run(100ms);
       return b.read(0x2003) << 4 | b.read(0x2004);
     },
     0b1000 << 4 | 0b00, 0b0001 << 4 | 0b10},
};

}  // namespace

std::span<const Reading> terminal_readings() { return readings; }

}  // namespace axisd::yss_c
