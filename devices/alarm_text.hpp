// Codes of alarms as people look them up.
#pragma once

#include <fmt/format.h>

#include <cstdint>
#include <string>

namespace axisd {

/// Codes of CiA 301 and CiA 402 in hexadecimal, as those and the makers of drives write them ("8611h");
/// numbers of a maker's own list in decimal ("5"). FFFFh: the drive is in alarm, and gives no code.
inline std::string alarm_text(std::uint16_t code) {
  constexpr unsigned own_list = 0xFF, without_code = 0xFFFF;
  if (code == without_code) return "without a code";
  return code > own_list ? fmt::format("{:04X}h", code) : fmt::format("{}", code);
}

}  // namespace axisd
