#include "devices/yako_rtu/simulator_homing.hpp"

namespace axisd::yako_rtu {

Input Homing::reference() const {
  const auto mode = memory_->get(reg::homing_mode);
  return mode == 2 ? Input::positive_limit : mode == 3 ? Input::negative_limit : Input::home;
}

/// Mode 1 ends forwards on some models (7.5): its search passes the switch, the slow approach comes back to
/// it.
bool Homing::ends_forwards() const {
  return memory_->get(reg::homing_mode) == 1 &&
         model_->homing_mode_1_ends_forwards != behaviour_->homing_mode_1_other_approach;
}

int Homing::approach_direction() const { return ends_forwards() ? 1 : direction_; }

/// `speed`: the register that holds it.
void Homing::run(int direction, std::uint16_t speed) {
  const double time = memory_->get(reg::homing_time);
  motor_->run(direction, memory_->rates(memory_->get(speed), time, time));
}

void Homing::search(int direction) {
  direction_ = direction;
  phase_ = Phase::search;
  run(direction, reg::homing_speed);
}

void Homing::back_off(int direction, std::uint16_t speed) {
  phase_ = Phase::back_off;
  run(direction, speed);
}

void Homing::approach() {
  phase_ = Phase::approach;
  run(approach_direction(), reg::homing_search_speed);
}

void Homing::begin() {
  due_ = TimePoint::max();
  if (!behaviour_->homed_stays_during_homing) homed_ = false;
  direction_ = memory_->get(reg::homing_mode) % 2 == 0 ? 1 : -1;
  turns_ = 0;
  if (behaviour_->homing_accepts_active_switch && terminals_->active(reference()))
    back_off(-approach_direction(), reg::homing_search_speed);
  else
    search(direction_);
}

bool Homing::on_edge(const InputEdge& edge, TimePoint now) {
  if (edge.function != reference()) return false;
  if (phase_ == Phase::search && edge.rising) {
    phase_ = Phase::found;
    motor_->brake();
  } else if (phase_ == Phase::back_off && !edge.rising) {
    phase_ = Phase::left;
    motor_->brake();
  } else if (phase_ == Phase::approach && (edge.rising || behaviour_->homing_mode_1_either_edge)) {
    motor_->stop(false);  // slow enough to stop at once, on the pulse
    return compensate(now);
  }
  return false;
}

/// 7.5: "if the limit signal is encountered, the motor will reverse". In modes 2 and 3 the limit ahead is the
/// goal.
bool Homing::ends_at_limit() {
  const auto ahead = motor_->direction() > 0 ? Input::positive_limit : Input::negative_limit;
  if (!terminals_->active(ahead) || ahead == reference()) return false;
  const bool goes_on = phase_ == Phase::back_off && turns_ > 0 && behaviour_->homing_never_gives_up;
  if (phase_ == Phase::search || goes_on) {
    phase_ = Phase::turn;
    motor_->brake();
    return false;
  }
  return phase_ == Phase::back_off || phase_ == Phase::approach;
}

bool Homing::on_stopped(TimePoint now) {
  const bool turns = phase_ == Phase::turn || phase_ == Phase::found || phase_ == Phase::left;
  if (behaviour_->homing_pauses && turns && !pauses()) {
    due_ = now + std::chrono::milliseconds(100);
    return false;
  }
  due_ = TimePoint::max();
  switch (phase_) {
    case Phase::turn:
      return turn_round();
    case Phase::found:
      if (direction_ != approach_direction() &&
          (!terminals_->active(Input::home) || behaviour_->homing_mode_1_either_edge))
        approach();
      else
        back_off(-approach_direction(),
                 behaviour_->back_off_at_homing_speed ? reg::homing_speed : reg::homing_search_speed);
      return false;
    case Phase::left:
      approach();
      return false;
    case Phase::compensate:
      if (!behaviour_->zero_before_compensation) position_->clear();
      homed_ = true;
      return true;
    default:  // stopped on the way: not homed
      return true;
  }
}

bool Homing::turn_round() {
  if (++turns_ > 1 && !behaviour_->homing_never_gives_up) return true;
  const bool same_edge = behaviour_->homing_same_edge && !ends_forwards();
  if (same_edge && turns_ % 2 == 1)
    // Through the switch, until it has been left on the side where the search began.
    back_off(-direction_, reg::homing_speed);
  else
    search(same_edge ? direction_ : -direction_);
  return false;
}

/// On the switch: the compensation 0x0035 (forwards) and 0x0036 (backwards) follows, then the origin is set.
bool Homing::compensate(TimePoint now) {
  phase_ = Phase::compensate;
  position_->clear();
  const auto offset = static_cast<std::int64_t>(memory_->get(reg::homing_positive_offset)) -
                      static_cast<std::int64_t>(memory_->get(reg::homing_negative_offset));
  if (offset == 0) return on_stopped(now);
  const double time = memory_->get(reg::homing_time);
  motor_->move(offset, memory_->rates(memory_->get(reg::homing_search_speed), time, time));
  return false;
}

}  // namespace axisd::yako_rtu
