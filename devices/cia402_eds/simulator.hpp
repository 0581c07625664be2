// A CiA 402 servo drive as another maker would build it, from CiA 301, CiA 402 and its data sheet alone;
// nothing here knows a driver, or a drive with a manual of its own.
#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <string_view>

#include "devices/cia402_eds/simulator_switches.hpp"
#include "devices/cia402_eds/simulator_units.hpp"
#include "devices/simulation/canopen_server.hpp"
#include "devices/simulation/input_bank.hpp"
#include "devices/simulation/motor.hpp"
#include "devices/simulation/simulated_node.hpp"
#include "devices/simulation/simulator.hpp"

namespace axisd::cia402_eds {

std::span<const simulation::Simulator> simulators();

/// Its dictionary, identity, units and abilities are those of `settings.sheet`; without one it is a drive of
/// its own, with velocities in inc/s and ramps in inc/s^2. Pure, in the time given to advance(); events
/// within it happen at their exact times.
class StandardDrive final : public simulation::SimulatedCanNode {
 public:
  explicit StandardDrive(simulation::SimulatedNodeSettings settings);

  [[nodiscard]] std::uint8_t address() const override { return server_.node(); }
  void advance(TimePoint now) override;
  void on_frame(const can::Frame& frame) override;
  [[nodiscard]] bool hears(const can::Frame& frame) const override { return server_.hears(frame); }
  std::optional<can::Frame> take_frame() override { return server_.take_frame(); }
  [[nodiscard]] TimePoint next_event() const override;
  void set_power(bool on) override;
  void set_input(std::string_view terminal, std::optional<bool> active) override;
  [[nodiscard]] bool has_input(std::string_view terminal) const override { return inputs_.has(terminal); }
  void raise_alarm(int code) override;
  [[nodiscard]] std::span<const int> alarms() const override;
  void block_shaft(bool blocked) override;
  bool run_at(double factor) override;
  bool push_shaft(std::int64_t pulses) override;
  bool lean_on_shaft(int counts) override;
  [[nodiscard]] simulation::Encoder* encoder() override { return &encoder_; }
  [[nodiscard]] std::int64_t shaft_pulses() const override { return motor_.shaft(); }
  [[nodiscard]] bool shaft_moving() const override { return motor_.moving() && !motor_.blocked(); }
  [[nodiscard]] int starts() const override { return starts_; }
  [[nodiscard]] std::uint32_t peek(std::uint32_t address) const override;
  void poke(std::uint32_t address, std::uint32_t value) override;
  [[nodiscard]] std::uint64_t eeprom_writes() const override { return dictionary_.eeprom_writes(); }

 private:
  /// Not Ready ends with the boot, and Fault Reaction Active at once.
  enum class State : std::uint8_t { disabled, ready, switched_on, operation, quick_stop, fault };
  enum class Activity : std::uint8_t { none, position, velocity, homing };
  enum class Phase : std::uint8_t { search, turn, found, leave, left, approach, ending };
  /// A motion to begin. Positions are the motor's, not the counter's.
  struct Plan {
    Activity activity = Activity::none;
    std::optional<std::int64_t> target{};  ///< nothing: endless in `direction`
    int direction = 1;
    simulation::Rates rates{};
    bool shortened = false;  ///< ends at a software limit
  };
  /// A method of 6098h that searches: which switch, and in which directions.
  struct Method {
    int code;
    std::uint8_t reference;
    int search, leave;
    int approach;  ///< 0: home is where the switch was left
  };

  // simulator.cpp: power, time, inputs
  void step(TimePoint now);
  [[nodiscard]] TimePoint motion_event() const;
  [[nodiscard]] TimePoint settling_event() const;
  [[nodiscard]] bool alive() const { return powered_ && !boot_end_; }
  [[nodiscard]] bool energised() const { return state_ == State::operation || state_ == State::quick_stop; }
  [[nodiscard]] std::uint64_t appearance() const;
  /// When a bit of the status word shows what it was slow to tell.
  [[nodiscard]] TimePoint late_bits_event() const;
  void follow(TimePoint now);
  void watch_window();
  /// Counts beyond which the encoder's deviation is a following error (6065h), or not in position (6067h);
  /// nothing: this is not watched.
  [[nodiscard]] std::optional<std::int64_t> window(std::uint16_t index) const;
  /// The encoder is within 6067h of the end of a motion, for 6068h already.
  [[nodiscard]] bool in_position() const;
  void restart(bool counter_lost);
  void nmt_reset(bool communication_only);

