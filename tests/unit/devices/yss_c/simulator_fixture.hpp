// A simulated YSS-C on a bench: SDO, frames and time, without a network.
#pragma once

#include <fmt/format.h>
#include <gtest/gtest.h>

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "devices/simulation/text.hpp"
#include "devices/yss_c/simulator.hpp"

namespace axisd::yss_c {

using namespace std::chrono_literals;

class Bench {
 public:
  explicit Bench(simulation::Switches switches = {}, simulation::SimulatedNodeSettings settings = {}) {
    settings.switches = std::move(switches);
    drive_.emplace(std::move(settings));
    drive_->advance(t_);
  }
  SimulatedDrive& drive() { return *drive_; }
  [[nodiscard]] TimePoint now() const { return t_; }

  /// "601 2B 40 60 ..." as the golden files write frames.
  static can::Frame parse(std::string_view text) {
    const auto words = simulation::split(text, ' ');
    std::vector<std::uint8_t> bytes;
    for (std::size_t i = 1; i < words.size(); ++i)
      bytes.push_back(*simulation::parse_number<std::uint8_t>(fmt::format("0x{}", words[i])));
    return can::make_frame(*simulation::parse_number<std::uint32_t>(fmt::format("0x{}", words[0])), bytes);
  }
  static std::string print(const can::Frame& frame) {
    auto text = fmt::format("{:03X}", frame.id);
    for (const auto byte : frame.bytes()) text += fmt::format(" {:02X}", byte);
    return text;
  }

  /// Puts a frame on the wire.
  void put(std::string_view text) {
    drive_->advance(t_);
    drive_->on_frame(parse(text));
  }
  /// Lets time pass; what the drive sent within it, a frame per line entry.
  std::vector<std::string> run(Duration duration) {
    t_ += duration;
    drive_->advance(t_);
    std::vector<std::string> sent;
    while (const auto frame = drive_->take_frame()) sent.push_back(print(*frame));
    return sent;
  }
  /// The drive's answer within 1 ms; "silence" if there is none.
  std::string ask(std::string_view text) {
    put(text);
    const auto sent = run(1ms);
    return sent.empty() ? "silence" : sent.back();
  }

  /// Expedited download of `size` bytes; the abort code, 0: done.
  std::uint32_t write(std::uint16_t index, std::uint8_t sub, int size, std::int64_t value) {
    std::string text =
        fmt::format("601 {:02X} {:02X} {:02X} {:02X}", 0x23 | (4 - size) << 2, index & 0xFF, index >> 8, sub);
    for (int i = 0; i < 4; ++i) text += fmt::format(" {:02X}", i < size ? (value >> (8 * i)) & 0xFF : 0);
    return code_of(ask(text));
  }
  std::uint32_t write(std::uint16_t index, int size, std::int64_t value) {
    return write(index, 0, size, value);
  }
  /// Expedited upload; fails the test on an abort.
  std::int64_t read(std::uint16_t index, std::uint8_t sub = 0) {
    const auto text =
        ask(fmt::format("601 40 {:02X} {:02X} {:02X} 00 00 00 00", index & 0xFF, index >> 8, sub));
    const auto frame = parse(text);
    EXPECT_EQ(0x43, frame.data[0] & 0xF3) << fmt::format("{:04X}:{:02X}: ", index, sub) << text;
    const int size = 4 - (frame.data[0] >> 2 & 3);
    std::int64_t value = 0;
    for (int i = 0; i < size; ++i)
      value |= std::int64_t{frame.data.at(4 + static_cast<std::size_t>(i))} << (8 * i);
    return value;
  }
  std::int32_t position() { return static_cast<std::int32_t>(read(0x6064)); }
  std::uint16_t status() { return static_cast<std::uint16_t>(read(0x6041)); }
  bool bit(int number) { return (status() >> number & 1) != 0; }
  void control(std::uint16_t word) { EXPECT_EQ(0U, write(0x6040, 2, word)); }
  /// 6.2.2.
  void enable(int mode) {
    EXPECT_EQ(0U, write(0x6060, 1, mode));
    for (const std::uint16_t word : {0x00, 0x06, 0x07, 0x0F}) control(word);
  }
  void move(std::int32_t pulses, bool relative = true) {
    EXPECT_EQ(0U, write(0x607A, 4, pulses));
    control(relative ? 0x4F : 0x0F);
    control(relative ? 0x5F : 0x1F);
  }
  /// Assigns `function` to X<input>.
  void assign(int input, int function) {
    EXPECT_EQ(0U, write(0x2030, static_cast<std::uint8_t>(2 + input), 2, function));
  }

 private:
  static std::uint32_t code_of(const std::string& answer) {
    if (answer == "silence") return 0xFFFFFFFF;
    const auto frame = parse(answer);
    if (frame.data[0] == 0x60) return 0;
    return static_cast<std::uint32_t>(frame.data[4]) | static_cast<std::uint32_t>(frame.data[5]) << 8U |
           static_cast<std::uint32_t>(frame.data[6]) << 16U |
           static_cast<std::uint32_t>(frame.data[7]) << 24U;
  }

  TimePoint t_{1s};
  std::optional<SimulatedDrive> drive_;
};

}  // namespace axisd::yss_c
