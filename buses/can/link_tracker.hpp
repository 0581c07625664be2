#pragma once

#include <cstdint>
#include <optional>
#include <string>

#include "buses/can/port.hpp"

namespace axisd::can {

/// What the controller says of itself.
enum class Controller : std::uint8_t { active, passive, bus_off };

/// Puts what is learned about an interface together to the state of its port. Pure. Thread: core.
///
/// Bus-off and a stall are remembered until the link was seen down (or gone), whatever the controller says
/// meanwhile: one that restarts by itself would send what the kernel's queue still holds.
class LinkTracker {
 public:
  LinkTracker(std::string bus, std::string interface);

  void removed();
  void down();
  /// The interface is up and its socket open. `objection`: what forbids using it all the same.
  void up(std::optional<Error> objection = {});
  /// The socket or what watches the interface cannot be had; nothing else is known.
  void unusable(Error why);
  /// Ignored unless the link is up: what a socket still delivers after its link went down is of before.
  void controller(Controller controller);
  void stalled();

  [[nodiscard]] const PortState& state() const { return state_; }
  [[nodiscard]] bool link_up() const { return link_up_; }

 private:
  void forget();
  void conclude();
  [[nodiscard]] Error error(Reason reason, std::string message, std::string remedy) const;

  std::string bus_, interface_;
  bool link_up_ = false, passive_ = false, bus_off_ = false, stalled_ = false;
  std::optional<Error> objection_;
  PortState state_;
};

}  // namespace axisd::can
