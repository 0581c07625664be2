#include "buses/modbus_rtu/settings.hpp"

namespace axisd::modbus_rtu {
namespace {

/// Rounded up: a wait that is too short by a fraction of a bit would be a violation.
Duration bit_time(const LineSettings& line, std::int64_t bits) {
  constexpr std::int64_t ns_per_second = 1'000'000'000;
  return Duration((bits * ns_per_second + line.baud - 1) / line.baud);
}

}  // namespace

Duration wire_time(const LineSettings& line, std::size_t bytes) {
  return bit_time(line, static_cast<std::int64_t>(bytes) * line.format.bits_per_character());
}

Duration silence(const LineSettings& line) {
  if (line.baud > 19200) return std::chrono::microseconds(1750);
  return (bit_time(line, 7L * line.format.bits_per_character()) + Duration(1)) / 2;
}

}  // namespace axisd::modbus_rtu
