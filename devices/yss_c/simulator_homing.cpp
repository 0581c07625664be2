// Homing of the simulated drive, 6.2.6: search, decelerate, leave the switch, approach it slowly.
#include <cstdlib>

#include "devices/yss_c/simulator.hpp"

namespace axisd::yss_c {

namespace {

/// 6098h: what 6.2.6 numbers 17, 18, 24, 29 and chapter 7 numbers 3, 2, 0, 1.
struct Method {
  std::int64_t cia, own;
  int direction;
  std::uint8_t reference;  ///< code of the input function
  bool ends_forwards;      ///< against its search
};
constexpr Method methods[] = {
    {17, 3, -1, 3, false}, {18, 2, 1, 2, false}, {24, 0, 1, 1, false}, {29, 1, -1, 1, true}};

}  // namespace

int SimulatedDrive::approach_direction() const { return homing_ends_forwards_ ? 1 : homing_direction_; }

/// `speed_sub` of 6099h: 1 to search, 2 near the switch.
void SimulatedDrive::homing_run(int direction, std::uint8_t speed_sub) {
  const auto time = static_cast<double>(dictionary_.get(0x609A));
  motor_.run(direction, rates(static_cast<double>(dictionary_.get(0x6099, speed_sub)), time, time));
}

void SimulatedDrive::start_homing() {
  homing_error_ = true;  // until it is done
  if (motor_.moving() || !energised() || alarm_ != 0) return;
  if (!behaviour_.stop_terminal_only_edge && stop_held()) return;
  const auto code = dictionary_.get(0x6098);
  const Method* method = nullptr;
  for (const auto& one : methods)
    if ((code == one.cia && behaviour_.homing_codes_cia) ||
        (code == one.own && behaviour_.homing_codes_0_to_3))
      method = &one;
  if (method == nullptr || dictionary_.get(0x6099, 1) == 0 || dictionary_.get(0x6099, 2) == 0) return;
  ++starts_;
  activity_ = Activity::homing;
  homing_due_ = TimePoint::max();
  reached_ = stopping_ = homing_error_ = false;
  if (!behaviour_.homed_stays_during_homing) homed_ = false;
  homing_direction_ = method->direction;
  homing_reference_ = method->reference;
  homing_ends_forwards_ = method->ends_forwards && !behaviour_.homing_29_ends_backwards;
  homing_turns_ = 0;
  if (behaviour_.homing_accepts_active_switch && inputs_.active(homing_reference_)) {
    phase_ = Phase::back_off;
    homing_run(-approach_direction(), 2);
    return;
  }
  phase_ = Phase::search;
  homing_run(homing_direction_, 1);
}

void SimulatedDrive::homing_edge(const simulation::FunctionEdge& edge) {
  if (activity_ != Activity::homing || edge.function != homing_reference_) return;
  if (phase_ == Phase::search && edge.rising) {
    phase_ = Phase::found;
    motor_.brake();
  } else if (phase_ == Phase::back_off && !edge.rising) {
    phase_ = Phase::left;
    motor_.brake();
  } else if (phase_ == Phase::approach && edge.rising) {
    motor_.stop(false);  // slow enough to stop at once, on the pulse
    homing_reached();
  }
}

/// 24, 29: "when it meets the limit, it goes on searching the other way". In 17 and 18 the limit ahead is the
/// goal.
void SimulatedDrive::homing_limits() {
  const int direction = motor_.direction();
  const auto ahead = direction > 0 ? input_positive_limit : input_negative_limit;
  if (!inputs_.active(ahead) || ahead == homing_reference_) return;
  if (phase_ == Phase::search) {
    phase_ = Phase::turn;
    motor_.brake();
  } else if (phase_ == Phase::back_off || phase_ == Phase::approach) {
    cut();
  }
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
      if (++homing_turns_ > 1) {  // between both limits there is no switch
        homing_failed();
        break;
      }
      homing_direction_ = -homing_direction_;
      phase_ = Phase::search;
      homing_run(homing_direction_, 1);
      break;
    case Phase::found:
      // 29 has no backing off: where it came past the switch, it turns.
      if (homing_direction_ != approach_direction() && !inputs_.active(homing_reference_)) {
        phase_ = Phase::approach;
        homing_run(approach_direction(), 2);
        break;
      }
      phase_ = Phase::back_off;
      homing_run(-approach_direction(), 2);
      break;
    case Phase::left:
      phase_ = Phase::approach;
      homing_run(approach_direction(), 2);
      break;
    case Phase::compensate:
      if (!behaviour_.offset_without_move) motor_.clear_counter();
      homed_ = true;
      homing_error_ = false;
      finish();
      break;
    default:  // stopped on the way
      homing_failed();
      break;
  }
}

void SimulatedDrive::homing_failed() {
  homing_error_ = true;
  phase_ = Phase::ending;
  finish();
}

/// On the switch: the offset 607Ch follows.
void SimulatedDrive::homing_reached() {
  phase_ = Phase::compensate;
  const auto offset = dictionary_.get(0x607C);
  if (behaviour_.offset_without_move) {
    motor_.set_counter(static_cast<std::int32_t>(-offset));  // CiA 402: zero is at home + offset
    homing_stopped();
    return;
  }
  motor_.clear_counter();
  if (offset == 0) {
    homing_stopped();
    return;
  }
  const auto time = static_cast<double>(dictionary_.get(0x609A));
  motor_.move(offset, rates(static_cast<double>(dictionary_.get(0x6099, 2)), time, time));
}

}  // namespace axisd::yss_c
