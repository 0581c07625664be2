// What the motor of a simulated drive is about, and the motion that waits behind the one under way.
#pragma once

#include <cstdint>
#include <optional>
#include <utility>

#include "devices/simulation/motor.hpp"

namespace axisd::simulation {

/// `pt`, `pv`: position or velocity of a table whose segments terminals select.
enum class Activity : std::uint8_t { none, position, velocity, jog, pt, pv, homing };

/// A motion to begin. Positions are the motor's, not the counter's.
struct Plan {
  Activity activity = Activity::none;
  std::optional<std::int64_t> target{};  ///< nothing: endless in `direction`
  int direction = 1;
  Rates rates{};
  bool shortened = false;  ///< ends at a software limit
};

/// Plans with a target have the direction to it from where the motor stands.
[[nodiscard]] Plan aimed(Plan plan, const Motor& motor);

/// Begins plans, one after the other. Whether one may begin is the drive's to decide.
class Motion {
 public:
  /// `motor` must outlive it.
  explicit Motion(Motor& motor) : motor_(&motor) {}

  [[nodiscard]] Activity activity() const { return activity_; }
  [[nodiscard]] Activity last_activity() const { return last_activity_; }  ///< started last
  [[nodiscard]] bool is(Activity activity) const { return activity_ == activity; }
  /// It will not complete.
  [[nodiscard]] bool stopping() const { return stopping_; }
  /// A position move that will complete is under way.
  [[nodiscard]] bool positions() const {
    return activity_ == Activity::position && motor_->moving() && !stopping_;
  }
  /// Of the last position move.
  [[nodiscard]] std::int64_t last_target() const { return last_target_; }
  void set_last_target(std::int64_t target) { last_target_ = target; }
  [[nodiscard]] int starts() const { return starts_; }
  void count_start() { ++starts_; }

  /// `plan` begins, after the motor has braked where it cannot be reached from the present speed.
  void launch(const Plan& plan);
  /// The three parts of launch(), of a drive that brakes by other rates: what waited is dropped, and this is
  /// what the motor is about from now on;
  void take(const Plan& plan);
  /// it can go on from the present speed;
  [[nodiscard]] bool reachable(const Plan& plan) const;
  void go(const Plan& plan);
  /// or it begins when the motor has stopped.
  void postpone(const Plan& plan) { pending_ = plan; }

  [[nodiscard]] const std::optional<Plan>& pending() const { return pending_; }
  void drop_pending() { pending_.reset(); }
  /// The motor has stopped: what begins now, from here. The braking may have carried it past the target.
  [[nodiscard]] std::optional<Plan> take_pending();
  /// What is under way will not complete.
  void interrupt() { stopping_ = true; }
  void finish() {
    activity_ = Activity::none;
    stopping_ = false;
  }
  /// As after a power-up.
  void rest() {
    finish();
    last_activity_ = Activity::none;
    pending_.reset();
  }

 private:
  Motor* motor_;
  Activity activity_ = Activity::none, last_activity_ = Activity::none;
  std::optional<Plan> pending_;
  std::int64_t last_target_ = 0;
  bool stopping_ = false;
  int starts_ = 0;
};

}  // namespace axisd::simulation
