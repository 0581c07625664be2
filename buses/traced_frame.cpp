#include "buses/traced_frame.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <iterator>

#include "buses/canopen/cob.hpp"
#include "buses/modbus_rtu/frame.hpp"

namespace axisd {

void TracedFrame::set(const can::Frame& frame) {
  on_network = true;
  extended = frame.extended;
  remote = frame.rtr;
  id = frame.id;
  length = frame.size;
  node = frame.extended ? 0 : canopen::classify(frame.id).node;
  bytes = frame.rtr ? std::span<const std::uint8_t>() : frame.bytes();
}

can::Frame TracedFrame::frame() const {
  can::Frame frame{.id = id, .extended = extended, .rtr = remote, .size = length};
  std::ranges::copy(bytes, frame.data.begin());
  return frame;
}

void append_line(std::string& text, std::string_view bus, const TracedFrame& frame) {
  const auto out = std::back_inserter(text);
  fmt::format_to(out, "{} {} ", frame.at.time_since_epoch().count(), bus);
  const auto content = frame.on_network ? can::to_string(frame.frame()) : modbus_rtu::to_hex(frame.bytes);
  switch (frame.kind) {
    case TracedFrame::Kind::sent:
      fmt::format_to(out, "tx {}", content);
      break;
    case TracedFrame::Kind::received:
      fmt::format_to(out, "rx {}", content);
      break;
    case TracedFrame::Kind::not_sent:
      fmt::format_to(out, "-- {} {}{}", content, frame.on_network ? "" : "not sent: ", frame.why);
      break;
    case TracedFrame::Kind::failed:
      if (frame.on_network)
        fmt::format_to(out, "-- {} {}", content, frame.why);
      else
        fmt::format_to(out, "-- {}", frame.why);
      break;
    case TracedFrame::Kind::link:
      fmt::format_to(out, "link {}", frame.why);
      break;
  }
  if (frame.asked_for()) fmt::format_to(out, " @{}", to_string(frame.transaction_class));
  text += '\n';
}

}  // namespace axisd
