// A YSS-C as its manual (V1.1) describes it, at object level; nothing here knows the driver.
#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <string_view>

#include "devices/simulation/canopen_server.hpp"
#include "devices/simulation/input_bank.hpp"
#include "devices/simulation/motor.hpp"
#include "devices/simulation/simulated_node.hpp"
#include "devices/simulation/simulator.hpp"
#include "devices/yss_c/simulator_switches.hpp"

namespace axisd::yss_c {

/// All models of the family are one drive with different motors.
std::span<const simulation::Simulator> simulators();

/// Pure, in the time given to advance(); events within it happen at their exact times. Throws
/// std::invalid_argument for a switch that it does not have.
class SimulatedDrive final : public simulation::SimulatedCanNode {
 public:
  explicit SimulatedDrive(simulation::SimulatedNodeSettings settings);

  [[nodiscard]] std::uint8_t address() const override { return server_.node(); }
  [[nodiscard]] std::optional<std::uint32_t> bitrate() const override { return bitrate_; }
  void join(std::uint32_t bitrate) override;
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
  /// CiA 402, 6.2.1. Fault Reaction Active is over at once, and so is Not Ready with the boot.
  enum class State : std::uint8_t { disabled, ready, switched_on, operation, quick_stop, fault };
  enum class Activity : std::uint8_t { none, position, velocity, jog, homing };
  enum class Phase : std::uint8_t { search, turn, found, back_off, left, approach, compensate, ending };
  /// A motion to begin.
  struct Plan {
    Activity activity = Activity::none;
    std::optional<std::int64_t> target;  ///< shaft position; nothing: endless in `direction`
    int direction = 1;
    simulation::Rates rates;
  };
  /// A target as 6.2.4 hands it over: what the objects held at the edge of bit 4.
  struct SetPoint {
    std::int64_t value = 0;
    bool relative = false;
    simulation::Rates rates;
  };

  // simulator.cpp: power, time, inputs and outputs
  void step(TimePoint now);
  [[nodiscard]] TimePoint motion_event() const;
  [[nodiscard]] bool ready() const { return powered_ && !boot_end_; }
  [[nodiscard]] bool closed_loop() const { return dictionary_.get(0x2007) == 0; }
  [[nodiscard]] bool in_control() const { return closed_loop() && ready() && energised() && alarm_ == 0; }
  [[nodiscard]] bool shows_encoder() const { return closed_loop() && !behaviour_.position_is_commanded; }
  void follow(TimePoint now);
  /// Pulses of the motor for so many counts of the encoder.
  [[nodiscard]] double pulses_of_counts(double counts) const;
  [[nodiscard]] std::int64_t deviation_limit() const;
  /// A motion ended at its target, and the encoder is within 204Fh of it.
  [[nodiscard]] bool in_position() const;
  [[nodiscard]] int pulses_per_revolution() const;
  [[nodiscard]] simulation::InputSettings input_settings() const;
  [[nodiscard]] std::uint16_t outputs() const;
  [[nodiscard]] std::uint16_t shown(std::uint16_t active, std::uint8_t inversion, std::size_t count) const;
  [[nodiscard]] std::uint64_t appearance() const;
  void set_up_from_eeprom();
  void power_up();
  void nmt_reset(bool communication_only);
  void rest();
  void settle_inputs();

  // simulator_objects.cpp: what objects say and do
  simulation::CanopenHooks hooks();
  [[nodiscard]] std::optional<std::int64_t> read(const simulation::ObjectRow& row) const;
  std::uint32_t write(const simulation::ObjectRow& row, std::int64_t value, bool& store);
  void written(const simulation::ObjectRow& row);
  [[nodiscard]] bool saves(const simulation::ObjectRow& row) const;
  std::uint32_t command(std::uint16_t index, std::int64_t value);
  [[nodiscard]] std::int32_t position() const;
  [[nodiscard]] std::int64_t velocity_rpm() const;

