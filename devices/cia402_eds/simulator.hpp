// A CiA 402 servo drive as another maker would build it, from CiA 301, CiA 402 and its data sheet alone;
// nothing here knows a driver, or a drive with a manual of its own.
#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <string_view>

#include "devices/cia402_eds/simulator_arrival.hpp"
#include "devices/cia402_eds/simulator_fault.hpp"
#include "devices/cia402_eds/simulator_homing.hpp"
#include "devices/cia402_eds/simulator_rates.hpp"
#include "devices/cia402_eds/simulator_switches.hpp"
#include "devices/cia402_eds/simulator_units.hpp"
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

namespace axisd::cia402_eds {

using simulation::Activity;
using simulation::Plan;
using simulation::PowerState;

std::span<const simulation::Simulator> simulators();

/// Its dictionary, identity, units and abilities are those of `settings.sheet`; without one it is a drive of
/// its own, with velocities in inc/s and ramps in inc/s^2. Pure, in the time given to advance(); events
/// within it happen at their exact times.
class StandardDrive final : public simulation::SimulatedCanNode {
 public:
  explicit StandardDrive(simulation::SimulatedNodeSettings settings);
  StandardDrive(const StandardDrive&) = delete;

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
  [[nodiscard]] simulation::Encoder* encoder() override { return &shaft_.encoder(); }
  [[nodiscard]] std::int64_t shaft_pulses() const override { return motor().shaft(); }
  [[nodiscard]] bool shaft_moving() const override { return shaft_.turns(); }
  [[nodiscard]] int starts() const override { return motion_.starts(); }
  [[nodiscard]] std::uint32_t peek(std::uint32_t address) const override;
  void poke(std::uint32_t address, std::uint32_t value) override;
  [[nodiscard]] std::uint64_t eeprom_writes() const override { return dictionary_.eeprom_writes(); }

 private:
  // simulator.cpp: power, time, inputs
  [[nodiscard]] simulation::Motor& motor() { return shaft_.motor(); }
  [[nodiscard]] const simulation::Motor& motor() const { return shaft_.motor(); }
  void step(TimePoint now);
  [[nodiscard]] TimePoint motion_event() const;
  [[nodiscard]] bool alive() const { return supply_.ready(); }
  [[nodiscard]] bool energised() const { return control_.operates() || control_.is(PowerState::quick_stop); }
  [[nodiscard]] simulation::Hold hold() const;
  [[nodiscard]] std::uint64_t appearance() const;
  /// When a bit of the status word shows what it was slow to tell.
  [[nodiscard]] TimePoint late_bits_event() const;
  void follow(TimePoint now);
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
  [[nodiscard]] std::uint16_t status() const;
  [[nodiscard]] bool target_reached() const;
  void fail_with(int code);
  void reset_fault();

  // simulator_motion.cpp: starts and stops
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
  void start_homing();
  void act_on(Homing::Outcome outcome);
  void homing_done();
  void homing_failed();

  Behaviour behaviour_;
  simulation::SimulatedNodeSettings settings_;
  simulation::CanopenDictionary dictionary_;
  simulation::CanopenServer server_;
  simulation::InputBank inputs_;
  simulation::Shaft shaft_;
  simulation::Encoder tachometer_;
  MotionObjects objects_;
  simulation::Supply supply_;
  TimePoint now_{};
  bool load_defaults_ = false;    ///< 1011h: with the next reset
  std::uint64_t appearance_ = 0;  ///< as it was when event PDOs were last told to look

  simulation::Cia402Control control_;
  bool mode_changed_ = false;  ///< since the last start or halt
  Fault fault_;

  simulation::Motion motion_;
  simulation::SetPoints<Plan> set_points_;
  simulation::VelocityMode velocity_;
  Arrival arrival_;
  Homing homing_;
};

}  // namespace axisd::cia402_eds
