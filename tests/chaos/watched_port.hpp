// A port on the simulated network that tells what it hands over.
#pragma once

#include <functional>
#include <utility>

#include "buses/can/network.hpp"

namespace axisd::chaos {

class WatchedPort final : public can::NetworkPort {
 public:
  /// Called when a frame has been handed over: nobody can call it back. It has not ended on the wire yet.
  using HandedOver = std::function<void(const can::Frame&)>;

  WatchedPort(Clock& clock, can::PortSettings settings, can::Network& network, HandedOver handed_over)
      : NetworkPort(clock, std::move(settings), network), handed_over_(std::move(handed_over)) {}

 private:
  Written write(const can::Frame& frame) override {
    const auto written = NetworkPort::write(frame);
    if (written == Written::taken) handed_over_(frame);
    return written;
  }
  HandedOver handed_over_;
};

}  // namespace axisd::chaos
