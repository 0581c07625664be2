// Address and serial settings of the simulated drive: its switches (manual 4.4) and 0x0013..0x0015.
#pragma once

#include <cstdint>
#include <optional>

#include "devices/simulation/simulated_node.hpp"
#include "devices/yako_rtu/simulator_memory.hpp"

namespace axisd::yako_rtu {

class LineSetup {
 public:
  /// `settings` say where the address switches stand. All three must outlive it.
  LineSetup(const SimulatedModel& model, const Behaviour& behaviour,
            const simulation::SimulatedNodeSettings& settings);

  [[nodiscard]] std::uint8_t address() const { return node_; }
  /// Since the last power-up; nothing: it never joined a line.
  [[nodiscard]] std::optional<simulation::Serial> serial() const { return serial_; }

  /// What the switches leave open counts as `memory` has it now.
  void power_up(const Memory& memory);
  /// What the settings leave open becomes like the line, in `memory` as well.
  void join(const simulation::Serial& line, Memory& memory);

 private:
  void set_serial(const Memory& memory);

  const SimulatedModel* model_;
  const Behaviour* behaviour_;
  const simulation::SimulatedNodeSettings* settings_;
  std::uint8_t node_;
  std::optional<simulation::Serial> serial_;
  std::optional<int> dip_baud_;  ///< its switches; 0: "custom"
};

}  // namespace axisd::yako_rtu
