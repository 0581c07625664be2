#include "devices/axis/unseen_start.hpp"

#include "devices/axis/motion_machine.hpp"

namespace axisd {

int UnseenStart::sending(std::int64_t base, TimePoint now) {
  since_ = now;
  state_ = State::sending;
  base_ = base;
  return ++starts_;
}

void UnseenStart::sent(int start, TimePoint now) {
  if (start == starts_) wait_from(now);
}

void UnseenStart::not_sent(int start) {
  if (start == starts_) state_ = State::none;
}

void UnseenStart::left(TimePoint now) { wait_from(now); }

void UnseenStart::wait_from(TimePoint now) {
  if (state_ != State::sending) return;
  state_ = State::unseen;
  until_ = now + start_window;
}

bool UnseenStart::look(const Reading& reading) {
  if (state_ == State::none || reading.asked_at < since_) return false;
  const bool over = state_ == State::unseen && reading.asked_at >= until_;
  if (reading.moving || reading.elsewhere || over) state_ = State::none;
  if (reading.moving) ++begun_;
  return reading.moving;
}

}  // namespace axisd
