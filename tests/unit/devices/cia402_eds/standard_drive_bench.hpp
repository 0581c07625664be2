// A simulated standard drive on a bench: SDO, frames and time, without a network.
#pragma once

#include <gtest/gtest.h>

#include <array>
#include <cstdint>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "devices/cia402_eds/simulator.hpp"

namespace axisd::cia402_eds {

using namespace std::chrono_literals;

class Bench {
 public:
  explicit Bench(simulation::SimulatedNodeSettings settings = {}) {
    drive_.emplace(std::move(settings));
    drive_->advance(t_);
  }
  StandardDrive& drive() { return *drive_; }

  void put(std::uint32_t id, std::vector<std::uint8_t> bytes) {
    drive_->advance(t_);
    drive_->on_frame(can::make_frame(id, bytes));
  }
  /// Lets time pass; what the drive sent within it.
  std::vector<can::Frame> run(Duration duration) {
    t_ += duration;
    drive_->advance(t_);
    std::vector<can::Frame> sent;
    while (const auto frame = drive_->take_frame()) sent.push_back(*frame);
    return sent;
  }

  /// The abort code; 0: written.
  std::uint32_t write(std::uint16_t index, std::uint8_t sub, unsigned size, std::int64_t value) {
    const auto answer = ask(static_cast<std::uint8_t>(0x23U | (4 - size) << 2U), index, sub,
                            static_cast<std::uint32_t>(value));
    return answer.data[0] == 0x60 ? 0 : word_of(answer);
  }
  std::uint32_t write(std::uint16_t index, unsigned size, std::int64_t value) {
    return write(index, 0, size, value);
  }
  std::int64_t read(std::uint16_t index, std::uint8_t sub = 0) {
    const auto answer = ask(0x40, index, sub, 0);
    EXPECT_EQ(answer.data[0] & 0xF3U, 0x43U) << std::hex << index;
    return word_of(answer);
  }
  std::string read_text(std::uint16_t index) {
    auto answer = ask(0x40, index, 0, 0);
    if ((answer.data[0] & 2U) != 0) return text_of(answer, 4, 4U - (answer.data[0] >> 2U & 3U));
    std::string text;
    for (unsigned toggle = 0; (answer = ask(static_cast<std::uint8_t>(0x60U | toggle), 0, 0, 0), true);
         toggle ^= 0x10U) {
      text += text_of(answer, 1, 7U - (answer.data[0] >> 1U & 7U));
      if ((answer.data[0] & 1U) != 0) break;
    }
    return text;
  }
  [[nodiscard]] std::int32_t position() { return static_cast<std::int32_t>(read(0x6064)); }
  [[nodiscard]] std::int32_t velocity() { return static_cast<std::int32_t>(read(0x606C)); }
  [[nodiscard]] unsigned status() { return static_cast<unsigned>(read(0x6041)); }
  bool bit(unsigned number) { return (status() >> number & 1U) != 0; }
  void control(std::uint16_t word) { EXPECT_EQ(write(0x6040, 2, word), 0U); }
  void enable(int mode) {
    EXPECT_EQ(write(0x6060, 1, mode), 0U);
    for (const std::uint16_t word : {0x06, 0x07, 0x0F}) control(word);
    EXPECT_EQ(status() & 0x6FU, 0x27U);
  }
  /// A set-point; `bits`: 20h at once, 40h relative.
  void move(std::int32_t target, std::uint16_t bits = 0) {
    EXPECT_EQ(write(0x607A, 4, target), 0U);
    control(static_cast<std::uint16_t>(0x0F | bits));
    control(static_cast<std::uint16_t>(0x1F | bits));
  }
  void home(int method) {
    EXPECT_EQ(write(0x6098, 1, method), 0U);
    enable(6);
    control(0x1F);
  }

 private:
  can::Frame ask(std::uint8_t command, std::uint16_t index, std::uint8_t sub, std::uint32_t value) {
    const auto byte = [](std::uint32_t number, unsigned place) {
      return static_cast<std::uint8_t>(number >> (8 * place));
    };
    put(0x601, {command, byte(index, 0), byte(index, 1), sub, byte(value, 0), byte(value, 1), byte(value, 2),
                byte(value, 3)});
    for (const auto& frame : run(1ms))
      if (frame.id == 0x581) return frame;
    ADD_FAILURE() << "no answer";
    return {};
  }
  static std::uint32_t word_of(const can::Frame& frame) {
    std::uint32_t word = 0;
    for (unsigned i = 0; i < 4; ++i) word |= std::uint32_t{frame.data.at(4 + i)} << (8 * i);
    return word;
  }
  static std::string text_of(const can::Frame& frame, std::size_t first, std::size_t size) {
    return {frame.data.begin() + static_cast<std::ptrdiff_t>(first),
            frame.data.begin() + static_cast<std::ptrdiff_t>(first + size)};
  }

  TimePoint t_{1s};
  std::optional<StandardDrive> drive_;
};

/// A machine with home switch and limit switches.
inline simulation::SimulatedNodeSettings with_switches() {
  return {.mechanics = {.home_switch_from = 20'000,
                        .home_switch_to = 21'000,
                        .positive_limit_from = 50'000,
                        .negative_limit_from = -50'000}};
}

}  // namespace axisd::cia402_eds
