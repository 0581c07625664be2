// The dictionary: sizes, ranges, PDO parameters, position, EEPROM: what each switch decides.
#include "tests/unit/devices/yss_c/simulator_switch_readings.hpp"

namespace axisd::yss_c {
namespace {

Settings eeprom(std::map<std::uint32_t, std::uint32_t> values) { return {.eeprom = std::move(values)}; }

/// The control word after these, its RPDO being one for SYNC.
std::int64_t after_frames(Bench& bench, std::initializer_list<std::string_view> frames) {
  bench.write(0x1400, 2, 1, 1);
  bench.put("000 01 01");
  for (const auto frame : frames) bench.put(frame);
  return bench.read(0x6040);
}

const Reading readings[] = {
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
    {"rpdo_sync_refused", [](Bench& b) { return std::int64_t{b.write(0x1400, 2, 1, 1)}; }, 0, 0x06090030},
    {"rpdo_type_ignored", [](Bench& b) { return after_frames(b, {"201 00 01"}); }, 0, 0x100},
    {"rpdo_first_counts", [](Bench& b) { return after_frames(b, {"201 00 01", "201 40 00", "080"}); }, 0x40,
     0x100},
    {"rpdo_repeated",
     [](Bench& b) {
       after_frames(b, {"201 00 01", "080"});
       b.control(0);
       b.put("080");
       return b.read(0x6040);
     },
     0, 0x100},
    {"rpdo_kept", [](Bench& b) { return after_frames(b, {"201 00 01", "000 80 01", "000 01 01", "080"}); }, 0,
     0x100},
    {"rpdo_applied_by_type",
     [](Bench& b) {
       after_frames(b, {"201 00 01"});
       b.write(0x1400, 2, 1, 255);
       return b.read(0x6040);
     },
     0, 0x100},
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
    {"eeprom_switch_saves_itself",
     [](Bench& b) {
       b.write(0x200C, 2, 1);
       return after_power_cycle(b, 0x200C);
     },
     0, 1},
    {"undefined_node_is_1", [](Bench& b) { return std::int64_t{b.drive().address()}; }, 0, 1,
     Settings{.dip_address = 0, .eeprom = {{0x200800, 7}}}},
};

}  // namespace

std::span<const Reading> object_readings() { return readings; }

}  // namespace axisd::yss_c
