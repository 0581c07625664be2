// Homing (6.2.6): what each switch decides.
#include "tests/unit/devices/yss_c/simulator_switch_readings.hpp"

namespace axisd::yss_c {
namespace {

std::int64_t end_of_29(Bench& bench) {
  bench.enable(1);
  bench.move(3000);
  bench.run(5s);
  bench.control(0x0F);
  home_with(bench, 29);
  bench.run(20s);
  return bench.drive().shaft_pulses();
}

const Reading readings[] = {
    {"homing_codes_cia", [](Bench& b) { return std::int64_t{b.write(0x6098, 1, 17)}; }, 0x06090030, 0},
    {"homing_codes_0_to_3", [](Bench& b) { return std::int64_t{b.write(0x6098, 1, 2)}; }, 0x06090030, 0},
    {"homing_29_ends_backwards", &end_of_29, 1000, 1200, with(home)},
    {"homing_accepts_active_switch",
     [](Bench& b) {
       home_with(b, 24);
       return homed(b);
     },
     0, 1, with({.home_switch_from = -100, .home_switch_to = 100})},
    {"homing_goes_on_after_start_bit",
     [](Bench& b) {
       home_with(b, 24);
       b.control(0x0F);
       return homed(b);
     },
     0, 1, with(home)},
    {"offset_without_move",
     [](Bench& b) {
       b.write(0x607C, 4, 300);
       home_with(b, 24);
       b.run(20s);
       return b.drive().shaft_pulses() * 10000 + b.position();
     },
     13000000, 9999700, with(home)},
    {"homed_stays_during_homing",
     [](Bench& b) {
       home_with(b, 24);
       EXPECT_EQ(1, homed(b));
       b.control(0x0F);
       b.control(0x1F);
       return std::int64_t{b.bit(8)};
     },
     0, 1, with(home)},
    {"homing_pauses",
     [](Bench& b) {
       home_with(b, 24);
       std::int64_t rests = 0;
       for (int i = 0; i < 400 && !b.bit(8); ++i) {
         b.run(50ms);
         if (!b.drive().shaft_moving() && !b.bit(8)) rests = 1;
       }
       EXPECT_TRUE(b.bit(8));
       return rests;
     },
     0, 1, with(home)},
};

}  // namespace

std::span<const Reading> homing_readings() { return readings; }

}  // namespace axisd::yss_c
