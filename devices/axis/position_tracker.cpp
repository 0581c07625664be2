#include "devices/axis/position_tracker.hpp"

#include <limits>

#include "devices/units/exact_scale.hpp"

namespace axisd {

struct PositionTracker::Exactly {
  Exact units;
};

PositionTracker::PositionTracker(const Scale& scale) : scale_(scale) {}
PositionTracker::~PositionTracker() = default;

void PositionTracker::update(std::int32_t counter) {
  if (!known_) {
    counter_ = counter;
    known_ = true;
    return;
  }
  // The difference of two readings is small, so it is right even where the 32-bit counter wrapped between
  // them.
  const auto step = static_cast<std::int32_t>(
      static_cast<std::uint32_t>(counter) - static_cast<std::uint32_t>(static_cast<std::uint64_t>(counter_)));
  counter_ += step;
}

void PositionTracker::restart(std::int32_t counter) {
  counter_ = counter;
  known_ = true;
  offset_ = 0;
  trust_ = PositionTrust::unknown;
  forget_target();
}

double PositionTracker::position() const { return scale_.to_units(counter_ + offset_); }

std::int64_t PositionTracker::offset_for(double position) const {
  return scale_.to_pulses(position) - counter_;
}

void PositionTracker::set_position(double position, PositionTrust trust) {
  offset_ = offset_for(position);
  trust_ = trust;
  commanded_ = std::make_shared<const Exactly>(Exact(position));
}

void PositionTracker::restore(std::int64_t offset) {
  offset_ = offset;
  trust_ = PositionTrust::restored;
  forget_target();
}

void PositionTracker::rezero(std::int32_t counter_after) {
  offset_ += counter_ - counter_after;
  counter_ = counter_after;
}

void PositionTracker::forget_target() { commanded_.reset(); }

PositionTracker::Target PositionTracker::plan(Exactly target) const {
  constexpr auto limits = std::numeric_limits<std::int64_t>{};
  const auto pulses =
      to_pulses(scale_, target.units)
          .value_or((target.units > 0) != scale_.settings().invert ? limits.max() : limits.min());
  std::int64_t counter = 0;
  if (__builtin_sub_overflow(pulses, offset_, &counter)) counter = pulses;  // far beyond any range either way
  return {.position = target.units.convert_to<double>(),
          .counter = counter,
          .exact = std::make_shared<const Exactly>(std::move(target))};
}

PositionTracker::Target PositionTracker::plan_absolute(double position) const {
  return plan({Exact(position)});
}

PositionTracker::Target PositionTracker::plan_relative(double distance) const {
  const auto base = commanded_ ? commanded_->units : to_exact_units(scale_, counter_ + offset_);
  return plan({base + Exact(distance)});
}

PositionTracker PositionTracker::after(const Target& target) const {
  auto then = *this;
  then.counter_ = target.counter;
  then.commanded_ = target.exact;
  return then;
}

void PositionTracker::reached(std::shared_ptr<const Exactly> target) { commanded_ = std::move(target); }

}  // namespace axisd
