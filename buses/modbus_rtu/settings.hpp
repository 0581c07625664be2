#pragma once

#include <chrono>
#include <cstdint>
#include <optional>
#include <string>

#include "buses/budget.hpp"
#include "buses/clock.hpp"

namespace axisd::modbus_rtu {

enum class Parity : std::uint8_t { none, even, odd };

/// Serial format "8N1", "8N2", "8E1" or "8O1".
struct Format {
  Parity parity = Parity::none;
  int stop_bits = 1;
  [[nodiscard]] int bits_per_character() const {
    return 1 + 8 + (parity == Parity::none ? 0 : 1) + stop_bits;
  }
  bool operator==(const Format&) const = default;
};

/// What both ends of a line must agree on.
struct SerialSettings {
  int baud = 115200;  ///< bit/s, > 0
  Format format{};
  bool operator==(const SerialSettings&) const = default;
};

/// Of the wait for a reply, on top of what the wire and the node take: operating system and USB adapters.
inline constexpr Duration reply_margin = std::chrono::milliseconds(10);

/// Readings that may go before starts on top of one for each turn (StartTurns), where a while ago fewer did.
inline constexpr std::uint64_t most_that_go_first = 4;

/// One RS-485 line as the YAML describes it.
struct LineSettings {
  std::string name;   ///< bus name
  std::string port;   ///< device path, or "sim"
  int baud = 115200;  ///< bit/s; any rate the adapter can do
  Format format{};
  Duration turnaround_max =
      std::chrono::milliseconds(20);  ///< longest time a node takes before its first byte
  BudgetPolicy budget{};
  /// A drive of the line, 1..247. Where one answers, nobody has to wait in order to learn that the adapter
  /// does not hear what it sends. Nothing: nobody is asked, and an echo is waited for.
  std::optional<std::uint8_t> echo_witness{};
  [[nodiscard]] bool simulated() const { return port == "sim"; }
  [[nodiscard]] SerialSettings serial() const { return {.baud = baud, .format = format}; }
};

/// "8N1"
std::string to_string(const Format& format);
/// "9600 baud 8E1"
std::string to_string(const SerialSettings& serial);

/// Time that `bytes` characters take on the wire.
Duration wire_time(const SerialSettings& serial, std::size_t bytes);
inline Duration wire_time(const LineSettings& line, std::size_t bytes) {
  return wire_time(line.serial(), bytes);
}
/// Silence before each request: 3.5 characters, 1.75 ms above 19200 baud (Modbus over serial line 2.5.1.1).
Duration silence(const SerialSettings& serial);
inline Duration silence(const LineSettings& line) { return silence(line.serial()); }

}  // namespace axisd::modbus_rtu
