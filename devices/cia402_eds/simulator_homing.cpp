// Homing mode (CiA 402, homing methods without index pulse): a limit switch is left again and home is its
// edge; the home switch's edge is always met from the same side.
#include "devices/cia402_eds/simulator.hpp"

namespace axisd::cia402_eds {

const StandardDrive::Method* StandardDrive::find_method(std::int64_t code) {
  static constexpr Method methods[] = {
      {.code = 17, .reference = negative_limit, .search = -1, .leave = 1, .approach = 0},
      {.code = 18, .reference = positive_limit, .search = 1, .leave = -1, .approach = 0},
      {.code = 24, .reference = home_switch, .search = 1, .leave = -1, .approach = 1},
      {.code = 25, .reference = home_switch, .search = 1, .leave = 1, .approach = -1},
      {.code = 28, .reference = home_switch, .search = -1, .leave = 1, .approach = -1},
      {.code = 29, .reference = home_switch, .search = -1, .leave = -1, .approach = 1},
  };
  for (const auto& method : methods)
    if (method.code == code) return &method;
  return nullptr;
}

void StandardDrive::start_homing() {
  constexpr int current_position = 35, current_position_too = 37;
  const auto code = dictionary_.get(0x6098);
  if (motor_.moving()) return;
  attained_ = homing_error_ = homing_interrupted_ = mode_changed_ = false;
  if (code == current_position || code == current_position_too) {
    homing_done();
    return;
  }
  method_ = find_method(code);
  if (method_ == nullptr) {
    homing_error_ = true;
    return;
  }
  ++starts_;
  activity_ = Activity::homing;
  stopping_ = false;
  search_direction_ = method_->search;
  turns_ = 0;
  const bool on_it = inputs_.active(method_->reference);
  phase_ = on_it ? Phase::leave : Phase::search;
  homing_run(on_it ? method_->leave : search_direction_, on_it ? 2 : 1);
}

void StandardDrive::homing_run(int direction, std::uint8_t speed_sub) {
  const auto rate = ramp(0x609A);
  const bool has_speeds = dictionary_.find(0x6099, speed_sub) != nullptr;
  const auto cruise = has_speeds ? speed(dictionary_.get(0x6099, speed_sub)) : profile_speed() / speed_sub;
  if (cruise > 0)
    motor_.run(direction, {.cruise = cruise, .acceleration = rate, .deceleration = rate});
  else
    homing_failed();
}

void StandardDrive::homing_edge(const simulation::FunctionEdge& edge) {
  if (activity_ != Activity::homing || edge.function != method_->reference) return;
  if (phase_ == Phase::search && edge.rising) {
    phase_ = Phase::found;
    motor_.brake();
  } else if (phase_ == Phase::leave && !edge.rising) {
    if (method_->approach == 0) {
      motor_.stop(false);  // slow enough to stop on the increment
      homing_done();
      return;
    }
    phase_ = Phase::left;
    motor_.brake();
  } else if (phase_ == Phase::approach && edge.rising) {
    motor_.stop(false);
    homing_done();
  }
}

/// The other limit, or the same one a second time, ends the search: there is no switch.
void StandardDrive::homing_limit() {
  const auto ahead = motor_.direction() > 0 ? positive_limit : negative_limit;
  if (ahead == method_->reference || motor_.braking()) return;
  if (phase_ == Phase::search) {
    phase_ = Phase::turn;
    motor_.brake(ramp(0x6085));
  } else {
    homing_failed();
  }
}

void StandardDrive::homing_stopped() {
  constexpr Duration pause = std::chrono::milliseconds(100);
  if (behaviour_.homing_pauses && phase_ != Phase::ending)
    phase_due_ = now_ + pause;
  else
    next_phase();
}

/// Stopped while it rested between two phases.
void StandardDrive::end_pause() {
  if (phase_due_ == TimePoint::max()) return;
  phase_due_ = TimePoint::max();
  phase_ = Phase::ending;
  activity_ = Activity::none;
}

void StandardDrive::next_phase() {
  phase_due_ = TimePoint::max();
  switch (phase_) {
    case Phase::turn:
      if (++turns_ > 1 || method_->approach == 0) {
        homing_failed();
        break;
      }
      search_direction_ = -search_direction_;
      phase_ = Phase::search;
      homing_run(search_direction_, 1);
      break;
    case Phase::found:
      // Braking may have carried it across the switch already, to the side where home is.
      if (!inputs_.active(method_->reference) && method_->leave == search_direction_) {
        phase_ = Phase::approach;
        homing_run(method_->approach, 2);
        break;
      }
      phase_ = Phase::leave;
      homing_run(method_->leave, 2);
      break;
    case Phase::left:
      phase_ = Phase::approach;
      homing_run(method_->approach, 2);
      break;
    default:  // stopped on the way
      activity_ = Activity::none;
      stopping_ = false;
      break;
  }
}

/// The zero position is home plus 607Ch; the drive does not move there.
void StandardDrive::homing_done() {
  motor_.set_counter(static_cast<std::int32_t>(-dictionary_.get(0x607C)));
  last_target_ = motor_.commanded();
  constexpr Duration apart = std::chrono::milliseconds(20);
  attained_ = true;
  homing_bits_due_ = now_ + apart;
  activity_ = Activity::none;
  stopping_ = false;
}

void StandardDrive::homing_failed() {
  homing_error_ = true;
  stop_motion(ramp(0x6085));
  if (!motor_.moving()) activity_ = Activity::none;
}

}  // namespace axisd::cia402_eds
