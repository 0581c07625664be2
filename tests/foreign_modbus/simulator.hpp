// The ACME S1 as its manual would have it, for tests.
#pragma once

#include <cstdint>
#include <map>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "devices/simulation/encoder.hpp"
#include "devices/simulation/motor.hpp"
#include "devices/simulation/simulated_node.hpp"

namespace axisd::acme_s1 {

/// Thread: that of its owner.
class SimulatedServo final : public simulation::SimulatedRtuNode {
 public:
  explicit SimulatedServo(simulation::SimulatedNodeSettings settings);

  [[nodiscard]] std::uint8_t address() const override { return settings_.address; }
  void advance(TimePoint now) override;
  void set_power(bool on) override;
  void set_input(std::string_view terminal, std::optional<bool> active) override;
  [[nodiscard]] bool has_input(std::string_view terminal) const override;
  void raise_alarm(int code) override;
  [[nodiscard]] std::int64_t shaft_pulses() const override { return motor_.shaft(); }
  [[nodiscard]] bool shaft_moving() const override { return motor_.moving(); }
  [[nodiscard]] int starts() const override { return starts_; }
  [[nodiscard]] std::uint32_t peek(std::uint32_t address) const override;
  void poke(std::uint32_t address, std::uint32_t value) override;
  [[nodiscard]] std::uint64_t eeprom_writes() const override { return eeprom_writes_; }
  std::optional<std::vector<std::uint8_t>> on_frame(std::span<const std::uint8_t> frame) override;

 private:
  using Words = std::vector<std::uint16_t>;
  void power_up();
  void pass(TimePoint now);
  void cut();
  [[nodiscard]] std::optional<std::uint16_t> get(std::uint16_t address) const;
  /// 0: done; else the exception.
  std::uint8_t set(std::uint16_t address, std::uint16_t value);
  std::uint8_t start(std::uint16_t command);
  [[nodiscard]] std::uint16_t status() const;
  [[nodiscard]] std::uint16_t inputs() const;
  [[nodiscard]] bool input(std::size_t index) const;
  [[nodiscard]] std::optional<std::int64_t> home_edge() const;

  simulation::SimulatedNodeSettings settings_;
  simulation::Motor motor_;
  simulation::Encoder encoder_;
  std::map<std::uint16_t, std::uint16_t> saved_, memory_;
  std::map<std::string, bool, std::less<>> driven_;  ///< inputs that somebody holds at a level
  TimePoint now_{};
  std::optional<TimePoint> boot_end_{};
  bool powered_ = false, energised_ = false, at_target_ = false, referenced_ = false;
  std::uint16_t mode_ = 0, fault_ = 0, cause_ = 0;
  int starts_ = 0;
  std::uint64_t eeprom_writes_ = 0;
};

}  // namespace axisd::acme_s1
