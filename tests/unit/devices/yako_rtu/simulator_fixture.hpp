// A simulated drive of the family in virtual time, spoken to in frames.
#pragma once

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <charconv>
#include <memory>
#include <string>
#include <string_view>
#include <vector>

#include "devices/simulation/crc.hpp"
#include "devices/yako_rtu/simulator.hpp"

namespace axisd::yako_rtu {

using namespace std::chrono_literals;
using Bytes = std::vector<std::uint8_t>;

/// "01 06 00 27" to bytes.
inline Bytes bytes_of(std::string_view hex) {
  Bytes bytes;
  for (std::size_t at = 0; at + 1 < hex.size(); at += 3) {
    std::uint8_t byte = 0;
    std::from_chars(hex.data() + at, hex.data() + at + 2, byte, 16);
    bytes.push_back(byte);
  }
  return bytes;
}

inline std::string hex_of(const std::optional<Bytes>& bytes) {
  if (!bytes) return "silence";
  std::string text;
  for (const auto byte : *bytes) {
    constexpr auto digits = "0123456789ABCDEF";
    if (!text.empty()) text += ' ';
    text += digits[byte >> 4];
    text += digits[byte & 15];
  }
  return text;
}

/// One drive at address 1 and the time that it lives in.
class Bench {
 public:
  explicit Bench(simulation::SimulatedNodeSettings settings = {}, std::string_view model = "ykd2405pr")
      : simulator_(simulation::find_simulator(model)), drive_(make(*simulator_, std::move(settings))) {
    drive_->advance(now_);
  }

  SimulatedDrive& drive() { return *drive_; }
  void wait(Duration duration) {
    now_ += duration;
    drive_->advance(now_);
  }
  std::string send(std::string_view hex) { return hex_of(drive_->on_frame(bytes_of(hex))); }

  /// Writes a register; the exception code, 0 if it was accepted, -1 for silence.
  int write(std::uint16_t address, int value) {
    Bytes frame{1, 6};
    put(frame, address);
    put(frame, value);
    return ask(std::move(frame));
  }
  int write_block(std::uint16_t address, const std::vector<int>& values) {
    Bytes frame{1, 16};
    put(frame, address);
    put(frame, static_cast<int>(values.size()));
    frame.push_back(static_cast<std::uint8_t>(2 * values.size()));
    for (const auto value : values) put(frame, value);
    return ask(std::move(frame));
  }
  int read(std::uint16_t address, int count = 1) {
    Bytes frame{1, 3};
    put(frame, address);
    put(frame, count);
    return ask(std::move(frame));
  }

  int reg(std::uint16_t address) { return drive_->peek(address); }
  int position() { return static_cast<std::int32_t>(reg(reg::position_high) << 16 | reg(reg::position_low)); }
  bool status(int bit) { return (reg(reg::status) >> bit & 1) != 0; }
  /// Moves to or by `pulses` at `rpm` (1000 pulses per revolution unless changed).
  int move(int pulses, bool relative = true, int rpm = 60) {
    write_block(reg::start_speed, {5, 100, 100, rpm, pulses >> 16 & 0xFFFF, pulses & 0xFFFF});
    return write(reg::start, relative ? 1 : 5);
  }
  int velocity(int rpm) {
    write_block(reg::start_speed, {5, 100, 100, rpm & 0xFFFF});
    return write(reg::start, 2);
  }
  void power_cycle() {
    drive_->set_power(false);
    wait(50ms);
    drive_->set_power(true);
    wait(400ms);
  }
  void assign(std::string_view terminal, Input function) {
    const auto at = std::ranges::find(simulator_->inputs, terminal, &TerminalSpec::name);
    ASSERT_NE(simulator_->inputs.end(), at);
    const auto first = simulator_->model == "ess42-r" ? 0x0043 : 0x0041;
    ASSERT_EQ(0, write(static_cast<std::uint16_t>(first + (at - simulator_->inputs.begin())),
                       static_cast<int>(function)));
  }
  void pulse(std::string_view terminal) {
    drive_->set_input(terminal, true);
    wait(20ms);
    drive_->set_input(terminal, false);
    wait(20ms);
  }

 private:
  static std::unique_ptr<SimulatedDrive> make(const simulation::Simulator& simulator,
                                              simulation::SimulatedNodeSettings settings) {
    auto node = simulator.make(std::move(settings));
    return std::unique_ptr<SimulatedDrive>(dynamic_cast<SimulatedDrive*>(node.release()));
  }
  static void put(Bytes& frame, int value) {
    frame.push_back(static_cast<std::uint8_t>(value >> 8 & 0xFF));
    frame.push_back(static_cast<std::uint8_t>(value & 0xFF));
  }
  int ask(Bytes frame) {
    simulation::append_frame_crc(frame);
    const auto reply = drive_->on_frame(frame);
    if (!reply) return -1;
    EXPECT_TRUE(simulation::frame_is_sound(*reply));
    return ((*reply)[1] & 0x80) != 0 ? (*reply)[2] : 0;
  }

  TimePoint now_{1s};
  const simulation::Simulator* simulator_;
  std::unique_ptr<SimulatedDrive> drive_;
};

inline simulation::SimulatedNodeSettings with_switch(std::string name, bool on = true) {
  simulation::SimulatedNodeSettings settings;
  settings.switches[std::move(name)] = on;
  return settings;
}

}  // namespace axisd::yako_rtu
