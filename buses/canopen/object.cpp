#include "buses/canopen/object.hpp"

#include <fmt/format.h>

namespace axisd::canopen {

std::string to_string(Object object) { return fmt::format("{:04X}h:{:02X}", object.index, object.sub); }

void append_number(Bytes& to, std::uint64_t value, std::size_t size) {
  for (std::size_t i = 0; i < size; ++i) to.push_back(static_cast<std::uint8_t>(value >> (8 * i)));
}

Bytes number_bytes(std::uint64_t value, std::size_t size) {
  Bytes bytes;
  append_number(bytes, value, size);
  return bytes;
}

std::uint64_t number_of(std::span<const std::uint8_t> bytes) {
  std::uint64_t value = 0;
  for (std::size_t i = 0; i < bytes.size() && i < sizeof value; ++i)
    value |= std::uint64_t{bytes[i]} << (8 * i);
  return value;
}

std::int64_t sign_extended(std::uint64_t value, unsigned bits) {
  const unsigned unused = 64 - bits;
  return static_cast<std::int64_t>(value << unused) >> unused;
}

TypeInfo info(DataType type) {
  using Kind = TypeInfo::Kind;
  switch (type) {
    case DataType::boolean:
      return {Kind::boolean, 1};
    case DataType::integer8:
      return {Kind::integer, 8};
    case DataType::integer16:
      return {Kind::integer, 16};
    case DataType::integer24:
      return {Kind::integer, 24};
    case DataType::integer32:
      return {Kind::integer, 32};
    case DataType::integer40:
      return {Kind::integer, 40};
    case DataType::integer48:
      return {Kind::integer, 48};
    case DataType::integer56:
      return {Kind::integer, 56};
    case DataType::integer64:
      return {Kind::integer, 64};
    case DataType::unsigned8:
      return {Kind::natural, 8};
    case DataType::unsigned16:
      return {Kind::natural, 16};
    case DataType::unsigned24:
      return {Kind::natural, 24};
    case DataType::unsigned32:
      return {Kind::natural, 32};
    case DataType::unsigned40:
      return {Kind::natural, 40};
    case DataType::unsigned48:
      return {Kind::natural, 48};
    case DataType::unsigned56:
      return {Kind::natural, 56};
    case DataType::unsigned64:
      return {Kind::natural, 64};
    case DataType::real32:
      return {Kind::real, 32};
    case DataType::real64:
      return {Kind::real, 64};
    case DataType::visible_string:
    case DataType::octet_string:
    case DataType::unicode_string:
      return {Kind::text, 0};
    case DataType::time_of_day:
    case DataType::time_difference:
      return {Kind::other, 48};
    case DataType::domain:
      break;
  }
  return {};
}

}  // namespace axisd::canopen
