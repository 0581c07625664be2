// A drive of the family as the manual of its model describes it, at register level; nothing here knows the
// driver.
#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <string_view>
#include <vector>

#include "devices/simulation/alarm_latch.hpp"
#include "devices/simulation/motion.hpp"
#include "devices/simulation/shaft.hpp"
#include "devices/simulation/simulated_node.hpp"
#include "devices/simulation/simulator.hpp"
#include "devices/simulation/supply.hpp"
#include "devices/yako_rtu/simulator_homing.hpp"
#include "devices/yako_rtu/simulator_line.hpp"
#include "devices/yako_rtu/simulator_memory.hpp"
#include "devices/yako_rtu/simulator_position.hpp"
#include "devices/yako_rtu/simulator_segments.hpp"
#include "devices/yako_rtu/simulator_switches.hpp"
#include "devices/yako_rtu/simulator_terminals.hpp"

namespace axisd::yako_rtu {

using simulation::Activity;
using simulation::Plan;

/// Pure, in the time given to advance(); events within it happen at their exact times. `model` must outlive
/// it. Throws std::invalid_argument for a switch that the model does not have.
class SimulatedDrive final : public simulation::SimulatedRtuNode {
 public:
  SimulatedDrive(const SimulatedModel& model, simulation::SimulatedNodeSettings settings);
  SimulatedDrive(const SimulatedDrive&) = delete;

  [[nodiscard]] std::uint8_t address() const override { return line_.address(); }
  [[nodiscard]] std::optional<simulation::Serial> serial() const override { return line_.serial(); }
  void join(const simulation::Serial& line) override { line_.join(line, memory_); }
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
  [[nodiscard]] simulation::Encoder* encoder() override {
    return model_->closed_loop ? &shaft_.encoder() : nullptr;
  }
  [[nodiscard]] std::int64_t shaft_pulses() const override { return motor().shaft(); }
  [[nodiscard]] bool shaft_moving() const override { return shaft_.turns(); }
  [[nodiscard]] int starts() const override { return motion_.starts(); }
  [[nodiscard]] std::uint32_t peek(std::uint32_t address) const override;
  void poke(std::uint32_t address, std::uint32_t value) override;
  [[nodiscard]] std::uint64_t eeprom_writes() const override { return memory_.eeprom_writes(); }
  /// Electrical level of Y0.. (`index` 0..), inversion by 0x004B included.
  [[nodiscard]] bool output_level(int index) const;

 private:
  /// One that was acknowledged, and begins then.
  struct LateStart {
    Plan plan;
    TimePoint due;
  };

  // simulator.cpp: power, time, state
  [[nodiscard]] simulation::Motor& motor() { return shaft_.motor(); }
  [[nodiscard]] const simulation::Motor& motor() const { return shaft_.motor(); }
  void step(TimePoint now);
  void do_what_is_due(TimePoint now);
  [[nodiscard]] TimePoint next_event() const;
  [[nodiscard]] bool ready() const { return supply_.ready(); }
  [[nodiscard]] bool enabled() const { return enabled_ && !terminals_.active(Input::motor_free); }
  [[nodiscard]] std::uint16_t mode() const;
  [[nodiscard]] std::uint16_t status() const;
  /// The bit of 0x0007: a motion ended as it should, and the encoder is within 0x011F of its end.
  [[nodiscard]] bool in_position() const;
  [[nodiscard]] bool output_active(int index) const;
  [[nodiscard]] bool closed_loop() const { return model_->closed_loop && !open_loop_; }
  /// A closed loop that has the motor: the shaft follows the pulses.
  [[nodiscard]] bool in_control() const { return closed_loop() && ready() && enabled() && !alarm_.on(); }
  [[nodiscard]] simulation::Hold hold() const;
  /// Pulses of the motor for so many counts of the encoder.
  [[nodiscard]] double pulses_of_counts(double counts) const;
  [[nodiscard]] std::int64_t deviation_limit() const;
  [[nodiscard]] bool shows_encoder() const { return closed_loop() && !behaviour_.position_is_commanded; }
  [[nodiscard]] std::int32_t position() const;
  void follow(TimePoint now);
  void power_up();
  void show_alarm(int code);
  void clear_alarm();
  void configuration_changed();

  // simulator_protocol.cpp: frames
  Fail read(std::span<const std::uint8_t> frame, std::vector<std::uint8_t>& reply);
  Fail write_one(std::span<const std::uint8_t> frame, std::vector<std::uint8_t>& reply);
  Fail write_many(std::span<const std::uint8_t> frame, std::vector<std::uint8_t>& reply);
  Fail execute(std::uint16_t address, std::uint16_t value);

  // simulator_starts.cpp: starts and stops
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
  void update_multi_speed();
  Fail start_homing();
  void begin_homing();

  const SimulatedModel* model_;
  Behaviour behaviour_;
  simulation::SimulatedNodeSettings settings_;
  Memory memory_;
  Terminals terminals_;
  simulation::Shaft shaft_;
  PositionWords position_words_;
  LineSetup line_;
  simulation::Supply supply_;
  TimePoint now_{};
  std::uint16_t control_mode_ = 0;  ///< as it was at power-up (0x0018)
  bool open_loop_ = false;          ///< 0x0012 of the models with an encoder
  bool enabled_ = false;
  bool in_position_ = false;
  simulation::AlarmLatch alarm_;

  simulation::Motion motion_;
  std::optional<LateStart> later_;
  Segments segments_;
  Homing homing_;
};

}  // namespace axisd::yako_rtu
