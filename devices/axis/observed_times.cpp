#include "devices/axis/observed_times.hpp"

#include <algorithm>
#include <utility>

namespace axisd {

void ObservedTimes::on_sample(const DriveSample& sample, bool busy) {
  if (last_) {
    const auto between = sample.asked_at - last_->asked_at;
    if (busy && last_->busy && sample.moving && last_->moving)
      values_.refresh_moving = std::max(values_.refresh_moving, between);
    if (!busy && !last_->busy) values_.refresh_idle = std::max(values_.refresh_idle, between);
  }
  last_ = {.asked_at = sample.asked_at, .busy = busy, .moving = sample.moving};
}

void ObservedTimes::stop_requested(TimePoint arrived, bool all) {
  // The one that waits longest counts; what comes meanwhile is served with it.
  if (!stop_) stop_ = {.arrived = arrived, .all = all};
}

std::optional<ObservedTimes::Late> ObservedTimes::stop_sent(TimePoint end, bool answered) {
  if (!stop_ || end < stop_->arrived || stop_->answered || (stop_->sent && !answered)) return std::nullopt;
  const bool first = !std::exchange(stop_->sent, true);
  stop_->answered = answered;
  const auto seen = end - stop_->arrived;
  if (first && delays_ != nullptr) delays_->of(stop_->all).frame.add(seen);
  auto& longest = stop_->all ? values_.stop_frame_all : values_.stop_frame;
  longest = std::max(longest, seen);
  if (!answered || seen <= expected_stop_) return std::nullopt;
  return Late{.seen = seen, .expected = std::exchange(expected_stop_, Duration::max())};
}

void ObservedTimes::standstill_confirmed(TimePoint at) {
  if (!stop_) return;
  auto& longest = stop_->all ? values_.standstill_all : values_.standstill;
  longest = std::max(longest, at - stop_->arrived);
  if (delays_ != nullptr) delays_->of(stop_->all).standstill.add(at - stop_->arrived);
  stop_.reset();
}

}  // namespace axisd
