// A drive of the family as the manual of its model describes it, at register level; nothing here knows the
// driver.
#pragma once

#include <cstdint>
#include <map>
#include <memory>
#include <optional>
#include <span>
#include <string_view>
#include <utility>
#include <vector>

#include "devices/simulation/motor.hpp"
#include "devices/simulation/simulated_node.hpp"
#include "devices/simulation/simulator.hpp"
#include "devices/yako_rtu/simulator_memory.hpp"
#include "devices/yako_rtu/simulator_switches.hpp"
#include "devices/yako_rtu/simulator_terminals.hpp"

namespace axisd::yako_rtu {

using simulation::Motor;
using simulation::Rates;

/// Pure, in the time given to advance(); events within it happen at their exact times. `model` must outlive
/// it. Throws std::invalid_argument for a switch that the model does not have.
class SimulatedDrive final : public simulation::SimulatedRtuNode {
 public:
  SimulatedDrive(const SimulatedModel& model, simulation::SimulatedNodeSettings settings);

  [[nodiscard]] std::uint8_t address() const override { return node_; }
  [[nodiscard]] std::optional<simulation::Serial> serial() const override { return serial_; }
  void join(const simulation::Serial& line) override;
  void advance(TimePoint now) override;
  std::optional<std::vector<std::uint8_t>> on_frame(std::span<const std::uint8_t> frame) override;
  void set_power(bool on) override;
  void set_input(std::string_view terminal, std::optional<bool> active) override;
  [[nodiscard]] bool has_input(std::string_view terminal) const override;
  void raise_alarm(int code) override;
  [[nodiscard]] std::span<const int> alarms() const override { return model_->alarms; }
  void block_shaft(bool blocked) override;
  bool run_at(double factor) override;
  bool push_shaft(std::int64_t pulses) override;
  bool lean_on_shaft(int counts) override;
  [[nodiscard]] simulation::Encoder* encoder() override { return model_->closed_loop ? &encoder_ : nullptr; }
  [[nodiscard]] std::int64_t shaft_pulses() const override { return motor_.shaft(); }
  [[nodiscard]] bool shaft_moving() const override { return motor_.moving() && !motor_.blocked(); }
  [[nodiscard]] int starts() const override { return starts_; }
  [[nodiscard]] std::uint32_t peek(std::uint32_t address) const override;
  void poke(std::uint32_t address, std::uint32_t value) override;
  [[nodiscard]] std::uint64_t eeprom_writes() const override { return memory_.eeprom_writes(); }
  /// Electrical level of Y0.. (`index` 0..), inversion by 0x004B included.
  [[nodiscard]] bool output_level(int index) const;

 private:
  enum class Activity : std::uint8_t { none, position, speed, jog, pt, pv, homing };
  enum class Phase : std::uint8_t { search, turn, found, back_off, left, approach, compensate, ending };
  /// A motion to begin.
  struct Plan {
    Activity activity = Activity::none;
    std::optional<std::int64_t> target;  ///< shaft position; nothing: endless in `direction`
    int direction = 1;
    Rates rates;
  };

  /// Which way homing searches, and how often it has turned round.
  struct Search {
    int direction = 1;
    int turns = 0;
  };

  /// One that was acknowledged, and begins then.
  struct LateStart {
    Plan plan;
    TimePoint due;
  };

  // simulator.cpp: power, time, state
  void step(TimePoint now);
  void clear_counter();
  [[nodiscard]] TimePoint next_event() const;
  [[nodiscard]] bool ready() const { return powered_ && !boot_end_; }
  [[nodiscard]] bool enabled() const { return enabled_ && !terminals_.active(Input::motor_free); }
  [[nodiscard]] std::uint16_t mode() const;
  [[nodiscard]] std::uint16_t status() const;
  /// The bit of 0x0007: a motion ended as it should, and the encoder is within 0x011F of its end.
  [[nodiscard]] bool in_position() const;
  [[nodiscard]] bool output_active(int index) const;
  [[nodiscard]] bool closed_loop() const { return model_->closed_loop && !open_loop_; }
  /// A closed loop that has the motor: the shaft follows the pulses.
  [[nodiscard]] bool in_control() const { return closed_loop() && ready() && enabled() && alarm_ == 0; }
  /// Pulses of the motor for so many counts of the encoder.
  [[nodiscard]] double pulses_of_counts(double counts) const;
  [[nodiscard]] std::int64_t deviation_limit() const;
  [[nodiscard]] bool shows_encoder() const { return closed_loop() && !behaviour_.position_is_commanded; }
  [[nodiscard]] std::int32_t position() const;
  void follow(TimePoint now);
  void power_up();
  void set_serial();
  void show_alarm(int code);
  void clear_alarm();
  void configuration_changed();

