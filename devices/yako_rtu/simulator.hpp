// The YKD2405PR as its manual describes it, at register level; nothing here knows the driver.
#pragma once

#include <cstdint>
#include <map>
#include <memory>
#include <optional>
#include <span>
#include <string_view>
#include <vector>

#include "devices/simulation/simulated_node.hpp"
#include "devices/simulation/simulator.hpp"
#include "devices/yako_rtu/simulator_memory.hpp"
#include "devices/yako_rtu/simulator_motor.hpp"
#include "devices/yako_rtu/simulator_switches.hpp"
#include "devices/yako_rtu/simulator_terminals.hpp"

namespace axisd::yako_rtu {

/// Pure, in the time given to advance(); events within it happen at their exact times. Address up to 31 is
/// set by the DIP switches, above by 0x0013. Throws std::invalid_argument for an unknown switch.
class SimulatedDrive final : public simulation::SimulatedRtuNode {
 public:
  explicit SimulatedDrive(simulation::SimulatedNodeSettings settings);

  [[nodiscard]] std::uint8_t address() const override { return node_; }
  void advance(TimePoint now) override;
  std::optional<std::vector<std::uint8_t>> on_frame(std::span<const std::uint8_t> frame) override;
  void set_power(bool on) override;
  void set_input(std::string_view terminal, std::optional<bool> active) override;
  [[nodiscard]] bool has_input(std::string_view terminal) const override;
  void raise_alarm(int code) override;
  [[nodiscard]] std::int64_t shaft_pulses() const override { return motor_.shaft(); }
  [[nodiscard]] bool shaft_moving() const override { return motor_.moving(); }
  [[nodiscard]] int starts() const override { return starts_; }
  [[nodiscard]] std::uint16_t peek(std::uint16_t address) const override;
  void poke(std::uint16_t address, std::uint16_t value) override;
  [[nodiscard]] std::uint64_t eeprom_writes() const override { return memory_.eeprom_writes(); }
  /// Electrical level of Y0..Y3 (`index` 0..3), inversion by 0x004B included.
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

  // simulator.cpp: power, time, state
  void step(TimePoint now);
  [[nodiscard]] TimePoint next_event() const;
  [[nodiscard]] bool ready() const { return powered_ && !boot_end_; }
  [[nodiscard]] bool enabled() const { return enabled_ && !terminals_.active(Input::motor_free); }
  [[nodiscard]] std::uint16_t status() const;
  [[nodiscard]] bool output_active(int index) const;
  void power_up();
  void clear_alarm();
  void configuration_changed();

  // simulator_protocol.cpp: frames
  Fail read(std::span<const std::uint8_t> frame, std::vector<std::uint8_t>& reply) const;
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
  void launch(const Plan& plan);
  void stop_command(bool emergency);
  void stop_motion(bool emergency);
  void cut();
  void on_stopped();
  void finish();
  void on_edge(const InputEdge& edge);
  void enforce_limits();
  [[nodiscard]] bool limit_active(int direction) const;
  [[nodiscard]] bool blocked(int direction) const;
  void select_segment();
  void start_segment();
  void update_multi_speed();

  // simulator_homing.cpp
  Fail start_homing();
  void homing_edge(const InputEdge& edge);
  void homing_limits();
  void homing_stopped();
  void homing_run(int direction, double rpm);
  void homing_reached();
  [[nodiscard]] Input homing_reference() const;

  Behaviour behaviour_;
  simulation::SimulatedNodeSettings settings_;
  Memory memory_;
  Terminals terminals_;
  Motor motor_;
  TimePoint now_{};
  std::uint8_t node_ = 0;
  bool powered_ = false;
  std::optional<TimePoint> boot_end_;
  std::uint16_t control_mode_ = 0;  ///< as it was at power-up (0x0018)
  bool enabled_ = false, in_position_ = false, homed_ = false;
  int alarm_ = 0, cause_ = 0;  ///< shown; 2 or 3 while the supply voltage is wrong
  int starts_ = 0;

  Activity activity_ = Activity::none;
  std::optional<Plan> pending_;   ///< begins when the motor has stopped
  std::int64_t last_target_ = 0;  ///< shaft position of the last position move
  bool stopping_ = false;         ///< the motion will not complete
  bool multi_speed_on_ = false;   ///< PV is enabled
  int multi_speed_rpm_ = 0;       ///< signed, what PV runs at
  TimePoint pins_changed_{};
  TimePoint segment_due_ = TimePoint::max();  ///< PT start, 5 ms after its edge
  int segment_ = 0;

  Phase phase_ = Phase::ending;
  int homing_direction_ = 1;
  int homing_turns_ = 0;
};

}  // namespace axisd::yako_rtu
