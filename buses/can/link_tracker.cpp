#include "buses/can/link_tracker.hpp"

#include <fmt/format.h>

#include <utility>

namespace axisd::can {

LinkTracker::LinkTracker(std::string bus, std::string interface)
    : bus_(std::move(bus)), interface_(std::move(interface)) {
  removed();
}

Error LinkTracker::error(Reason reason, std::string message, std::string remedy) const {
  Error error{.reason = reason, .message = std::move(message), .remedy = std::move(remedy)};
  error.where.bus = bus_;
  return error;
}

void LinkTracker::forget() {
  link_up_ = passive_ = bus_off_ = stalled_ = false;
  objection_.reset();
}

void LinkTracker::removed() {
  forget();
  state_ = {.link = InterfaceState::removed,
            .error = error(Reason::bus_down, fmt::format("there is no CAN interface {}", interface_),
                           "connect the adapter, or correct the interface's name (ip link show type can)")};
}

void LinkTracker::down() {
  forget();
  state_ = {.link = InterfaceState::down,
            .error = error(Reason::bus_down, fmt::format("CAN interface {} is down", interface_),
                           fmt::format("configure it and set it up (ip link set {} up)", interface_))};
}

void LinkTracker::unusable(Error why) {
  forget();
  why.where.bus = bus_;
  state_ = {.link = InterfaceState::down, .error = std::move(why)};
}

void LinkTracker::up(std::optional<Error> objection) {
  link_up_ = true;
  objection_ = std::move(objection);
  if (objection_) objection_->where.bus = bus_;
  conclude();
}

void LinkTracker::controller(Controller controller) {
  if (!link_up_) return;
  passive_ = controller == Controller::passive;
  if (controller == Controller::bus_off) bus_off_ = true;
  conclude();
}

void LinkTracker::stalled() {
  if (!link_up_) return;
  stalled_ = true;
  conclude();
}

void LinkTracker::conclude() {
  const auto cycle =
      interface_ == simulated_interface
          ? std::string("a simulated link goes down and up by itself")
          : fmt::format("mend the cause; then the link goes down and up (ip link set {} down, up)",
                        interface_);
  if (bus_off_) {
    state_ = {.link = InterfaceState::bus_off,
              .error = error(Reason::bus_down,
                             fmt::format("CAN interface {} is bus-off: too many errors", interface_),
                             "check wiring, termination and bit rate; " + cycle)};
  } else if (stalled_) {
    state_ = {.link = InterfaceState::stalled,
              .error = error(Reason::bus_down,
                             fmt::format("CAN interface {} takes frames, but does not send them", interface_),
                             "check that another node is powered, the wiring and the adapter; " + cycle)};
  } else if (objection_) {
    state_ = {.link = InterfaceState::down, .error = objection_};
  } else if (passive_) {
    state_ = {.link = InterfaceState::error_passive,
              .error = error(Reason::bus_down, fmt::format("CAN interface {} is error-passive", interface_),
                             "check wiring, termination, bit rate and that another node is powered")};
  } else {
    state_ = {.link = InterfaceState::up, .error = std::nullopt};
  }
}

}  // namespace axisd::can
