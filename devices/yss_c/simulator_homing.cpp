#include "devices/yss_c/simulator_homing.hpp"

#include "devices/yss_c/simulator_rates.hpp"

namespace axisd::yss_c {

namespace {

/// 6098h: what 6.2.6 numbers 17, 18, 24, 29 and chapter 7 numbers 3, 2, 0, 1.
struct Method {
  std::int64_t cia, own;
  int direction;
  std::uint8_t reference;  ///< code of the input function
  bool ends_forwards;      ///< against its search
};
constexpr Method methods[] = {{17, 3, -1, input_negative_limit, false},
                              {18, 2, 1, input_positive_limit, false},
                              {24, 0, 1, input_home, false},
                              {29, 1, -1, input_home, true}};

const Method* method_of(std::int64_t code, const Behaviour& behaviour) {
  const Method* found = nullptr;
  for (const auto& one : methods)
    if ((code == one.cia && behaviour.homing_codes_cia) || (code == one.own && behaviour.homing_codes_0_to_3))
      found = &one;
  return found;
}

}  // namespace

/// `speed_sub` of 6099h: 1 to search, 2 near the switch.
void Homing::run(int direction, std::uint8_t speed_sub) {
  const auto time = static_cast<double>(dictionary_->get(0x609A));
  motor_->run(direction,
              rates_of(*dictionary_, static_cast<double>(dictionary_->get(0x6099, speed_sub)), time, time));
}

void Homing::search() {
  phase_ = Phase::search;
  run(direction_, 1);
}

void Homing::back_off() {
  phase_ = Phase::back_off;
  run(-approach_direction(), 2);
}

void Homing::approach() {
  phase_ = Phase::approach;
  run(approach_direction(), 2);
}

bool Homing::begin() {
  const auto* method = method_of(dictionary_->get(0x6098), *behaviour_);
  if (method == nullptr || dictionary_->get(0x6099, 1) == 0 || dictionary_->get(0x6099, 2) == 0) return false;
  due_ = TimePoint::max();
  failed_ = false;
  if (!behaviour_->homed_stays_during_homing) homed_ = false;
  direction_ = method->direction;
  reference_ = method->reference;
  ends_forwards_ = method->ends_forwards && !behaviour_->homing_29_ends_backwards;
  turns_ = 0;
  if (behaviour_->homing_accepts_active_switch && inputs_->active(reference_))
    back_off();
  else
    search();
  return true;
}

bool Homing::on_edge(const simulation::FunctionEdge& edge, TimePoint now) {
  if (edge.function != reference_) return false;
  if (phase_ == Phase::search && edge.rising) {
    phase_ = Phase::found;
    motor_->brake();
  } else if (phase_ == Phase::back_off && !edge.rising) {
    phase_ = Phase::left;
    motor_->brake();
  } else if (phase_ == Phase::approach && edge.rising) {
    motor_->stop(false);  // slow enough to stop at once, on the pulse
    return compensate(now);
  }
  return false;
}

/// 24, 29: "when it meets the limit, it goes on searching the other way". In 17 and 18 the limit ahead is the
/// goal.
bool Homing::ends_at_limit() {
  const auto ahead = motor_->direction() > 0 ? input_positive_limit : input_negative_limit;
  if (!inputs_->active(ahead) || ahead == reference_) return false;
  if (phase_ == Phase::search) {
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
      if (++turns_ > 1) return fail();  // between both limits there is no switch
      direction_ = -direction_;
      search();
      return false;
    case Phase::found:
      // 29 has no backing off: where it came past the switch, it turns.
      if (direction_ != approach_direction() && !inputs_->active(reference_))
        approach();
      else
        back_off();
      return false;
    case Phase::left:
      approach();
      return false;
    case Phase::compensate:
      if (!behaviour_->offset_without_move) motor_->clear_counter();
      homed_ = true;
      failed_ = false;
      return true;
    default:  // stopped on the way
      return fail();
  }
}

bool Homing::fail() {
  failed_ = true;
  phase_ = Phase::ending;
  return true;
}

/// On the switch: the offset 607Ch follows.
bool Homing::compensate(TimePoint now) {
  phase_ = Phase::compensate;
  const auto offset = dictionary_->get(0x607C);
  if (behaviour_->offset_without_move) {
    motor_->set_counter(static_cast<std::int32_t>(-offset));  // CiA 402: zero is at home + offset
    return on_stopped(now);
  }
  motor_->clear_counter();
  if (offset == 0) return on_stopped(now);
  const auto time = static_cast<double>(dictionary_->get(0x609A));
  motor_->move(offset, rates_of(*dictionary_, static_cast<double>(dictionary_->get(0x6099, 2)), time, time));
  return false;
}

}  // namespace axisd::yss_c
