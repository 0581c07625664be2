// CRC of Modbus RTU, computed bit by bit and apart from the daemon's own, so that an error there does not
// hide here.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

namespace axisd::simulation {

/// Polynomial A001h, start value FFFFh (Modbus over serial line 2.5.1.2).
inline std::uint16_t frame_crc(std::span<const std::uint8_t> bytes) {
  std::uint16_t crc = 0xFFFF;
  for (const auto byte : bytes) {
    crc ^= byte;
    for (int bit = 0; bit < 8; ++bit)
      crc = static_cast<std::uint16_t>((crc & 1U) != 0 ? (crc >> 1U) ^ 0xA001U : crc >> 1U);
  }
  return crc;
}

/// Appends the CRC, low byte first.
inline void append_frame_crc(std::vector<std::uint8_t>& frame) {
  const auto crc = frame_crc(frame);
  frame.push_back(static_cast<std::uint8_t>(crc & 0xFFU));
  frame.push_back(static_cast<std::uint8_t>(crc >> 8U));
}

/// At least address, function and CRC, and the CRC fits.
inline bool frame_is_sound(std::span<const std::uint8_t> frame) {
  return frame.size() >= 4 && frame_crc(frame) == 0;
}

}  // namespace axisd::simulation