  // simulator_state.cpp: CiA 402 and alarms
  void control(std::uint16_t word);
  void transition(std::uint16_t word);
  void on_halt(bool halted);
  void on_start_bit(bool set);
  void set_mode(int mode);
  void leave_operation(bool brakes);
  void release();
  void disable_voltage();
  void energise();
  [[nodiscard]] bool energised() const { return energised_ && !inputs_.active(input_release); }
  [[nodiscard]] bool halted() const { return (control_ & 0x100U) != 0; }
  [[nodiscard]] std::uint16_t status() const;
  [[nodiscard]] std::uint16_t state_bits() const;
  [[nodiscard]] bool target_reached() const;
  void show_alarm(int code);
  void report_alarm();
  void clear_alarm();
  void reset_fault();

  // simulator_motion.cpp: starts and stops
  [[nodiscard]] simulation::Rates rates(double rpm, double acceleration_ms, double deceleration_ms) const;
  [[nodiscard]] SetPoint set_point(bool relative) const;
  [[nodiscard]] Plan plan_of(const SetPoint& point) const;
  [[nodiscard]] Plan endless_plan(Activity activity, double rpm, int direction) const;
  void accept_set_point();
  bool begin(const Plan& plan);
  void launch(const Plan& plan);
  void stop_motion(bool at_once);
  void cut();
  void on_stopped();
  void finish();
  void next_set_point();
  void update_velocity();
  void on_edge(const simulation::FunctionEdge& edge);
  void on_motion_edge(const simulation::FunctionEdge& edge);
  void terminal_start(const Plan& plan);
  [[nodiscard]] bool stop_held() const;
  void enforce_limits();
  [[nodiscard]] bool limit_active(int direction) const;

  // simulator_homing.cpp
  void start_homing();
  void homing_edge(const simulation::FunctionEdge& edge);
  void homing_limits();
  void homing_stopped();
  void homing_run(int direction, std::uint8_t speed_sub);
  void homing_reached();
  void homing_failed();
  [[nodiscard]] int approach_direction() const;

  // Codes of the input functions (7, 2030h).
  static constexpr std::uint8_t input_home = 1, input_positive_limit = 2, input_negative_limit = 3,
                                input_enable = 4, input_release = 5, input_alarm_clear = 6, input_factory = 7,
                                input_stop = 8, input_stop_at_once = 9, input_position = 10,
                                input_velocity = 11, input_jog_positive = 12, input_jog_negative = 13,
                                input_homing = 14;

  Behaviour behaviour_;
  simulation::SimulatedNodeSettings settings_;
  simulation::CanopenDictionary dictionary_;
  simulation::CanopenServer server_;
  simulation::InputBank inputs_;
  simulation::Motor motor_;
  simulation::Encoder encoder_;
  TimePoint now_{};
  std::optional<std::uint32_t> bitrate_;  ///< since the last power-up; nothing: never joined a network
  bool powered_ = false;
  std::optional<TimePoint> boot_end_;
  TimePoint clear_due_ = TimePoint::max();   ///< 2012h takes effect
  TimePoint homing_due_ = TimePoint::max();  ///< the next phase of homing begins
  std::uint64_t appearance_ = 0;             ///< as it was when event PDOs were last told to look

  State state_ = State::disabled;
  std::uint16_t control_ = 0;
  int mode_ = 0;
  bool energised_ = false, reached_ = false, homed_ = false, homing_error_ = false;
  bool acknowledged_ = false;  ///< bit 12 of position mode
  int alarm_ = 0, cause_ = 0;  ///< shown; 2 or 3 while the supply voltage is wrong
  int starts_ = 0;

  Activity activity_ = Activity::none;
  std::optional<Plan> pending_;       ///< begins when the motor has stopped
  std::optional<Plan> suspended_;     ///< halted, or given while halted
  std::optional<SetPoint> buffered_;  ///< begins when the one before is reached (bit 5 = 0)
  std::int64_t last_target_ = 0;      ///< shaft position of the last position move
  bool stopping_ = false;             ///< the motion will not complete
  bool velocity_held_ = false;        ///< stopped by something else than 60FFh: needs a new one
  std::int64_t velocity_ = 0;         ///< signed r/min that velocity mode runs at

  Phase phase_ = Phase::ending;
  int homing_direction_ = 1, homing_turns_ = 0;
  std::uint8_t homing_reference_ = input_home;
  bool homing_ends_forwards_ = false;
};

}  // namespace axisd::yss_c
