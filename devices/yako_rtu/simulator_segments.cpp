#include "devices/yako_rtu/simulator_segments.hpp"

#include <cmath>

namespace axisd::yako_rtu {

namespace {

constexpr Duration stable = std::chrono::milliseconds(5);

std::uint16_t address_of(std::uint16_t first, int segment) {
  return static_cast<std::uint16_t>(first + segment - 1);
}

}  // namespace

std::uint16_t Segments::value(std::uint16_t first, int segment) const {
  return memory_->get(address_of(first, segment));
}

void Segments::pin_changed(TimePoint now) {
  pins_changed_ = now;
  due_ = TimePoint::max();  // not stable for 5 ms after the PT edge
}

void Segments::select(TimePoint now) {
  selected_ = terminals_->segment();
  if (selected_ != 0 && now >= pins_changed_ + stable) due_ = now + stable;
}

simulation::Plan Segments::begin_selected(const simulation::Motor& motor) {
  due_ = TimePoint::max();
  const std::int64_t pulses = memory_->get_long(address_of(reg::segment_pulses_high, selected_),
                                                address_of(reg::segment_pulses_low, selected_));
  const bool absolute = memory_->get(reg::terminal_move_mode) == 1;
  const double time = value(reg::segment_time, selected_);
  return aimed({.activity = simulation::Activity::pt,
                .target = pulses + motor.commanded() - (absolute ? motor.counter() : 0),
                .rates = memory_->rates(value(reg::segment_speed, selected_), time, time)},
               motor);
}

int Segments::wanted_rpm() const {
  const int segment = pv_segment();
  const int magnitude = segment == 0 ? 0 : value(reg::segment_pv_speed, segment);
  return terminals_->active(Input::pv_direction) ? -magnitude : magnitude;
}

simulation::Plan Segments::pv_plan() const {
  const int segment = pv_segment();
  const double time = value(reg::segment_time, segment);
  return {.activity = simulation::Activity::pv,
          .direction = terminals_->active(Input::pv_direction) ? -1 : 1,
          .rates = memory_->rates(value(reg::segment_pv_speed, segment), time, time)};
}

simulation::Rates Segments::changed(const simulation::Plan& plan, double speed) const {
  auto rates = plan.rates;
  const double time = value(reg::segment_time, pv_segment());
  const auto change = std::abs(rates.cruise - speed);
  if (time > 0 && change > 0) rates.acceleration = change * 1000 / time;
  return rates;
}

void Segments::stop() {
  due_ = TimePoint::max();
  pv_on_ = false;
}

}  // namespace axisd::yako_rtu
