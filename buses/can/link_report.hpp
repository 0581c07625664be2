// What rtnetlink says about a network interface. Pure.
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "buses/can/link_tracker.hpp"

namespace axisd::can {

struct LinkReport {
  bool gone = false;  ///< removed (`index`), or asked for and not there (`index` 0)
  int index = 0;      ///< of the interface; another one after it was created anew
  std::string name;
  bool is_can = false;  ///< it carries CAN frames
  bool up = false;
  /// Own frames come back when the controller has sent them; else the kernel answers for it at once.
  bool echo = false;
  std::optional<std::uint32_t> bitrate;  ///< none: virtual, or set in the adapter only
  std::optional<Controller> controller;
};

/// All that one netlink datagram reports. Bytes that make no message end it.
std::vector<LinkReport> parse_link_reports(std::span<const std::byte> datagram);
/// The request for a report on the interface called `name`. Precondition: 1..15 characters.
std::vector<std::byte> link_request(const std::string& name);

}  // namespace axisd::can
