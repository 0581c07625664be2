#include "api/axisctl/frame_names.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cstddef>

#include "api/axisctl/format.hpp"

namespace axisd::axisctl {
namespace {

constexpr unsigned read_registers = 0x03, write_register = 0x06, write_registers = 0x10;
constexpr std::size_t crc_bytes = 2;

unsigned byte_at(std::string_view bytes, std::size_t at) { return static_cast<unsigned char>(bytes[at]); }
std::uint32_t big(std::string_view bytes, std::size_t at) {
  return byte_at(bytes, at) << 8U | byte_at(bytes, at + 1);
}
std::uint32_t little(std::string_view bytes, std::size_t at, unsigned count) {
  std::uint32_t value = 0;
  for (unsigned i = 0; i < count; ++i) value |= byte_at(bytes, at + i) << (8 * i);
  return value;
}

bool is_signed(v1::ParameterType type) {
  return type == v1::PARAMETER_TYPE_INT8 || type == v1::PARAMETER_TYPE_INT16 ||
         type == v1::PARAMETER_TYPE_INT32;
}

/// Modbus 7, as far as drives use them.
std::string_view exception_text(unsigned code) {
  constexpr auto texts = std::to_array<std::string_view>(
      {"", ", illegal function", ", illegal register", ", illegal value", ", device failure"});
  return code < texts.size() ? texts[code] : "";
}

std::string_view nmt_command(unsigned code) {
  switch (code) {
    case 0x01:
      return "start";
    case 0x02:
      return "stop";
    case 0x80:
      return "enter pre-operational";
    case 0x81:
      return "reset node";
    case 0x82:
      return "reset communication";
    default:
      return "?";
  }
}

std::string_view nmt_state(unsigned code) {
  switch (code & 0x7FU) {  // bit 7 is the toggle bit of node guarding
    case 0x00:
      return "boot-up";
    case 0x04:
      return "stopped";
    case 0x05:
      return "operational";
    case 0x7F:
      return "pre-operational";
    default:
      return "?";
  }
}

}  // namespace

void FrameNames::add(std::uint32_t node, const v1::ListParametersResponse& catalogue) {
  for (const auto& parameter : catalogue.parameters())
    entries_[{node, parameter.address()}] = {.name = parameter.name(), .type = parameter.type()};
}

std::string FrameNames::name(std::uint32_t node, std::uint32_t address) const {
  const auto found = entries_.find({node, address});
  return found == entries_.end() ? address_text(address) : found->second.name;
}

std::string FrameNames::value(std::uint32_t node, std::uint32_t address, std::uint32_t raw,
                              unsigned bytes) const {
  std::int64_t number = raw;
  const auto found = entries_.find({node, address});
  if (found != entries_.end() && is_signed(found->second.type)) {
    const auto range = std::int64_t{1} << (8 * bytes);
    if (number >= range / 2) number -= range;
  }
  return fmt::format("{}={}", name(node, address), number);
}

std::string FrameNames::registers(std::uint32_t node, std::uint32_t first, std::string_view words) const {
  std::string text;
  for (std::size_t i = 0; i + 1 < words.size(); i += 2) {
    if (!text.empty()) text += ' ';
    text += value(node, first + static_cast<std::uint32_t>(i / 2), big(words, i), 2);
  }
  return text;
}

/// `frame`: without its CRC.
std::string FrameNames::rtu_request(std::string_view frame) const {
  if (frame.size() < 6) return {};
  const auto node = byte_at(frame, 0), function = byte_at(frame, 1);
  const auto first = big(frame, 2), count = big(frame, 4);
  if (function == read_registers && count == 1) return "read " + name(node, first);
  if (function == read_registers && count > 0)
    return fmt::format("read {} to {}", name(node, first), name(node, first + count - 1));
  if (function == write_register) return "write " + registers(node, first, frame.substr(4, 2));
  if (function == write_registers && frame.size() > 7)
    return "write " + registers(node, first, frame.substr(7));
  return {};
}

/// `frame`: without its CRC.
std::string FrameNames::rtu_reply(std::string_view frame) const {
  if (frame.size() < 3) return {};
  const auto node = byte_at(frame, 0), function = byte_at(frame, 1);
  if ((function & 0x80U) != 0)
    return fmt::format("refused: exception {}{}", byte_at(frame, 2), exception_text(byte_at(frame, 2)));
  if (function == write_register || function == write_registers) return "written";
  const auto asked = asked_.find(node);
  if (function != read_registers || asked == asked_.end()) return {};
  return registers(node, asked->second, frame.substr(3));
}

/// CiA 301 7.2.4.3: what begins a transfer, or ends it with an abort.
std::string FrameNames::sdo(std::uint32_t node, std::string_view data, bool request) const {
  if (data.size() != 8) return {};
  const auto specifier = byte_at(data, 0);
  const auto address = little(data, 1, 2) << 8U | byte_at(data, 3);
  if (specifier == 0x80) return fmt::format("abort {}: 0x{:08X}", name(node, address), little(data, 4, 4));
  const bool expedited = (specifier & 0x02U) != 0, sized = (specifier & 0x01U) != 0;
  const unsigned bytes = sized ? 4 - (specifier >> 2U & 0x03U) : 4;
  const auto content =
      expedited ? value(node, address, little(data, 4, bytes), bytes) : name(node, address) + ", in segments";
  const auto kind = specifier & 0xE0U;
  if (request && kind == 0x40) return "read " + name(node, address);
  if (request && kind == 0x20) return "write " + content;
  if (!request && kind == 0x40) return content;
  if (!request && kind == 0x60) return "written " + name(node, address);
  return {};
}

/// By the identifiers of the predefined connection set (CiA 301 7.3.3).
std::string FrameNames::can_text(const v1::TracedFrame& frame) const {
  const auto& can = frame.can();
  const std::string_view data = frame.data();
  if (can.extended() || can.remote()) return {};
  const auto node = can.id() & 0x7FU, function = can.id() & 0x780U;
  if (can.id() == 0x000 && data.size() == 2)
    return fmt::format("NMT {}, node {}", nmt_command(byte_at(data, 0)), byte_at(data, 1));
  if (can.id() == 0x080) return "SYNC";
  if (node == 0) return {};
  if (function == 0x080 && data.size() >= 2) return fmt::format("EMCY 0x{:04X}", little(data, 0, 2));
  if (function == 0x580 || function == 0x600) return sdo(node, data, function == 0x600);
  if (function == 0x700 && data.size() == 1) return fmt::format("heartbeat, {}", nmt_state(byte_at(data, 0)));
  // TPDO1 180h, RPDO1 200h, TPDO2 280h ... RPDO4 500h
  if (function >= 0x180 && function <= 0x500)
    return fmt::format("{}PDO{}", (function & 0x80U) != 0 ? 'T' : 'R', (function - 0x080) / 0x100);
  return {};
}

std::string FrameNames::text(const v1::TracedFrame& frame) {
  if (frame.has_can()) return can_text(frame);
  if (frame.kind() == v1::TRACE_KIND_FAILED) asked_.erase(frame.node());
  std::string_view bytes = frame.data();
  if (frame.kind() == v1::TRACE_KIND_FAILED || bytes.size() <= 2 + crc_bytes) return {};
  bytes.remove_suffix(crc_bytes);
  const auto node = byte_at(bytes, 0);
  if (frame.kind() == v1::TRACE_KIND_RECEIVED) {
    auto text = rtu_reply(bytes);
    asked_.erase(node);
    return text;
  }
  if (frame.kind() == v1::TRACE_KIND_SENT) {
    asked_.erase(node);
    if (byte_at(bytes, 1) == read_registers && bytes.size() >= 6) asked_[node] = big(bytes, 2);
  }
  return rtu_request(bytes);
}

}  // namespace axisd::axisctl
