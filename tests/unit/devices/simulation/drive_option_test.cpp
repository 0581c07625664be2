#include "devices/simulation/drive_option.hpp"

#include <gtest/gtest.h>

#include <numbers>

#include "buses/canopen/eds.hpp"
#include "devices/simulation/simulator.hpp"
#include "tests/support/source_tree.hpp"

namespace axisd::simulation {
namespace {

TEST(DriveOption, ReadsEveryPart) {
  const auto option = parse_drive(
      "node=3,model=ykd2405pr,home=-50:600,turn=4000,positive_limit=90000,negative_limit=-2000,switch.start_"
      "in_motion="
      "on,"
      "switch.unsigned_speed=off,eeprom.0x0011=13,wire.X1=positive_limit:nc,dip=0,dip_baud=custom,boot_ms="
      "250,powered=off,encoder.noise=2,encoder.following_ms=8,encoder.quantised=on,encoder.backlash=3,"
      "encoder.compliance=5,encoder.slip=-40");
  ASSERT_TRUE(option);
  EXPECT_EQ("ykd2405pr", option->model);
  const auto& settings = option->settings;
  EXPECT_EQ(3, settings.address);
  EXPECT_EQ(-50, settings.mechanics.home_switch_from);
  EXPECT_EQ(600, settings.mechanics.home_switch_to);
  EXPECT_EQ(4000, settings.mechanics.turn);
  EXPECT_EQ(90000, settings.mechanics.positive_limit_from);
  EXPECT_EQ(-2000, settings.mechanics.negative_limit_from);
  EXPECT_EQ((Switches{{"start_in_motion", true}, {"unsigned_speed", false}}), settings.switches);
  EXPECT_EQ(13, settings.eeprom.at(0x11));
  EXPECT_EQ(SwitchKind::positive_limit, settings.wires.at("X1").kind);
  EXPECT_TRUE(settings.wires.at("X1").normally_closed);
  EXPECT_EQ(std::chrono::milliseconds(250), settings.boot_time);
  EXPECT_FALSE(settings.powered);
  EXPECT_EQ(2, settings.encoder.noise);
  EXPECT_EQ(std::chrono::milliseconds(8), settings.encoder.following);
  EXPECT_TRUE(settings.encoder.quantised);
  EXPECT_EQ(3, settings.encoder.backlash);
  EXPECT_EQ(5, settings.encoder.compliance);
  EXPECT_EQ(-40, settings.encoder.slip);
  EXPECT_EQ(0, settings.dip_address);
  EXPECT_EQ(0, settings.dip_baud);
  EXPECT_EQ(38400, parse_drive("node=1,model=ess42-r,dip_baud=38400")->settings.dip_baud);
}

TEST(DriveOption, ReadsTheDataSheetAndItsUnits) {
  const auto sheet = test::in_source_tree("config/examples/standard-drive.eds");
  const auto option = parse_drive("node=3,model=cia402,eds=" + sheet +
                                  ",counts=4096,velocity_unit=0.1rpm,acceleration_unit=rpm_per_second");
  ASSERT_TRUE(option) << to_string(option.error());
  const auto& settings = option->settings;
  ASSERT_NE(settings.sheet, nullptr);
  EXPECT_EQ(settings.sheet->product, 0x00402001U);
  EXPECT_EQ(settings.units.counts_per_revolution, 4096);
  EXPECT_DOUBLE_EQ(settings.units.velocity.revolutions, 0.1 / 60);
  ASSERT_TRUE(settings.units.acceleration);
  EXPECT_DOUBLE_EQ(settings.units.acceleration->revolutions, 1.0 / 60);
  EXPECT_EQ(parse_drive("node=3,model=cia402")->settings.sheet, nullptr);
  UnitSettings units;
  EXPECT_TRUE(set_unit_option(units, "velocity_unit", "degrees_per_second"));
  EXPECT_DOUBLE_EQ(units.velocity.revolutions, 1.0 / 360);
  EXPECT_TRUE(set_unit_option(units, "velocity_unit", "pulses_per_second"));
  EXPECT_EQ(units.velocity, RateUnit{});
  EXPECT_TRUE(set_unit_option(units, "velocity_unit", "0.001rev_per_second"));
  EXPECT_DOUBLE_EQ(units.velocity.revolutions, 0.001);
  EXPECT_TRUE(set_unit_option(units, "velocity_unit", "0.01radians_per_second"));
  EXPECT_DOUBLE_EQ(units.velocity.revolutions, 0.01 / 2 / std::numbers::pi);
  for (const auto name : velocity_unit_names)
    EXPECT_TRUE(set_unit_option(units, "velocity_unit", name)) << name;
  for (const auto* name : {"", "0.1pulses_per_second", "10rpm", "0.5rpm", "turns"})
    EXPECT_FALSE(set_unit_option(units, "velocity_unit", name)) << name;
  EXPECT_TRUE(set_unit_option(units, "acceleration_unit", "pulses_per_second"));
  EXPECT_EQ(units.acceleration, RateUnit{});
  EXPECT_TRUE(set_unit_option(units, "acceleration_unit", "velocity_per_second"));
  EXPECT_EQ(units.acceleration, std::nullopt);
  EXPECT_TRUE(set_unit_option(units, "velocity_unit", "rpm"));
  EXPECT_DOUBLE_EQ(units.velocity.revolutions, 1.0 / 60);
  const auto missing = parse_drive("node=3,model=cia402,eds=/none.eds");
  ASSERT_FALSE(missing);
  EXPECT_NE(missing.error().message.find("/none.eds"), std::string::npos);
}

TEST(DriveOption, NamesThePartThatIsWrong) {
  for (const std::string wrong : {"node=0x1FF",
                                  "home=5",
                                  "home=6:5",
                                  "turn=0",
                                  "eds=",
                                  "counts=0",
                                  "velocity_unit=furlongs",
                                  "acceleration_unit=turns",
                                  "turn=x",
                                  "positive_limit=far",
                                  "switch.a=maybe",
                                  "eeprom.1=x",
                                  "eeprom.1=5000000000",
                                  "wire.X0=somewhere",
                                  "boot_ms=-1",
                                  "dip=x",
                                  "dip=256",
                                  "dip_baud=0",
                                  "dip_baud=fast",
                                  "powered=1",
                                  "encoder.noise=-1",
                                  "encoder.following_ms=x",
                                  "encoder.quantised=1",
                                  "encoder.color=1",
                                  "color=red",
                                  "model="}) {
    const auto option = parse_drive("node=1,model=ykd2405pr," + wrong);
    ASSERT_FALSE(option) << wrong;
    EXPECT_NE(std::string::npos, option.error().message.find(wrong));
  }
  const auto wide = parse_drive("node=1,model=ykd2405pr,eeprom.1=70000");
  const auto node = make_node(wide->model, wide->settings);
  ASSERT_FALSE(node) << "a register has 16 bits";
  EXPECT_NE(std::string::npos, node.error().message.find("70000 does not fit into register 0x0001"));
  EXPECT_FALSE(parse_drive("node=1"));
  EXPECT_FALSE(parse_drive("model=ykd2405pr"));
}

}  // namespace
}  // namespace axisd::simulation
