// The bits of the status word: what each switch decides.
#include "tests/unit/devices/yss_c/simulator_switch_readings.hpp"

namespace axisd::yss_c {
namespace {

std::int64_t limit_bit(Bench& bench, int bit) {
  bench.assign(0, 2);
  bench.drive().set_input("X0", true);
  return bench.bit(bit) ? 1 : 0;
}

const Reading readings[] = {
    {"bit6_always",
     [](Bench& b) {
       b.enable(1);
       return std::int64_t{b.bit(6)};
     },
     0, 1},
    {"bit7_is_warning",
     [](Bench& b) {
       b.drive().raise_alarm(4);
       return std::int64_t{b.bit(7)};
     },
     1, 0},
    {"homed_only_bit8",
     [](Bench& b) {
       home_with(b, 24);
       EXPECT_EQ(1, homed(b));
       return std::int64_t{b.bit(12)};
     },
     1, 0, with(home)},
    {"homed_only_bit12",
     [](Bench& b) {
       home_with(b, 24);
       b.run(20s);
       EXPECT_TRUE(b.bit(12));
       return std::int64_t{b.bit(8)};
     },
     1, 0, with(home)},
    {"bit11_is_limit", [](Bench& b) { return limit_bit(b, 11); }, 0, 1},
    {"bit13_is_homing_error",
     [](Bench& b) {
       b.enable(6);
       return std::int64_t{b.bit(13)};
     },
     1, 0},
    {"bit13_not_enabled",
     [](Bench& b) {
       b.enable(1);
       return std::int64_t{b.bit(13)};
     },
     1, 0},
    {"reached_only_bit10",
     [](Bench& b) {
       b.enable(1);
       b.move(100);
       b.run(3s);
       EXPECT_TRUE(b.bit(10));
       return std::int64_t{b.bit(15)};
     },
     1, 0},
    {"reached_only_bit15",
     [](Bench& b) {
       b.enable(1);
       b.move(100);
       b.run(3s);
       EXPECT_TRUE(b.bit(15));
       return std::int64_t{b.bit(10)};
     },
     1, 0},
};

}  // namespace

std::span<const Reading> status_readings() { return readings; }

}  // namespace axisd::yss_c