  // simulator_protocol.cpp: frames
  Fail read(std::span<const std::uint8_t> frame, std::vector<std::uint8_t>& reply);
  /// The upper word of the position, for one reading.
  std::uint16_t read_position_high();
  Fail write_one(std::span<const std::uint8_t> frame, std::vector<std::uint8_t>& reply);
  Fail write_many(std::span<const std::uint8_t> frame, std::vector<std::uint8_t>& reply);
  Fail execute(std::uint16_t address, std::uint16_t value);

  // simulator_motion.cpp: starts and stops
  [[nodiscard]] Rates rates(double rpm, double acceleration_ms, double deceleration_ms) const;
  [[nodiscard]] Plan position_plan(bool absolute) const;
  [[nodiscard]] Plan endless_plan(Activity activity, int direction) const;
  [[nodiscard]] Fail refusal() const;
  Fail start(std::uint16_t command);
  Fail begin(const Plan& plan);
  bool starts_later(const Plan& plan);
  void start_now();
  void launch(const Plan& plan);
  void stop_command(bool emergency);
  void stop_motion(bool emergency);
  void cut();
  void on_stopped();
  void finish();
  void on_edge(const InputEdge& edge);
  void on_motion_edge(const InputEdge& edge);
  void enforce_limits();
  [[nodiscard]] bool limit_active(int direction) const;
  [[nodiscard]] bool blocked(int direction) const;
  void select_segment();
  void start_segment();
  void update_multi_speed();

  // simulator_homing.cpp
  Fail start_homing();
  void begin_homing();
  void homing_edge(const InputEdge& edge);
  void homing_limits();
  void homing_stopped();
  void homing_run(int direction, double rpm);
  void homing_reached();
  void approach();
  [[nodiscard]] Input homing_reference() const;
  [[nodiscard]] bool homing_ends_forwards() const;
  [[nodiscard]] int approach_direction() const;

  const SimulatedModel* model_;
  Behaviour behaviour_;
  simulation::SimulatedNodeSettings settings_;
  Memory memory_;
  Terminals terminals_;
  Motor motor_;
  simulation::Encoder encoder_;
  TimePoint now_{};
  std::uint8_t node_ = 0;
  std::optional<simulation::Serial> serial_;  ///< since the last power-up; nothing: never joined a line
  std::optional<int> dip_baud_;               ///< its switches; 0: "custom"
  bool powered_ = false;
  std::optional<TimePoint> boot_end_;
  std::uint16_t control_mode_ = 0;  ///< as it was at power-up (0x0018)
  bool open_loop_ = false;          ///< 0x0012 of the models with an encoder
  bool enabled_ = false, in_position_ = false, homed_ = false;
  int alarm_ = 0, cause_ = 0;  ///< shown; 2 or 3 while the supply voltage is wrong
  int starts_ = 0;

  Activity activity_ = Activity::none;
  Activity last_activity_ = Activity::none;  ///< what was started last
  std::optional<Plan> pending_;              ///< begins when the motor has stopped
  std::optional<LateStart> later_;
  std::int64_t last_target_ = 0;  ///< shaft position of the last position move
  bool stopping_ = false;         ///< the motion will not complete
  struct {
    bool on = false;  ///< it is enabled
    int rpm = 0;      ///< signed, what it runs at
  } multi_speed_;     ///< PV
  TimePoint pins_changed_{};
  TimePoint segment_due_ = TimePoint::max();  ///< PT start, 5 ms after its edge
  TimePoint clear_due_ = TimePoint::max();    ///< 0x002C takes effect
  TimePoint homing_due_ = TimePoint::max();   ///< the next phase of homing begins
  /// 0x000A as it was read last, and when.
  std::optional<std::pair<std::uint16_t, TimePoint>> position_high_read_;
  int segment_ = 0;

  Phase phase_ = Phase::ending;
  Search homing_;
};

}  // namespace axisd::yako_rtu