  // simulator_objects.cpp
  simulation::CanopenHooks hooks();
  [[nodiscard]] std::optional<std::int64_t> read(const simulation::ObjectRow& row) const;
  [[nodiscard]] std::int64_t velocity() const;
  [[nodiscard]] bool supports(std::int64_t mode) const;
  std::uint32_t write(const simulation::ObjectRow& row, std::int64_t value, bool& store);
  void written(const simulation::ObjectRow& row);

  // simulator_state.cpp: the state machine and faults
  void control(std::uint16_t word);
  void transition(std::uint16_t word);
  void enter_operation();
  void switch_off();
  void quick_stop();
  void on_halt(bool halted);
  void on_start_bit(bool set);
  void set_mode(int mode);
  [[nodiscard]] bool halted() const { return (control_ & 0x100U) != 0; }
  [[nodiscard]] std::uint16_t status() const;
  [[nodiscard]] std::uint16_t state_bits() const;
  [[nodiscard]] bool target_reached() const;
  void fail_with(int code);
  void reset_fault();

  // simulator_motion.cpp: starts and stops
  /// Of an object that the drive may lack.
  [[nodiscard]] std::int64_t value(std::uint16_t index, std::int64_t without) const;
  [[nodiscard]] double speed(std::int64_t velocity) const;
  [[nodiscard]] double profile_speed() const;
  [[nodiscard]] double ramp(std::uint16_t index) const;
  [[nodiscard]] simulation::Rates rates(double cruise) const;
  [[nodiscard]] std::optional<std::int64_t> soft_limit(int direction) const;
  [[nodiscard]] Plan position_plan() const;
  [[nodiscard]] Plan velocity_plan(std::int64_t velocity) const;
  void accept_set_point();
  void begin(Plan plan);
  void launch(const Plan& plan);
  void stop_motion(double deceleration);
  void cut();
  void on_stopped();
  void follow_velocity();
  void change_velocity(std::int64_t wanted);
  void enforce_limits();
  [[nodiscard]] bool limit_active(int direction) const;

  // simulator_homing.cpp
  [[nodiscard]] static const Method* find_method(std::int64_t code);
  void start_homing();
  void homing_run(int direction, std::uint8_t speed_sub);
  void homing_edge(const simulation::FunctionEdge& edge);
  void homing_limit();
  void homing_stopped();
  void end_pause();
  void next_phase();
  void homing_done();
  void homing_failed();

  // The functions of 60FDh: bit 0, 1, 2 are the inputs in this order.
  static constexpr std::uint8_t negative_limit = 1, positive_limit = 2, home_switch = 3;

  Behaviour behaviour_;
  simulation::SimulatedNodeSettings settings_;
  simulation::CanopenDictionary dictionary_;
  simulation::CanopenServer server_;
  simulation::InputBank inputs_;
  simulation::Motor motor_;
  simulation::Encoder encoder_, tachometer_;
  ShaftUnits units_{};
  TimePoint now_{};
  bool powered_ = false;
  std::optional<TimePoint> boot_end_;
  bool load_defaults_ = false;    ///< 1011h: with the next reset
  std::uint64_t appearance_ = 0;  ///< as it was when event PDOs were last told to look

  State state_ = State::disabled;
  std::uint16_t control_ = 0;
  int mode_ = 0;
  int fault_ = 0;  ///< error code; 0: none
  int last_fault_ = 0;
  int starts_ = 0;
  bool reached_ = false, acknowledged_ = false, limited_ = false;
  bool mode_changed_ = false;                            ///< since the last start or halt
  TimePoint acknowledgement_due_{}, homing_bits_due_{};  ///< see late_bits_event()
  std::optional<TimePoint> in_window_since_;             ///< after a motion that ended at its target
  bool attained_ = false, homing_error_ = false, homing_interrupted_ = false;

  Activity activity_ = Activity::none;
  std::optional<Plan> pending_;    ///< begins when the motor has stopped
  std::optional<Plan> suspended_;  ///< interrupted by a halt, or given while halted
  std::optional<Plan> buffered_;   ///< begins when the one before is reached
  std::int64_t last_target_ = 0;   ///< of the last set-point, as the motor counts
  bool stopping_ = false;          ///< the motion will not complete
  bool velocity_held_ = false;     ///< a limit ended it: 60FFh has to be written again
  std::int64_t velocity_ = 0;      ///< that velocity mode runs at

  Phase phase_ = Phase::ending;
  TimePoint phase_due_ = TimePoint::max();  ///< of homing, after a pause
  const Method* method_ = nullptr;
  int search_direction_ = 1, turns_ = 0;
};

}  // namespace axisd::cia402_eds
