// Homing mode (CiA 402, homing methods without index pulse): a limit switch is left again and home is its
// edge; the home switch's edge is always met from the same side.
#pragma once

#include <cstdint>

#include "buses/clock.hpp"
#include "devices/cia402_eds/simulator_rates.hpp"
#include "devices/cia402_eds/simulator_switches.hpp"
#include "devices/simulation/input_bank.hpp"
#include "devices/simulation/motor.hpp"

namespace axisd::cia402_eds {

/// The functions of 60FDh: bit 0, 1, 2 are the inputs in this order.
inline constexpr std::uint8_t negative_limit = 1, positive_limit = 2, home_switch = 3;

///   search -switch-> found -at rest-> leave -switch left-> left -at rest-> approach -switch-> done
///     |               |                 +-left, home is there-----------------------------------^
///     |               +-at rest, switch passed------------------------------^
///     +-limit-> turn -at rest-> search, the other way; a second time it fails
/// Whatever stops it otherwise: ending.
class Homing {
 public:
  /// All must outlive it.
  Homing(const Behaviour& behaviour, const MotionObjects& objects, const simulation::InputBank& inputs,
         simulation::Motor& motor)
      : behaviour_(&behaviour), objects_(&objects), inputs_(&inputs), motor_(&motor) {}

  /// 6098h takes it.
  [[nodiscard]] static bool knows(std::int64_t method);

  enum class Begin : std::uint8_t { unknown, where_it_stands, search };
  /// What came of it: done where it stands, failed, or over without either.
  enum class Outcome : std::uint8_t { goes_on, done, failed, over };

  /// By 6098h. A search begins with first_phase().
  [[nodiscard]] Begin begin();
  [[nodiscard]] Outcome first_phase();
  [[nodiscard]] Outcome on_edge(const simulation::FunctionEdge& edge);
  /// While the motor runs into an active limit.
  [[nodiscard]] Outcome at_limit();
  [[nodiscard]] Outcome on_stopped(TimePoint now);
  /// A pause is over, or there is none.
  [[nodiscard]] Outcome next_phase();

  /// The motor stops for another reason.
  void interrupt() { phase_ = Phase::ending; }
  /// Stopped while it rested between two phases. False: it did not.
  bool end_pause();
  /// When the next phase begins after a pause; TimePoint::max() if it does not rest.
  [[nodiscard]] TimePoint due() const { return due_; }

  void attain(TimePoint told_from);
  void fail() { failed_ = true; }
  void forget_attained() { attained_ = false; }
  void forget() { attained_ = failed_ = false; }
  [[nodiscard]] bool attained() const { return attained_; }
  [[nodiscard]] bool failed() const { return failed_; }
  /// When the slower of the two bits that tell that it is done is set.
  [[nodiscard]] TimePoint told_from() const { return told_from_; }

 private:
  enum class Phase : std::uint8_t { search, turn, found, leave, left, approach, ending };
  /// A method of 6098h that searches: which switch, and in which directions.
  struct Method {
    int code;
    std::uint8_t reference;
    int search, leave;
    int approach;  ///< 0: home is where the switch was left
  };
  static const Method* find(std::int64_t code);
  [[nodiscard]] Outcome run(Phase phase, int direction, std::uint8_t speed_sub);
  [[nodiscard]] Outcome leave() { return run(Phase::leave, method_->leave, 2); }
  [[nodiscard]] Outcome approach() { return run(Phase::approach, method_->approach, 2); }

  const Behaviour* behaviour_;
  const MotionObjects* objects_;
  const simulation::InputBank* inputs_;
  simulation::Motor* motor_;
  Phase phase_ = Phase::ending;
  TimePoint due_ = TimePoint::max();
  const Method* method_ = nullptr;
  int direction_ = 1, turns_ = 0;  ///< of the search
  bool attained_ = false, failed_ = false;
  TimePoint told_from_{};
};

}  // namespace axisd::cia402_eds
