#include "buses/can/port.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cassert>

namespace axisd::can {
namespace {

constexpr std::uint32_t greatest_standard_id = 0x7FF;
constexpr std::uint32_t greatest_extended_id = 0x1FFFFFFF;

struct Wording {
  Reason reason;
  std::string_view what;
  std::string_view remedy;
};

Wording wording(SendStatus status) {
  switch (status) {
    case SendStatus::superseded:
      return {Reason::superseded, "not sent: a newer command or a stop took its place", ""};
    case SendStatus::expired:
      return {Reason::expired, "not sent in time", "reduce the bus load, or allow more time"};
    case SendStatus::lease_lost:
      return {Reason::lease_lost, "not sent: the lease is gone", "acquire the lease again"};
    case SendStatus::port_down:
      return {Reason::bus_down, "not sent: the CAN interface is down",
              "see the state of the bus for the cause"};
    case SendStatus::queue_full:
      return {Reason::busy, "not sent: too many frames wait for the bus", "send less, or retry later"};
    case SendStatus::invalid:
      return {Reason::internal, "not a CAN frame", "report this"};
    case SendStatus::sent:
    case SendStatus::unknown:
      break;
  }
  return {Reason::no_reply, "handed to the CAN interface, which never confirmed it",
          "check wiring, termination and that another node is powered; then read back what became of it"};
}

}  // namespace

Frame make_frame(std::uint32_t id, std::span<const std::uint8_t> bytes) {
  assert(id <= greatest_standard_id && bytes.size() <= 8);
  Frame frame{.id = id, .size = static_cast<std::uint8_t>(bytes.size())};
  std::ranges::copy(bytes, frame.data.begin());
  return frame;
}

bool valid(const Frame& frame) {
  if (frame.id > (frame.extended ? greatest_extended_id : greatest_standard_id) || frame.size > 8)
    return false;
  const auto unused = std::span(frame.data).subspan(frame.rtr ? 0 : frame.size);
  return std::ranges::all_of(unused, [](std::uint8_t byte) { return byte == 0; });
}

std::string to_string(const Frame& frame) {
  auto text = frame.extended ? fmt::format("{:08X}#", frame.id) : fmt::format("{:03X}#", frame.id);
  if (frame.rtr) return text + (frame.size == 0 ? "R" : fmt::format("R{}", frame.size));
  for (const auto byte : frame.bytes()) text += fmt::format("{:02X}", byte);
  return text;
}

int worst_case_bits(const Frame& frame) {
  // ISO 11898-1: from SOF to the end of the CRC one stuff bit per four bits at most; CRC delimiter to EOF and
  // the interframe space (13 bits) are not stuffed.
  const int stuffed = (frame.extended ? 54 : 34) + (frame.rtr ? 0 : 8 * frame.size);
  return stuffed + (stuffed - 1) / 4 + 13;
}

Duration worst_case_time(const Frame& frame, std::uint32_t bit_rate) {
  return std::chrono::nanoseconds(worst_case_bits(frame) * std::int64_t{1'000'000'000} / bit_rate);
}

std::string_view to_string(SendStatus status) {
  switch (status) {
    case SendStatus::sent:
      return "sent";
    case SendStatus::superseded:
      return "superseded";
    case SendStatus::expired:
      return "expired";
    case SendStatus::lease_lost:
      return "lease_lost";
    case SendStatus::port_down:
      return "port_down";
    case SendStatus::queue_full:
      return "queue_full";
    case SendStatus::invalid:
      return "invalid";
    case SendStatus::unknown:
      break;
  }
  return "unknown";
}

std::string_view to_string(InterfaceState state) {
  switch (state) {
    case InterfaceState::removed:
      return "removed";
    case InterfaceState::down:
      return "down";
    case InterfaceState::up:
      return "up";
    case InterfaceState::error_passive:
      return "error_passive";
    case InterfaceState::bus_off:
      return "bus_off";
    case InterfaceState::stalled:
      break;
  }
  return "stalled";
}

Error error_of(const SendResult& result, const std::string& bus, const Frame& frame) {
  assert(result.status != SendStatus::sent);
  const auto words = wording(result.status);
  Error error{.reason = words.reason,
              .message = fmt::format("frame {} {}", to_string(frame), words.what),
              .remedy = std::string(words.remedy),
              .outcome = result.status == SendStatus::unknown ? Outcome::unknown : Outcome::not_sent};
  error.where.bus = bus;
  return error;
}

}  // namespace axisd::can
