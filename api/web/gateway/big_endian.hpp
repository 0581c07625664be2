// Numbers as frames have them.
#pragma once

#include <cstdint>
#include <string>
#include <string_view>

namespace axisd::web {

/// Of the first four bytes. Precondition: there are as many.
[[nodiscard]] inline std::uint32_t big_endian32(std::string_view bytes) {
  std::uint32_t number = 0;
  for (const char byte : bytes.substr(0, 4)) number = number << 8U | static_cast<unsigned char>(byte);
  return number;
}

inline void append_big_endian16(std::string& bytes, std::uint16_t number) {
  bytes += static_cast<char>(number >> 8U);
  bytes += static_cast<char>(number & 0xFFU);
}

inline void append_big_endian32(std::string& bytes, std::uint32_t number) {
  append_big_endian16(bytes, static_cast<std::uint16_t>(number >> 16U));
  append_big_endian16(bytes, static_cast<std::uint16_t>(number & 0xFFFFU));
}

}  // namespace axisd::web
