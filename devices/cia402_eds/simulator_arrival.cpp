#include "devices/cia402_eds/simulator_arrival.hpp"

#include <algorithm>

namespace axisd::cia402_eds {

void Arrival::begin(bool limited) {
  reached_ = false;
  limited_ = limited;
}

void Arrival::arrive(TimePoint now) {
  reached_ = !limited_;
  watch_window(now);
}

void Arrival::watch_window(TimePoint now) {
  const auto most = objects_->window(0x6067);
  if (!reached_ || (most && !shaft_->within(*most, now)))
    in_window_since_.reset();
  else if (!in_window_since_)
    in_window_since_ = now;
}

Duration Arrival::shortest_stay() const { return std::chrono::milliseconds(objects_->get(0x6068)); }

bool Arrival::in_position(TimePoint now) const {
  const auto most = objects_->window(0x6067);
  if (!most) return reached_;
  return in_window_since_ && now - *in_window_since_ >= shortest_stay() && shaft_->within(*most, now);
}

TimePoint Arrival::next_event(TimePoint now) const {
  constexpr Duration cycle = std::chrono::milliseconds(1);
  if (!reached_ || in_position(now)) return TimePoint::max();
  if (in_window_since_) return std::max(now + cycle, *in_window_since_ + shortest_stay());
  return shaft_->encoder().wavers(shaft_->motor()) ? now + cycle : TimePoint::max();
}

}  // namespace axisd::cia402_eds
