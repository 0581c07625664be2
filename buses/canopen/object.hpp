// Words that every part of CANopen uses: object addresses, numbers on the wire, data types (CiA
// 301 7.1, 7.4).
#pragma once

#include <compare>
#include <cstdint>
#include <span>
#include <string>
#include <string_view>
#include <vector>

namespace axisd::canopen {

using Bytes = std::vector<std::uint8_t>;

inline constexpr std::uint8_t highest_node = 127;  ///< node-IDs are 1..127; 0 is everybody
[[nodiscard]] constexpr bool valid_node(unsigned node) { return node >= 1 && node <= highest_node; }

/// One entry of a node's object dictionary.
struct Object {
  std::uint16_t index = 0;
  std::uint8_t sub = 0;
  /// As Address::object holds it: index << 8 | sub-index.
  [[nodiscard]] constexpr std::uint32_t key() const { return std::uint32_t{index} << 8U | sub; }
  [[nodiscard]] static constexpr Object of(std::uint32_t key) {
    return {static_cast<std::uint16_t>(key >> 8U), static_cast<std::uint8_t>(key & 0xFFU)};
  }
  friend constexpr auto operator<=>(const Object&, const Object&) = default;
};
/// "6040h:00"
std::string to_string(Object object);

/// Appends the lowest `size` bytes of `value`, low byte first. Precondition: size <= 8.
void append_number(Bytes& to, std::uint64_t value, std::size_t size);
Bytes number_bytes(std::uint64_t value, std::size_t size);
/// The number that up to 8 bytes hold, low byte first.
std::uint64_t number_of(std::span<const std::uint8_t> bytes);
/// `value` of `bits` bits read as two's complement. Precondition: 1 <= bits <= 64.
std::int64_t sign_extended(std::uint64_t value, unsigned bits);

/// Data types by their index in the dictionary (CiA 301 7.4.7, table 44).
enum class DataType : std::uint16_t {
  boolean = 0x01,
  integer8 = 0x02,
  integer16 = 0x03,
  integer32 = 0x04,
  unsigned8 = 0x05,
  unsigned16 = 0x06,
  unsigned32 = 0x07,
  real32 = 0x08,
  visible_string = 0x09,
  octet_string = 0x0A,
  unicode_string = 0x0B,
  time_of_day = 0x0C,
  time_difference = 0x0D,
  domain = 0x0F,
  integer24 = 0x10,
  real64 = 0x11,
  integer40 = 0x12,
  integer48 = 0x13,
  integer56 = 0x14,
  integer64 = 0x15,
  unsigned24 = 0x16,
  unsigned40 = 0x18,
  unsigned48 = 0x19,
  unsigned56 = 0x1A,
  unsigned64 = 0x1B,
};
/// What a type is made of. `bits` is 0 for types without a fixed size and for types of a device's own.
struct TypeInfo {
  enum class Kind : std::uint8_t { boolean, integer, natural, real, text, other };
  Kind kind = Kind::other;
  unsigned bits = 0;
};
TypeInfo info(DataType type);

}  // namespace axisd::canopen
