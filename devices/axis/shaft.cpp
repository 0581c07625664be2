#include "devices/axis/shaft.hpp"

#include <algorithm>
#include <cstdlib>

namespace axisd {

Shaft::Shaft(const AxisContext& context)
    : context_(context), sampled_(context.env.executor, *context.env.clock), tracker_(context.scale) {}

bool Shaft::input_active(std::string_view function) const {
  return sample_ && context_.terminals.active(*sample_, function);
}

bool Shaft::limit_active(bool positive) const {
  return input_active(positive ? "positive_limit" : "negative_limit");
}

bool Shaft::on_homing_switch() const {
  const auto& homing = context_.settings.homing;
  return homing && !homing->number && input_active(context_.homing_switch());
}

bool Shaft::is_at(const PositionTracker::Target& target) const {
  return std::abs(tracker_.counter() - target.counter) <= context_.target_tolerance();
}

bool Shaft::is_near(const PositionTracker::Target& target) const {
  constexpr std::int64_t noise_counts = 2;
  const auto wavering = std::max<std::int64_t>(context_.drive->position_window() / 2, noise_counts);
  return std::abs(tracker_.counter() - target.counter) <= context_.target_tolerance() + wavering;
}

bool Shaft::moved_from(std::int64_t counter) const {
  return std::abs(tracker_.counter() - counter) > context_.drive->position_window();
}

bool Shaft::found_in_motion() const { return sample_->moving || sample_->mode == DriveMode::homing; }

bool Shaft::looks_restarted(const DriveSample& sample) const {
  if (!sample_) return false;
  const auto step = std::int64_t{sample.position_pulses} - sample_->position_pulses;
  return sample.enabled != sample_->enabled ||
         (!sample.moving && std::abs(step) > context_.drive->position_window());
}

}  // namespace axisd
