// A YSS-C as its manual (V1.1) describes it, at object level; nothing here knows the driver.
#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <string_view>

#include "devices/simulation/alarm_latch.hpp"
#include "devices/simulation/canopen_server.hpp"
#include "devices/simulation/cia402_control.hpp"
#include "devices/simulation/input_bank.hpp"
#include "devices/simulation/motion.hpp"
#include "devices/simulation/set_points.hpp"
#include "devices/simulation/shaft.hpp"
#include "devices/simulation/simulated_node.hpp"
#include "devices/simulation/simulator.hpp"
#include "devices/simulation/supply.hpp"
#include "devices/simulation/velocity_mode.hpp"
#include "devices/yss_c/simulator_homing.hpp"
#include "devices/yss_c/simulator_inputs.hpp"
#include "devices/yss_c/simulator_switches.hpp"

namespace axisd::yss_c {

using simulation::Activity;
using simulation::Plan;
using simulation::PowerState;

/// All models of the family are one drive with different motors.
std::span<const simulation::Simulator> simulators();

/// Pure, in the time given to advance(); events within it happen at their exact times. Throws
/// std::invalid_argument for a switch that it does not have.
class SimulatedDrive final : public simulation::SimulatedCanNode {
 public:
  explicit SimulatedDrive(simulation::SimulatedNodeSettings settings);
  SimulatedDrive(const SimulatedDrive&) = delete;

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
  [[nodiscard]] simulation::Encoder* encoder() override { return &shaft_.encoder(); }
  [[nodiscard]] std::int64_t shaft_pulses() const override { return motor().shaft(); }
  [[nodiscard]] bool shaft_moving() const override { return shaft_.turns(); }
  [[nodiscard]] int starts() const override { return motion_.starts(); }
  [[nodiscard]] std::uint32_t peek(std::uint32_t address) const override;
  void poke(std::uint32_t address, std::uint32_t value) override;
  [[nodiscard]] std::uint64_t eeprom_writes() const override { return dictionary_.eeprom_writes(); }

 private:
  /// A target as 6.2.4 hands it over: what the objects held at the edge of bit 4.
  struct SetPoint {
    std::int64_t value = 0;
    bool relative = false;
    simulation::Rates rates;
  };

  // simulator.cpp: power, time, inputs and outputs
  [[nodiscard]] simulation::Motor& motor() { return shaft_.motor(); }
  [[nodiscard]] const simulation::Motor& motor() const { return shaft_.motor(); }
  void step(TimePoint now);
  [[nodiscard]] TimePoint motion_event() const;
  [[nodiscard]] bool ready() const { return supply_.ready(); }
  [[nodiscard]] bool closed_loop() const { return dictionary_.get(0x2007) == 0; }
  [[nodiscard]] bool in_control() const { return closed_loop() && ready() && energised() && !alarm_.on(); }
  [[nodiscard]] simulation::Hold hold() const;
  [[nodiscard]] bool shows_encoder() const { return closed_loop() && !behaviour_.position_is_commanded; }
  void follow(TimePoint now);
  /// Pulses of the motor for so many counts of the encoder.
  [[nodiscard]] double pulses_of_counts(double counts) const;
  [[nodiscard]] std::int64_t deviation_limit() const;
  /// A motion ended at its target, and the encoder is within 204Fh of it.
  [[nodiscard]] bool in_position() const;
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
  [[nodiscard]] std::uint16_t status() const;
  [[nodiscard]] bool target_reached() const;
  void show_alarm(int code);
  void report_alarm();
  void clear_alarm();
  void reset_fault();

  // simulator_motion.cpp: starts and stops
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
  void start_homing();

  Behaviour behaviour_;
  simulation::SimulatedNodeSettings settings_;
  simulation::CanopenDictionary dictionary_;
  simulation::CanopenServer server_;
  simulation::InputBank inputs_;
  simulation::Shaft shaft_;
  simulation::Supply supply_;
  TimePoint now_{};
  std::optional<std::uint32_t> bitrate_;  ///< since the last power-up; nothing: never joined a network
  std::uint64_t appearance_ = 0;          ///< as it was when event PDOs were last told to look

  simulation::Cia402Control control_;  ///< 6.2.1, 6.2.2
  bool energised_ = false;
  bool reached_ = false;  ///< a motion ended at its target
  simulation::AlarmLatch alarm_;

  simulation::Motion motion_;
  simulation::SetPoints<SetPoint> set_points_;
  simulation::VelocityMode velocity_;
  Homing homing_;
};

}  // namespace axisd::yss_c
