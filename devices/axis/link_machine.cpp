#include "devices/axis/link_machine.hpp"

namespace axisd {

LinkState LinkMachine::shown() const {
  switch (state_) {
    case State::offline:
    case State::silent:
      return LinkState::offline;
    case State::configuring:
    case State::verifying:
      return LinkState::configuring;
    case State::online:
      break;
  }
  return LinkState::online;
}

bool LinkMachine::answers() {
  if (shown() == LinkState::configuring) return false;
  go_answering();
  error_.reset();
  return true;
}

void LinkMachine::configured() {
  if (state_ == State::configuring) state_ = State::verifying;
  if (state_ == State::offline) state_ = State::silent;
}

void LinkMachine::connected() {
  state_ = State::online;
  error_.reset();
}

bool LinkMachine::failed(const Error& cause, bool answers) {
  answers ? go_answering() : go_silent();
  const bool news = !error_ || error_->reason != cause.reason;
  error_ = cause;
  return news;
}

void LinkMachine::port_closed(Error cause) {
  go_silent();
  error_ = std::move(cause);
}

void LinkMachine::lost(const Error& cause) {
  go_silent();
  error_ = cause;
}

void LinkMachine::restarted(const Error& cause) {
  ++restarts_;
  state_ = State::configuring;
  error_ = cause;
}

void LinkMachine::reconfigure(Error cause) {
  state_ = State::configuring;
  error_ = std::move(cause);
}

bool LinkMachine::bus_lost(Error cause) {
  if (!online()) return false;
  bus_loss_ = std::move(cause);
  return true;
}

}  // namespace axisd
