// An SDO upload that goes wrong on purpose: it never ends, or its toggle bit is wrong.
#pragma once

#include <cstdint>
#include <optional>

#include "buses/can/port.hpp"

namespace axisd::simulation {

/// Answers in place of the node from the upload request on, until the client aborts or begins anew.
class UploadTrap {
 public:
  UploadTrap(std::uint8_t node, bool wrong_toggle) : node_(node), wrong_toggle_(wrong_toggle) {}
  /// The answer to `request`, an SDO request of 8 bytes to the node; nothing: the trap is over and the node
  /// is to have the request.
  std::optional<can::Frame> on_request(const can::Frame& request);

 private:
  std::uint8_t node_;
  bool wrong_toggle_, begun_ = false, toggle_ = false;
};

}  // namespace axisd::simulation
