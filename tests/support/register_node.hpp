// A node on a simulated line that is no drive: some registers, nothing that moves. Shares no code with the
// library.
#pragma once

#include <algorithm>
#include <map>
#include <optional>
#include <span>
#include <vector>

#include "devices/simulation/crc.hpp"
#include "devices/simulation/simulated_node.hpp"

namespace axisd::test {

class RegisterNode final : public simulation::SimulatedRtuNode {
 public:
  RegisterNode(std::uint8_t address, std::map<std::uint16_t, std::uint16_t> registers,
               std::optional<simulation::Serial> serial = std::nullopt)
      : registers(std::move(registers)), address_(address), serial_(serial) {}

  std::map<std::uint16_t, std::uint16_t> registers;
  bool silent = false;
  bool ignores_unknown = false;                ///< no exception for registers that it has not
  std::optional<std::uint16_t> highest_value;  ///< what is written above it is clamped
  int reads = 0;
  std::size_t longest_read = 0;

  [[nodiscard]] std::uint8_t address() const override { return address_; }
  [[nodiscard]] std::optional<simulation::Serial> serial() const override { return serial_; }
  void join(const simulation::Serial& line) override {
    if (!serial_) serial_ = line;
  }
  void advance(TimePoint) override {}
  std::optional<std::vector<std::uint8_t>> on_frame(std::span<const std::uint8_t> frame) override {
    if (silent || frame.size() < 8 || frame[0] != address_) return std::nullopt;
    const auto word = [&](std::size_t i) {
      return static_cast<std::uint16_t>(frame[i] << 8U | frame[i + 1]);
    };
    const auto first = word(2);
    const std::size_t count = frame[1] == 6 ? 1 : word(4);
    for (std::size_t i = 0; i < count; ++i)
      if (!registers.contains(static_cast<std::uint16_t>(first + i)))
        return ignores_unknown
                   ? std::nullopt
                   : std::optional(reply({address_, static_cast<std::uint8_t>(frame[1] | 0x80U), 2}));
    if (frame[1] == 3) {
      ++reads;
      longest_read = std::max(longest_read, count);
      std::vector<std::uint8_t> bytes{address_, 3, static_cast<std::uint8_t>(2 * count)};
      for (std::size_t i = 0; i < count; ++i) {
        const auto value = registers.at(static_cast<std::uint16_t>(first + i));
        bytes.push_back(static_cast<std::uint8_t>(value >> 8U));
        bytes.push_back(static_cast<std::uint8_t>(value & 0xFFU));
      }
      return reply(std::move(bytes));
    }
    for (std::size_t i = 0; i < count; ++i) {
      const auto value = word(frame[1] == 6 ? 4 : 7 + 2 * i);
      registers[static_cast<std::uint16_t>(first + i)] = std::min(value, highest_value.value_or(value));
    }
    return reply({frame.begin(), frame.begin() + 6});
  }
  void set_power(bool on) override { silent = !on; }
  void set_input(std::string_view, std::optional<bool>) override {}
  void raise_alarm(int) override {}
  [[nodiscard]] std::int64_t shaft_pulses() const override { return 0; }
  [[nodiscard]] bool shaft_moving() const override { return false; }
  [[nodiscard]] int starts() const override { return 0; }
  [[nodiscard]] std::uint32_t peek(std::uint32_t address) const override {
    return registers.at(static_cast<std::uint16_t>(address));
  }
  void poke(std::uint32_t address, std::uint32_t value) override {
    registers[static_cast<std::uint16_t>(address)] = static_cast<std::uint16_t>(value);
  }

 private:
  static std::vector<std::uint8_t> reply(std::vector<std::uint8_t> bytes) {
    simulation::append_frame_crc(bytes);
    return bytes;
  }

  std::uint8_t address_;
  std::optional<simulation::Serial> serial_;
};

}  // namespace axisd::test
