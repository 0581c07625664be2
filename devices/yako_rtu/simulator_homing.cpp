// Homing of the simulated drive, manual 7.5: search, decelerate, leave the switch, approach it slowly.
#include <cstdlib>

#include "devices/yako_rtu/simulator.hpp"

namespace axisd::yako_rtu {

Input SimulatedDrive::homing_reference() const {
  const auto mode = memory_.get(reg::homing_mode);
  return mode == 2 ? Input::positive_limit : mode == 3 ? Input::negative_limit : Input::home;
}

/// Mode 1 ends forwards on some models (7.5): its search passes the switch, the slow approach comes back to
/// it.
bool SimulatedDrive::homing_ends_forwards() const {
  return memory_.get(reg::homing_mode) == 1 &&
         model_->homing_mode_1_ends_forwards != behaviour_.homing_mode_1_other_approach;
}

int SimulatedDrive::approach_direction() const { return homing_ends_forwards() ? 1 : homing_.direction; }

void SimulatedDrive::homing_run(int direction, double rpm) {
  const double time = memory_.get(reg::homing_time);
  motor_.run(direction, rates(rpm, time, time));
}

Fail SimulatedDrive::start_homing() {
  if (!enabled() || alarm_ != 0) return refusal();
  if (control_mode_ != 0) return Fail::none;
  if (motor_.moving()) return behaviour_.start_in_motion_refused ? Fail::access : Fail::none;
  if (!behaviour_.stop_terminal_only_edge &&
      (terminals_.active(Input::stop) || terminals_.active(Input::emergency_stop)))
    return Fail::none;
  if (starts_later({.activity = Activity::homing})) return Fail::none;
  ++starts_;
  begin_homing();
  return Fail::none;
}

void SimulatedDrive::begin_homing() {
  activity_ = last_activity_ = Activity::homing;
  homing_due_ = TimePoint::max();
  in_position_ = stopping_ = false;
  if (!behaviour_.homed_stays_during_homing) homed_ = false;
  homing_.direction = memory_.get(reg::homing_mode) % 2 == 0 ? 1 : -1;
  homing_.turns = 0;
  if (behaviour_.homing_accepts_active_switch && terminals_.active(homing_reference())) {
    phase_ = Phase::back_off;
    homing_run(-approach_direction(), memory_.get(reg::homing_search_speed));
    return;
  }
  phase_ = Phase::search;
  homing_run(homing_.direction, memory_.get(reg::homing_speed));
}

void SimulatedDrive::homing_edge(const InputEdge& edge) {
  if (activity_ != Activity::homing || edge.function != homing_reference()) return;
  if (phase_ == Phase::search && edge.rising) {
    phase_ = Phase::found;
    motor_.brake();
  } else if (phase_ == Phase::back_off && !edge.rising) {
    phase_ = Phase::left;
    motor_.brake();
  } else if (phase_ == Phase::approach && (edge.rising || behaviour_.homing_mode_1_either_edge)) {
    motor_.stop(false);  // slow enough to stop at once, on the pulse
    homing_reached();
  }
}

/// 7.5: "if the limit signal is encountered, the motor will reverse". In modes 2 and 3 the limit ahead is the
/// goal.
void SimulatedDrive::homing_limits() {
  const int direction = motor_.direction();
  const auto ahead = direction > 0 ? Input::positive_limit : Input::negative_limit;
  if (!terminals_.active(ahead) || ahead == homing_reference()) return;
  const bool goes_on = phase_ == Phase::back_off && homing_.turns > 0 && behaviour_.homing_never_gives_up;
  if (phase_ == Phase::search || goes_on) {
    phase_ = Phase::turn;
    motor_.brake();
  } else if (phase_ == Phase::back_off || phase_ == Phase::approach) {
    cut();
  }
}

void SimulatedDrive::approach() {
  phase_ = Phase::approach;
  homing_run(approach_direction(), memory_.get(reg::homing_search_speed));
}

void SimulatedDrive::homing_stopped() {
  const bool turns = phase_ == Phase::turn || phase_ == Phase::found || phase_ == Phase::left;
  if (behaviour_.homing_pauses && turns && homing_due_ == TimePoint::max()) {
    homing_due_ = now_ + std::chrono::milliseconds(100);
    return;
  }
  homing_due_ = TimePoint::max();
  switch (phase_) {
    case Phase::turn:
      if (++homing_.turns > 1 && !behaviour_.homing_never_gives_up) {
        finish();
        break;
      }
      if (behaviour_.homing_same_edge && !homing_ends_forwards() && homing_.turns % 2 == 1) {
        phase_ =
            Phase::back_off;  // through the switch, until it has been left on the side where the search began
        homing_run(-homing_.direction, memory_.get(reg::homing_speed));
        break;
      }
      if (!behaviour_.homing_same_edge || homing_ends_forwards()) homing_.direction = -homing_.direction;
      phase_ = Phase::search;
      homing_run(homing_.direction, memory_.get(reg::homing_speed));
      break;
    case Phase::found:
      if (homing_.direction != approach_direction() &&
          (!terminals_.active(Input::home) || behaviour_.homing_mode_1_either_edge)) {
        approach();
        break;
      }
      phase_ = Phase::back_off;
      homing_run(
          -approach_direction(),
          memory_.get(behaviour_.back_off_at_homing_speed ? reg::homing_speed : reg::homing_search_speed));
      break;
    case Phase::left:
      approach();
      break;
    case Phase::compensate:
      if (!behaviour_.zero_before_compensation) clear_counter();
      homed_ = true;
      finish();
      break;
    default:  // stopped on the way: not homed
      finish();
      break;
  }
}

/// On the switch: the compensation 0x0035 (forwards) and 0x0036 (backwards) follows, then the origin is set.
void SimulatedDrive::homing_reached() {
  phase_ = Phase::compensate;
  clear_counter();
  const auto offset = static_cast<std::int64_t>(memory_.get(reg::homing_positive_offset)) -
                      static_cast<std::int64_t>(memory_.get(reg::homing_negative_offset));
  if (offset == 0) {
    homing_stopped();
    return;
  }
  const double time = memory_.get(reg::homing_time);
  motor_.move(offset, rates(memory_.get(reg::homing_search_speed), time, time));
}

}  // namespace axisd::yako_rtu
