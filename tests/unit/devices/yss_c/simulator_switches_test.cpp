// Every switch of the simulator in both positions: what it decides can be seen from outside.
#include <gmock/gmock.h>

#include <algorithm>
#include <stdexcept>

#include "tests/unit/devices/yss_c/simulator_fixture.hpp"

namespace axisd::yss_c {
namespace {

using Settings = simulation::SimulatedNodeSettings;

struct Reading {
  const char* name;
  std::int64_t (*probe)(Bench& bench);
  std::int64_t off, on;
  Settings settings{};
};

Settings with(simulation::Mechanics mechanics) { return {.mechanics = mechanics}; }
Settings eeprom(std::map<std::uint32_t, std::uint32_t> values) { return {.eeprom = std::move(values)}; }
const simulation::Mechanics home{.home_switch_from = 1000, .home_switch_to = 1200};

std::int64_t starts(Bench& bench) { return bench.drive().starts(); }
std::int64_t moving(Bench& bench) { return bench.drive().shaft_moving() ? 1 : 0; }

void run_velocity(Bench& bench, int rpm) {
  bench.enable(3);
  bench.write(0x60FF, 4, rpm);
  bench.run(500ms);
}
/// Homes with 24 or 29 by X0.
void home_with(Bench& bench, int method) {
  bench.assign(0, 1);
  bench.write(0x6098, 1, method);
  bench.enable(6);
  bench.control(0x1F);
}
std::int64_t homed(Bench& bench) {
  bench.run(20s);
  return bench.bit(8) ? 1 : 0;
}
std::int64_t end_of_29(Bench& bench) {
  bench.enable(1);
  bench.move(3000);
  bench.run(5s);
  bench.control(0x0F);
  home_with(bench, 29);
  bench.run(20s);
  return bench.drive().shaft_pulses();
}
std::int64_t after_power_cycle(Bench& bench, std::uint16_t index, std::uint8_t sub = 0) {
  bench.drive().set_power(false);
  bench.drive().set_power(true);
  bench.run(400ms);
  return bench.read(index, sub);
}
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
std::int64_t limit_bit(Bench& bench, int bit) {
  bench.assign(0, 2);
  bench.drive().set_input("X0", true);
  return bench.bit(bit) ? 1 : 0;
}
void start_by_terminal(Bench& bench, int function) {
  bench.assign(0, function);
  bench.drive().set_input("X0", true);
  bench.run(100ms);
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
    {"start_speed_u32", [](Bench& b) { return std::int64_t{b.write(0x200E, 4, 7)}; }, 0x06070012, 0},
    {"motion_objects_u16", [](Bench& b) { return std::int64_t{b.write(0x6083, 2, 7)}; }, 0x06070013, 0},
    {"shorter_writes", [](Bench& b) { return std::int64_t{b.write(0x6083, 2, 7)}; }, 0x06070013, 0},
    {"segmented_uploads",
     [](Bench& b) { return std::int64_t{Bench::parse(b.ask("601 40 0E 20 00 00 00 00 00")).data[0]}; }, 0x4B,
     0x41},
    {"ranges_of_chapter_6",
     [](Bench& b) {
       const std::uint32_t home_speed = b.write(0x6099, 1, 4, 0), offset = b.write(0x607C, 4, 2'000'000);
       EXPECT_EQ(home_speed, offset);
       return std::int64_t{b.write(0x609A, 4, 0)};
     },
     0x06090030, 0},
    {"pdo_parameters_read_only", [](Bench& b) { return std::int64_t{b.write(0x1800, 1, 4, 0x80000181)}; }, 0,
     0x06010002},
    {"emergency_cob_is_sync", [](Bench& b) { return b.read(0x1014); }, 0x81, 0x80},
    {"error_count_grows",
     [](Bench& b) {
       b.drive().raise_alarm(4);
       return b.read(0x1003);
     },
     4, 1},
    {"mode_not_mappable",
     [](Bench& b) {
       b.write(0x1601, 0, 1, 0);
       return std::int64_t{b.write(0x1601, 1, 4, 0x60600008)};
     },
     0, 0x06040041},
    {"nmt_reset_keeps_position",
     [](Bench& b) {
       b.enable(1);
       b.move(500);
       b.run(3s);
       b.put("000 81 01");
       b.run(400ms);
       return std::int64_t{b.position()};
     },
     0, 500},
    {"position_read_only", [](Bench& b) { return std::int64_t{b.write(0x6064, 4, 7)}; }, 0, 0x06010002},
    {"position_is_commanded",
     [](Bench& b) {
       b.enable(1);
       b.drive().block_shaft(true);
       b.move(300);
       b.run(3s);
       return std::int64_t{b.position()};
     },
     0, 300, eeprom({{0x204600, 20000}})},
    {"released_position_frozen",
     [](Bench& b) {
       EXPECT_TRUE(b.drive().push_shaft(40));
       return std::int64_t{b.position()};
     },
     40, 0},
    {"position_clear_in_motion",
     [](Bench& b) {
       b.enable(1);
       b.move(5000);
       b.run(1s);
       b.write(0x2012, 2, 1);
       return std::int64_t{b.position() < 100};
     },
     0, 1},
    {"position_clear_late",
     [](Bench& b) {
       b.enable(1);
       b.move(500);
       b.run(2s);
       b.write(0x2012, 2, 1);
       const auto at_once = std::int64_t{b.position()};
       b.run(30ms);
       EXPECT_EQ(b.position(), 0);
       return at_once;
     },
     0, 500},
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
    {"alarm_keeps_torque",
     [](Bench& b) {
       b.enable(1);
       b.drive().raise_alarm(4);
       return std::int64_t{b.bit(13)};
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
    {"eeprom_switch_saves_itself",
     [](Bench& b) {
       b.write(0x200C, 2, 1);
       return after_power_cycle(b, 0x200C);
     },
     0, 1},
    {"undefined_node_is_1", [](Bench& b) { return std::int64_t{b.drive().address()}; }, 0, 1,
     Settings{.dip_address = 0, .eeprom = {{0x200800, 7}}}},
};

class YssCSwitch : public ::testing::TestWithParam<Reading> {};

TEST_P(YssCSwitch, DecidesWhatCanBeSeen) {
  const auto& reading = GetParam();
  for (const bool on : {false, true}) {
    SCOPED_TRACE(on ? "on" : "off");
    simulation::Switches switches{{reading.name, on}};
    // One of two readings that can both be taken: the other one off, or it shows nothing.
    if (std::string_view(reading.name) == "homing_codes_0_to_3") switches["homing_codes_cia"] = true;
    Bench bench(switches, reading.settings);
    EXPECT_EQ(on ? reading.on : reading.off, reading.probe(bench));
  }
}

INSTANTIATE_TEST_SUITE_P(Manual, YssCSwitch, ::testing::ValuesIn(readings),
                         [](const auto& info) { return std::string(info.param.name); });

TEST(YssCSwitches, AreAllTestedAndHaveUniqueNames) {
  std::vector<std::string_view> tested, existing;
  for (const auto& one : readings) tested.emplace_back(one.name);
  for (const auto& one : switch_specs()) existing.push_back(one.name);
  EXPECT_THAT(tested, ::testing::UnorderedElementsAreArray(existing));
  std::ranges::sort(existing);
  EXPECT_EQ(existing.end(), std::ranges::adjacent_find(existing));
}

TEST(YssCSwitches, RefuseUnknownNames) {
  EXPECT_THROW(behaviour_from({{"no_such_switch", true}}), std::invalid_argument);
}

}  // namespace
}  // namespace axisd::yss_c
