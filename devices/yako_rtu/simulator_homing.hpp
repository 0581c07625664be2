// Homing of the simulated drive, manual 7.5: search, decelerate, leave the switch, approach it slowly.
#pragma once

#include <cstdint>

#include "buses/clock.hpp"
#include "devices/simulation/motor.hpp"
#include "devices/yako_rtu/simulator_memory.hpp"
#include "devices/yako_rtu/simulator_position.hpp"
#include "devices/yako_rtu/simulator_terminals.hpp"

namespace axisd::yako_rtu {

///   search -switch-> found -at rest-> back_off -switch left-> left -at rest-> approach -switch-> compensate
///     |                +-at rest, switch passed---------------------------------^          -at rest-> homed
///     +-limit-> turn -at rest-> search, the other way; a second time it ends
/// Whatever stops it otherwise: ending.
class Homing {
 public:
  /// All must outlive it.
  Homing(const SimulatedModel& model, const Behaviour& behaviour, const Memory& memory,
         const Terminals& terminals, simulation::Motor& motor, PositionWords& position)
      : model_(&model),
        behaviour_(&behaviour),
        memory_(&memory),
        terminals_(&terminals),
        motor_(&motor),
        position_(&position) {}

  void begin();
  // While it is under way. True: it has ended.
  [[nodiscard]] bool on_edge(const InputEdge& edge, TimePoint now);
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
  [[nodiscard]] bool homed() const { return homed_; }
  void forget() { homed_ = false; }

 private:
  enum class Phase : std::uint8_t { search, turn, found, back_off, left, approach, compensate, ending };

  [[nodiscard]] Input reference() const;
  [[nodiscard]] bool ends_forwards() const;
  [[nodiscard]] int approach_direction() const;
  void run(int direction, std::uint16_t speed);
  void search(int direction);
  void back_off(int direction, std::uint16_t speed);
  void approach();
  [[nodiscard]] bool turn_round();
  [[nodiscard]] bool compensate(TimePoint now);

  const SimulatedModel* model_;
  const Behaviour* behaviour_;
  const Memory* memory_;
  const Terminals* terminals_;
  simulation::Motor* motor_;
  PositionWords* position_;
  Phase phase_ = Phase::ending;
  int direction_ = 1;  ///< of the search
  int turns_ = 0;      ///< how often it has turned round
  TimePoint due_ = TimePoint::max();
  bool homed_ = false;
};

}  // namespace axisd::yako_rtu
