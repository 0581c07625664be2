#include "devices/cia402_eds/simulator_homing.hpp"

namespace axisd::cia402_eds {

namespace {

constexpr int current_position = 35, current_position_too = 37;

bool where_it_stands(std::int64_t method) {
  return method == current_position || method == current_position_too;
}

}  // namespace

const Homing::Method* Homing::find(std::int64_t code) {
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

bool Homing::knows(std::int64_t method) {
  return method == 0 || where_it_stands(method) || find(method) != nullptr;
}

Homing::Begin Homing::begin() {
  forget();
  const auto code = objects_->get(0x6098);
  if (where_it_stands(code)) return Begin::where_it_stands;
  const auto* found = find(code);
  if (found == nullptr) {
    failed_ = true;
    return Begin::unknown;
  }
  method_ = found;
  direction_ = method_->search;
  turns_ = 0;
  return Begin::search;
}

Homing::Outcome Homing::first_phase() {
  return inputs_->active(method_->reference) ? leave() : run(Phase::search, direction_, 1);
}

/// `speed_sub` of 6099h: 1 to search, 2 near the switch.
Homing::Outcome Homing::run(Phase phase, int direction, std::uint8_t speed_sub) {
  phase_ = phase;
  const auto rate = objects_->ramp(0x609A);
  const auto cruise = objects_->has(0x6099, speed_sub) ? objects_->speed(objects_->get(0x6099, speed_sub))
                                                       : objects_->profile_speed() / speed_sub;
  if (cruise <= 0) return Outcome::failed;
  motor_->run(direction, {.cruise = cruise, .acceleration = rate, .deceleration = rate});
  return Outcome::goes_on;
}

Homing::Outcome Homing::on_edge(const simulation::FunctionEdge& edge) {
  if (edge.function != method_->reference) return Outcome::goes_on;
  if (phase_ == Phase::search && edge.rising) {
    phase_ = Phase::found;
    motor_->brake();
  } else if (phase_ == Phase::leave && !edge.rising) {
    if (method_->approach == 0) {
      motor_->stop(false);  // slow enough to stop on the increment
      return Outcome::done;
    }
    phase_ = Phase::left;
    motor_->brake();
  } else if (phase_ == Phase::approach && edge.rising) {
    motor_->stop(false);
    return Outcome::done;
  }
  return Outcome::goes_on;
}

/// The other limit, or the same one a second time, ends the search: there is no switch.
Homing::Outcome Homing::at_limit() {
  const auto ahead = motor_->direction() > 0 ? positive_limit : negative_limit;
  if (ahead == method_->reference || motor_->braking()) return Outcome::goes_on;
  if (phase_ != Phase::search) return Outcome::failed;
  phase_ = Phase::turn;
  motor_->brake(objects_->ramp(0x6085));
  return Outcome::goes_on;
}

Homing::Outcome Homing::on_stopped(TimePoint now) {
  constexpr Duration pause = std::chrono::milliseconds(100);
  if (!behaviour_->homing_pauses || phase_ == Phase::ending) return next_phase();
  due_ = now + pause;
  return Outcome::goes_on;
}

bool Homing::end_pause() {
  if (due_ == TimePoint::max()) return false;
  due_ = TimePoint::max();
  phase_ = Phase::ending;
  return true;
}

Homing::Outcome Homing::next_phase() {
  due_ = TimePoint::max();
  switch (phase_) {
    case Phase::turn:
      if (++turns_ > 1 || method_->approach == 0) return Outcome::failed;
      direction_ = -direction_;
      return run(Phase::search, direction_, 1);
    case Phase::found: {
      // Braking may have carried it across the switch already, to the side where home is.
      const bool across = !inputs_->active(method_->reference) && method_->leave == direction_;
      return across ? approach() : leave();
    }
    case Phase::left:
      return approach();
    default:  // stopped on the way
      return Outcome::over;
  }
}

void Homing::attain(TimePoint told_from) {
  attained_ = true;
  told_from_ = told_from;
}

}  // namespace axisd::cia402_eds
