// Address and serial settings: switches, custom registers, and that changes count from the next power-up.
#include "tests/unit/devices/yako_rtu/simulator_fixture.hpp"

namespace axisd::yako_rtu {
namespace {

using modbus_rtu::Format;
using modbus_rtu::Parity;
using simulation::Serial;

constexpr Format format_8n1{}, format_8n2{.stop_bits = 2}, format_8e1{.parity = Parity::even},
    format_8o1{.parity = Parity::odd};

simulation::SimulatedNodeSettings switches(std::optional<std::uint8_t> address, std::optional<int> baud) {
  simulation::SimulatedNodeSettings settings;
  settings.dip_address = address;
  settings.dip_baud = baud;
  return settings;
}

int baud_of(Bench& bench) { return bench.drive().serial()->baud; }

struct CustomBauds {
  std::string_view model;
  std::array<int, 4> bauds;
};
class CustomBaud : public ::testing::TestWithParam<CustomBauds> {};

TEST_P(CustomBaud, CountsFromTheNextPowerUp) {
  Bench bench{switches({}, 0), GetParam().model};
  for (std::size_t code = 0; code < 4; ++code) {
    const auto before = baud_of(bench);
    ASSERT_EQ(0, bench.write(reg::custom_baud, static_cast<int>(code)));
    EXPECT_EQ(before, baud_of(bench)) << "not yet";
    bench.power_cycle();
    EXPECT_EQ(GetParam().bauds[code], baud_of(bench));
  }
}
INSTANTIATE_TEST_SUITE_P(Manual, CustomBaud,
                         ::testing::Values(CustomBauds{"ykd2405pr", {9600, 14400, 128000, 256000}},
                                           CustomBauds{"ssd2608pr", {9600, 14400, 128000, 256000}},
                                           CustomBauds{"ess42-r", {115200, 38400, 19200, 9600}}));

TEST(SimulatorSerial, SwitchesStandBeforeTheCustomBaud) {
  Bench bench{switches({}, 38400)};
  bench.write(reg::custom_baud, 3);
  bench.power_cycle();
  EXPECT_EQ(38400, baud_of(bench));
}

TEST(SimulatorSerial, FormatCountsFromTheNextPowerUpAndOnlyIfItWasSaved) {
  Bench bench{switches({}, 19200)};
  EXPECT_EQ(format_8n1, bench.drive().serial()->format);
  int code = 1;
  for (const auto& format : {format_8n2, format_8e1, format_8o1}) {
    bench.write(reg::serial_format, code++);
    bench.power_cycle();
    EXPECT_EQ(format, bench.drive().serial()->format);
  }
  bench.write(reg::eeprom_update, 1);
  bench.write(reg::serial_format, 0);
  bench.power_cycle();
  EXPECT_EQ(format_8o1, bench.drive().serial()->format) << "0x0016 = 1 kept it in RAM";
}

TEST(SimulatorSerial, HearsAnyLineUntilItJoinsOne) { EXPECT_FALSE(Bench{}.drive().serial()); }

TEST(SimulatorSerial, JoinsALineAsIfItHadBeenSetUpForIt) {
  struct Case {
    std::string_view model;
    Serial line;
    int custom_baud;
  };
  for (const auto& [model, line, code] :
       {Case{"ykd2405pr", {115200, format_8n1}, 0}, Case{"ykd2405pr", {19200, format_8e1}, 0},
        Case{"ssd2608pr", {256000, format_8n2}, 3}, Case{"ess42-r", {115200, format_8n1}, 0},
        Case{"ess42-r", {9600, format_8o1}, 3}}) {
    SCOPED_TRACE(model);
    Bench bench({}, model);
    bench.drive().join(line);
    EXPECT_TRUE(bench.drive().serial()->fits(line));
    EXPECT_EQ(code, bench.reg(reg::custom_baud));
    bench.power_cycle();
    EXPECT_TRUE(bench.drive().serial()->fits(line)) << "it is in the EEPROM";
    EXPECT_EQ(0U, bench.drive().eeprom_writes());
  }
}

TEST(SimulatorSerial, WhatTheSettingsSayIsNotChangedByTheLine) {
  auto settings = switches({}, 0);
  settings.eeprom = {{reg::custom_baud, 1}, {reg::serial_format, 2}};
  Bench bench{settings};
  bench.drive().join({115200, format_8n1});
  EXPECT_EQ(14400, baud_of(bench));
  EXPECT_EQ(format_8e1, bench.drive().serial()->format);
  Bench formatted{[] {
    simulation::SimulatedNodeSettings own;
    own.eeprom = {{reg::serial_format, 3}};
    return own;
  }()};
  formatted.drive().join({38400, format_8n1});
  EXPECT_EQ(38400, baud_of(formatted));
  EXPECT_EQ(format_8o1, formatted.drive().serial()->format);
}

TEST(SimulatorAddress, AChangeCountsFromTheNextPowerUpAndOnlyIfItWasSaved) {
  auto settings = switches({}, {});
  settings.address = 40;
  Bench bench{settings};
  auto write = [&](std::uint8_t node, std::uint16_t address, std::uint8_t value) {
    Bytes frame{node, 6, 0, static_cast<std::uint8_t>(address), 0, value};
    simulation::append_frame_crc(frame);
    return bench.drive().on_frame(frame).has_value();
  };
  EXPECT_TRUE(write(40, reg::custom_node, 50));
  EXPECT_EQ(40, bench.drive().address());
  bench.power_cycle();
  EXPECT_EQ(50, bench.drive().address());
  EXPECT_EQ(50, bench.reg(reg::node));
  EXPECT_TRUE(write(50, reg::eeprom_update, 1));
  EXPECT_TRUE(write(50, reg::custom_node, 60));
  bench.power_cycle();
  EXPECT_EQ(50, bench.drive().address());
}

TEST(SimulatorAddress, SwitchesStandBeforeTheCustomAddress) {
  Bench bench;
  bench.write(reg::custom_node, 50);
  bench.power_cycle();
  EXPECT_EQ(1, bench.drive().address());
}

TEST(SimulatorAddress, CustomOnesHaveTheRangeOfTheModel) {
  struct Case {
    std::string_view model;
    int custom, address;
  };
  // 0x0013: 32..127 on YKD2405PR and SSD2608PR; 1..32 on ESS42-R, where all else is 1.
  for (const auto& [model, custom, address] :
       {Case{"ykd2405pr", 31, 0}, Case{"ykd2405pr", 32, 32}, Case{"ssd2608pr", 0, 0},
        Case{"ssd2608pr", 127, 127}, Case{"ess42-r", 32, 32}, Case{"ess42-r", 33, 1}, Case{"ess42-r", 0, 1},
        Case{"ess42-r", 7, 7}}) {
    auto settings = switches(0, {});
    settings.eeprom[reg::custom_node] = static_cast<std::uint16_t>(custom);
    EXPECT_EQ(address, (Bench{settings, model}.drive().address())) << model << ' ' << custom;
  }
  auto settings = switches(0, {});
  settings.eeprom[reg::custom_node] = 5;
  settings.switches["undefined_address_is_1"] = true;
  EXPECT_EQ(1, Bench{settings}.drive().address());
}

TEST(SimulatorAddress, BeyondTheSwitchesOfTheModelIsInTheCustomRegister) {
  simulation::SimulatedNodeSettings settings;
  settings.address = 20;
  EXPECT_EQ(0, (Bench{settings, "ssd2608pr"}.reg(reg::custom_node)));
  Bench integrated{settings, "ess42-r"};
  EXPECT_EQ(20, integrated.reg(reg::custom_node)) << "its switches end at 15";
  EXPECT_EQ(20, integrated.drive().address());
}

}  // namespace
}  // namespace axisd::yako_rtu
