#include "devices/axis/position_tracker.hpp"

#include <cstdlib>
#include <limits>

#include "devices/units/exact_scale.hpp"

namespace axisd {

struct PositionTracker::Exactly {
  Exact units;
};

PositionTracker::PositionTracker(const Scale& scale) : scale_(scale) {}
PositionTracker::~PositionTracker() = default;

void PositionTracker::update(std::int32_t counter, std::int64_t window) {
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
  if (base_ && std::abs(counter_ - base_->counter) > window) forget_base();
}

void PositionTracker::restart(std::int32_t counter) {
  counter_ = counter;
  known_ = true;
  offset_ = 0;
  trust_ = PositionTrust::unknown;
  forget_base();
}

double PositionTracker::position() const { return scale_.to_units(counter_ + offset_); }

std::int64_t PositionTracker::offset_for(double position) const {
  return scale_.to_pulses(position) - counter_;
}

void PositionTracker::declare(std::int64_t offset, PositionTrust trust) {
  offset_ = offset;
  trust_ = trust;
  forget_base();
}

void PositionTracker::restore(std::int64_t offset) {
  offset_ = offset;
  trust_ = PositionTrust::restored;
  forget_base();
}

void PositionTracker::rezero(std::int32_t counter_after) {
  // What the drive clears is where it was told to stand.
  const auto before = base_ ? base_->counter : counter_;
  offset_ += before - counter_after;
  counter_ = counter_after;
  if (base_) base_->counter = counter_after;
}

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
  Target target{.distance = std::make_shared<const Exactly>(Exactly{Exact(distance)})};
  return again(target);
}

PositionTracker::Target PositionTracker::again(const Target& target) const {
  if (!target.distance) return plan(*target.exact);
  const auto base = base_ ? base_->units->units : to_exact_units(scale_, counter_ + offset_);
  auto planned = plan({base + target.distance->units});
  planned.distance = target.distance;
  return planned;
}

void PositionTracker::settle_base() {
  if (base_) return;
  base_ = {.units = std::make_shared<const Exactly>(Exactly{to_exact_units(scale_, counter_ + offset_)}),
           .counter = counter_};
}

bool PositionTracker::rests_at(const Target& target) const {
  return target.counter == (base_ ? base_->counter : counter_);
}

std::int64_t PositionTracker::deviation(const Target& target) const {
  if (!target.distance) return 0;
  const auto asked = to_pulses(scale_, target.distance->units);
  if (!asked) return std::numeric_limits<std::int64_t>::max();
  return std::abs(target.counter - counter_ - *asked);
}

PositionTracker PositionTracker::after(const Target& target) const {
  auto then = *this;
  then.counter_ = target.counter;
  then.base_ = {.units = target.exact, .counter = target.counter};
  return then;
}

void PositionTracker::reached(const Target& target, std::int64_t window) {
  if (std::abs(counter_ - target.counter) > window) return forget_base();
  base_ = Base{.units = target.exact, .counter = target.counter};
}

}  // namespace axisd
