// A simulated drive on a line that may end before the drive does.
#pragma once

#include <optional>
#include <vector>

#include "devices/simulation/simulated_node.hpp"

namespace axisd::test {

class BorrowedNode : public simulation::SimulatedRtuNode {
 public:
  explicit BorrowedNode(simulation::SimulatedRtuNode& node) : node_(&node) {}
  [[nodiscard]] std::uint8_t address() const override { return node_->address(); }
  /// What it has become by joining a line for the first time; who owns it lets it join, once.
  [[nodiscard]] std::optional<simulation::Serial> serial() const override { return node_->serial(); }
  void advance(TimePoint now) override { node_->advance(now); }
  std::optional<std::vector<std::uint8_t>> on_frame(std::span<const std::uint8_t> frame) override {
    return node_->on_frame(frame);
  }
  void set_power(bool on) override { node_->set_power(on); }
  void set_input(std::string_view terminal, std::optional<bool> active) override {
    node_->set_input(terminal, active);
  }
  [[nodiscard]] bool has_input(std::string_view terminal) const override {
    return node_->has_input(terminal);
  }
  void raise_alarm(int code) override { node_->raise_alarm(code); }
  [[nodiscard]] std::span<const int> alarms() const override { return node_->alarms(); }
  void block_shaft(bool blocked) override { node_->block_shaft(blocked); }
  bool run_at(double factor) override { return node_->run_at(factor); }
  bool push_shaft(std::int64_t pulses) override { return node_->push_shaft(pulses); }
  bool lean_on_shaft(int counts) override { return node_->lean_on_shaft(counts); }
  [[nodiscard]] simulation::Encoder* encoder() override { return node_->encoder(); }
  [[nodiscard]] std::int64_t shaft_pulses() const override { return node_->shaft_pulses(); }
  [[nodiscard]] bool shaft_moving() const override { return node_->shaft_moving(); }
  [[nodiscard]] int starts() const override { return node_->starts(); }
  [[nodiscard]] std::uint32_t peek(std::uint32_t address) const override { return node_->peek(address); }
  void poke(std::uint32_t address, std::uint32_t value) override { node_->poke(address, value); }
  [[nodiscard]] std::uint64_t eeprom_writes() const override { return node_->eeprom_writes(); }

 private:
  simulation::SimulatedRtuNode* node_;
};

}  // namespace axisd::test
