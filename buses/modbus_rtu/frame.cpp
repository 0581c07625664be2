#include "buses/modbus_rtu/frame.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cstring>
#include <stdexcept>

namespace axisd::modbus_rtu {
namespace {

constexpr std::uint8_t exception_bit = 0x80;
constexpr std::size_t exception_size = 5;
constexpr std::size_t write_reply_size = 8;
constexpr std::size_t smallest_frame = 4;  // node, function, CRC
constexpr std::size_t read_head = 3;       // of the reply: node, function, byte count
constexpr std::size_t largest_write = 123;
constexpr std::uint8_t last_node = 247;  // 248..255 are reserved (Modbus over serial line 2.2)

constexpr std::array<std::uint16_t, 256> make_crc_table() {
  std::array<std::uint16_t, 256> table{};
  for (unsigned index = 0; index < table.size(); ++index) {
    unsigned crc = index;
    for (int bit = 0; bit < 8; ++bit) crc = (crc & 1U) != 0 ? (crc >> 1U) ^ 0xA001U : crc >> 1U;
    table[index] = static_cast<std::uint16_t>(crc);
  }
  return table;
}
constexpr auto crc_table = make_crc_table();

std::uint16_t word_at(std::span<const std::uint8_t> bytes, std::size_t index) {
  return static_cast<std::uint16_t>(bytes[index] << 8U | bytes[index + 1]);
}

bool is_write(Function function) { return function != Function::read_holding_registers; }

std::size_t register_count(const Request& request) {
  return is_write(request.function) ? request.values.size() : request.count;
}

/// What makes `request` impossible to send, or an empty string.
std::string objection(const Request& request) {
  const auto count = register_count(request);
  if (request.node == 0 || request.node > last_node)
    return fmt::format("node {} cannot be addressed (permitted 1 to {})", request.node, last_node);
  switch (request.function) {
    case Function::read_holding_registers:
      if (count == 0 || count > largest_read)
        return fmt::format("{} registers cannot be read at once (permitted 1 to {})", count, largest_read);
      break;
    case Function::write_single_register:
      if (count != 1) return fmt::format("function 06 writes one register, not {}", count);
      break;
    case Function::write_multiple_registers:
      if (count == 0 || count > largest_write)
        return fmt::format("{} registers cannot be written at once (permitted 1 to {})", count,
                           largest_write);
      break;
    default:
      return fmt::format("function {:02X} is not supported (03, 06 and 10 are)",
                         static_cast<unsigned>(request.function));
  }
  if (request.address + count > 0x10000)
    return fmt::format("{} registers from 0x{:04X} reach beyond 0xFFFF", count, request.address);
  return {};
}

bool answers(const Request& request, std::span<const std::uint8_t> reply) {
  switch (request.function) {
    case Function::read_holding_registers:
      return reply.size() == reply_size(request) && reply[2] == 2U * request.count;
    case Function::write_single_register:
      return reply.size() == write_reply_size && request.values.size() == 1 &&
             word_at(reply, 2) == request.address && word_at(reply, 4) == request.values[0];
    case Function::write_multiple_registers:
      return reply.size() == write_reply_size && word_at(reply, 2) == request.address &&
             word_at(reply, 4) == request.values.size();
  }
  return false;
}

}  // namespace

Frame::Frame(std::span<const std::uint8_t> bytes) {
  if (bytes.size() > capacity) throw std::out_of_range("a frame has 256 bytes at most");
  std::ranges::copy(bytes, bytes_.begin());
  size_ = bytes.size();
}

Frame& Frame::operator=(const Frame& other) {
  std::memmove(bytes_.data(), other.bytes_.data(), other.size_);
  size_ = other.size_;
  return *this;
}

void Frame::append_word(std::uint16_t word) {
  append(static_cast<std::uint8_t>(word >> 8U));
  append(static_cast<std::uint8_t>(word & 0xFFU));
}

void Frame::append_crc() {
  const auto crc = crc16(bytes());
  append(static_cast<std::uint8_t>(crc & 0xFFU));
  append(static_cast<std::uint8_t>(crc >> 8U));
}

bool Frame::operator==(const Frame& other) const { return std::ranges::equal(bytes(), other.bytes()); }

std::uint16_t crc16(std::span<const std::uint8_t> bytes) {
  unsigned crc = 0xFFFF;
  for (const auto byte : bytes) crc = crc >> 8U ^ crc_table[(crc ^ byte) & 0xFFU];
  return static_cast<std::uint16_t>(crc);
}

std::string to_hex(std::span<const std::uint8_t> bytes) {
  return fmt::format("{:02X}", fmt::join(bytes, " "));
}

Result<Frame> encode(const Request& request) {
  if (auto text = objection(request); !text.empty()) {
    Error error{
        .reason = Reason::invalid_argument, .message = std::move(text), .remedy = "correct the request"};
    error.where.node = request.node;
    error.where.object = request.address;
    return fail(std::move(error));
  }
  Frame frame;
  frame.append(request.node);
  frame.append(static_cast<std::uint8_t>(request.function));
  frame.append_word(request.address);
  const auto count = static_cast<std::uint16_t>(register_count(request));
  if (request.function != Function::write_single_register) frame.append_word(count);
  if (request.function == Function::write_multiple_registers)
    frame.append(static_cast<std::uint8_t>(2U * count));
  if (is_write(request.function))
    for (const auto value : request.values) frame.append_word(value);
  frame.append_crc();
  return frame;
}

std::size_t reply_size(const Request& request) {
  return is_write(request.function) ? write_reply_size : 5U + 2U * request.count;
}

std::size_t reply_size(std::span<const std::uint8_t> head) {
  const auto function = head[1];
  if ((function & exception_bit) != 0) return exception_size;
  const bool reads = function >= 0x01 && function <= 0x04;
  if (reads || function == 0x11 || function == 0x17) return 5U + head[2];  // with a byte count
  if (function == 0x16) return write_reply_size + 2;
  return function == 0x05 || function == 0x06 || function == 0x0F || function == 0x10 ? write_reply_size : 0;
}

Reply decode(const Request& request, std::span<const std::uint8_t> reply) {
  // The CRC of a frame together with its own CRC bytes is 0.
  if (reply.size() < smallest_frame || reply.size() > Frame::capacity || crc16(reply) != 0)
    return {.kind = ReplyKind::corrupt};
  const auto function = static_cast<std::uint8_t>(request.function);
  if (reply[0] != request.node) return {.kind = ReplyKind::foreign};
  if (reply[1] == (function | exception_bit) && reply.size() == exception_size)
    return {.kind = ReplyKind::exception, .exception_code = reply[2]};
  if (reply[1] != function || !answers(request, reply)) return {.kind = ReplyKind::foreign};
  return {.kind = ReplyKind::match};
}

Registers::Registers(const Frame& reply) {
  const auto bytes = reply.bytes();
  constexpr auto read = static_cast<std::uint8_t>(Function::read_holding_registers);
  if (bytes.size() < read_head || bytes[1] != read || reply_size(bytes) != bytes.size()) return;
  const auto values = bytes.subspan(read_head, bytes[read_head - 1]);
  size_ = values.size() / 2;
  for (std::size_t index = 0; index < size_; ++index) values_.at(index) = word_at(values, 2 * index);
}

}  // namespace axisd::modbus_rtu
