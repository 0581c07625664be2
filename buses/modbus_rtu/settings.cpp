#include "buses/modbus_rtu/settings.hpp"

#include <fmt/format.h>

namespace axisd::modbus_rtu {
namespace {

/// Rounded up: a wait that is too short by a fraction of a bit would be a violation.
Duration bit_time(const SerialSettings& serial, std::int64_t bits) {
  constexpr std::int64_t ns_per_second = 1'000'000'000;
  return Duration((bits * ns_per_second + serial.baud - 1) / serial.baud);
}

}  // namespace

std::string to_string(const Format& format) {
  const char parity = format.parity == Parity::none ? 'N' : format.parity == Parity::even ? 'E' : 'O';
  return fmt::format("8{}{}", parity, format.stop_bits);
}

std::string to_string(const SerialSettings& serial) {
  return fmt::format("{} baud {}", serial.baud, to_string(serial.format));
}

Duration wire_time(const SerialSettings& serial, std::size_t bytes) {
  return bit_time(serial, static_cast<std::int64_t>(bytes) * serial.format.bits_per_character());
}

Duration silence(const SerialSettings& serial) {
  if (serial.baud > 19200) return std::chrono::microseconds(1750);
  return (bit_time(serial, 7L * serial.format.bits_per_character()) + Duration(1)) / 2;
}

}  // namespace axisd::modbus_rtu
