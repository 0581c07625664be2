// A simulated drive on a CAN network, seen through: what derives from it watches the drive.
#pragma once

#include <optional>

#include "devices/simulation/simulated_node.hpp"

namespace axisd::test {

class BorrowedCanNode : public simulation::SimulatedCanNode {
 public:
  explicit BorrowedCanNode(simulation::SimulatedCanNode& node) : node_(&node) {}
  [[nodiscard]] std::uint8_t address() const override { return node_->address(); }
  [[nodiscard]] std::optional<std::uint32_t> bitrate() const override { return node_->bitrate(); }
  void join(std::uint32_t bitrate) override { node_->join(bitrate); }
  void advance(TimePoint now) override { node_->advance(now); }
  void on_frame(const can::Frame& frame) override { node_->on_frame(frame); }
  [[nodiscard]] bool hears(const can::Frame& frame) const override { return node_->hears(frame); }
  std::optional<can::Frame> take_frame() override { return node_->take_frame(); }
  [[nodiscard]] TimePoint next_event() const override { return node_->next_event(); }
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
  simulation::SimulatedCanNode* node_;
};

}  // namespace axisd::test
