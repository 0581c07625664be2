// Homing of the simulated drive, 6.2.6: search, decelerate, leave the switch, approach it slowly.
#pragma once

#include <cstdint>

#include "buses/clock.hpp"
#include "devices/simulation/canopen_dictionary.hpp"
#include "devices/simulation/input_bank.hpp"
#include "devices/simulation/motor.hpp"
#include "devices/yss_c/simulator_inputs.hpp"
#include "devices/yss_c/simulator_switches.hpp"

namespace axisd::yss_c {

///   search -switch-> found -at rest-> back_off -switch left-> left -at rest-> approach -switch-> compensate
///     |                +-at rest, switch passed---------------------------------^          -at rest-> homed
///     +-limit-> turn -at rest-> search, the other way; a second time it ends
/// Whatever stops it otherwise: ending.
class Homing {
 public:
  /// All must outlive it.
  Homing(const Behaviour& behaviour, const simulation::CanopenDictionary& dictionary,
         const simulation::InputBank& inputs, simulation::Motor& motor)
      : behaviour_(&behaviour), dictionary_(&dictionary), inputs_(&inputs), motor_(&motor) {}

  /// False: the objects do not say how.
  [[nodiscard]] bool begin();
  // While it is under way. True: it has ended.
  [[nodiscard]] bool on_edge(const simulation::FunctionEdge& edge, TimePoint now);
  /// The motor is at rest, or a pause is over.
  [[nodiscard]] bool on_stopped(TimePoint now);
  /// True: the limit ahead ends it, without another pulse.
  [[nodiscard]] bool ends_at_limit();

  /// The motor stops for another reason.
  void interrupt() { phase_ = Phase::ending; }
  void end_pause() { due_ = TimePoint::max(); }
  /// The motor rests between two phases.
  [[nodiscard]] bool pauses() const { return due_ != TimePoint::max(); }
  /// When the next phase begins after that; TimePoint::max() if it does not rest.
  [[nodiscard]] TimePoint due() const { return due_; }
  [[nodiscard]] bool compensates() const { return phase_ == Phase::compensate; }
  [[nodiscard]] bool interrupted() const { return phase_ == Phase::ending; }

  [[nodiscard]] bool homed() const { return homed_; }
  void forget() { homed_ = false; }
  /// It was asked for and is not done.
  [[nodiscard]] bool failed() const { return failed_; }
  void set_failed(bool failed) { failed_ = failed; }

 private:
  enum class Phase : std::uint8_t { search, turn, found, back_off, left, approach, compensate, ending };

  [[nodiscard]] int approach_direction() const { return ends_forwards_ ? 1 : direction_; }
  void run(int direction, std::uint8_t speed_sub);
  void search();
  void back_off();
  void approach();
  [[nodiscard]] bool fail();
  [[nodiscard]] bool compensate(TimePoint now);

  const Behaviour* behaviour_;
  const simulation::CanopenDictionary* dictionary_;
  const simulation::InputBank* inputs_;
  simulation::Motor* motor_;
  Phase phase_ = Phase::ending;
  int direction_ = 1;  ///< of the search
  int turns_ = 0;      ///< how often it has turned round
  std::uint8_t reference_ = input_home;
  bool ends_forwards_ = false;
  TimePoint due_ = TimePoint::max();
  bool homed_ = false, failed_ = false;
};

}  // namespace axisd::yss_c
