#include "api/axisctl/trace_format.hpp"

#include <fmt/format.h>

namespace axisd::axisctl {
namespace {

// linux/can.h
constexpr std::uint32_t extended_flag = 0x80000000U, remote_flag = 0x40000000U;
constexpr std::uint32_t link_user0 = 147, link_can_socketcan = 227;

void put_little(std::string& to, std::uint32_t value, unsigned bytes) {
  for (unsigned i = 0; i < bytes; ++i) to += static_cast<char>((value >> (8 * i)) & 0xFFU);
}

void put_big(std::string& to, std::uint32_t value) {
  for (unsigned i = 4; i-- > 0;) to += static_cast<char>((value >> (8 * i)) & 0xFFU);
}

std::string content(const v1::TracedFrame& frame) {
  if (!frame.has_can()) return frame.data();
  const auto& can = frame.can();
  std::string bytes;
  put_big(bytes, can.id() | (can.extended() ? extended_flag : 0) | (can.remote() ? remote_flag : 0));
  bytes += static_cast<char>(can.length());
  bytes.append(3, '\0');
  return bytes + frame.data();
}

}  // namespace

bool on_wire(const v1::TracedFrame& frame) {
  return frame.kind() == v1::TRACE_KIND_SENT || frame.kind() == v1::TRACE_KIND_RECEIVED;
}

std::string candump_line(const v1::TracedFrame& frame, std::string_view interface) {
  const auto& can = frame.can();
  auto text = fmt::format("({}.{:06}) {} ", frame.at().seconds(), frame.at().nanos() / 1000, interface);
  text += can.extended() ? fmt::format("{:08X}#", can.id()) : fmt::format("{:03X}#", can.id());
  if (can.remote()) return text + (can.length() == 0 ? "R" : fmt::format("R{}", can.length()));
  for (const char byte : frame.data()) text += fmt::format("{:02X}", static_cast<std::uint8_t>(byte));
  return text;
}

std::string pcap_header(bool network) {
  constexpr std::uint32_t nanosecond_magic = 0xA1B23C4DU, longest_packet = 262144;
  std::string header;
  put_little(header, nanosecond_magic, 4);
  put_little(header, 2, 2);  // version 2.4
  put_little(header, 4, 2);
  put_little(header, 0, 4);  // times are UTC
  put_little(header, 0, 4);
  put_little(header, longest_packet, 4);
  put_little(header, network ? link_can_socketcan : link_user0, 4);
  return header;
}

std::string pcap_packet(const v1::TracedFrame& frame) {
  const auto bytes = content(frame);
  const auto size = static_cast<std::uint32_t>(bytes.size());
  std::string packet;
  put_little(packet, static_cast<std::uint32_t>(frame.at().seconds()), 4);
  put_little(packet, static_cast<std::uint32_t>(frame.at().nanos()), 4);
  put_little(packet, size, 4);  // captured
  put_little(packet, size, 4);  // on the wire
  return packet + bytes;
}

}  // namespace axisd::axisctl
