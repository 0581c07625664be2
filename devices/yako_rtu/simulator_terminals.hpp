// Input terminals of the simulated drive: levels, inversion, filter, functions and their edges
// (manual 4.3, 6.1).
#pragma once

#include <cstdint>
#include <optional>
#include <string_view>
#include <vector>

#include "buses/clock.hpp"
#include "devices/simulation/input_bank.hpp"
#include "devices/simulation/simulated_node.hpp"
#include "devices/yako_rtu/simulator_memory.hpp"

namespace axisd::yako_rtu {

/// Codes of the input functions (6.1).
enum class Input : std::uint8_t {
  none,
  home,
  positive_limit,
  negative_limit,
  motor_free,
  alarm_clear,
  pv_enable,
  pv_direction,
  stop,
  emergency_stop,
  position,
  speed,
  jog_positive,
  jog_negative,
  homing,
  pt_enable,
  pin0,
  pin1,
  pin2,
  pin3,
  pin4
};
inline constexpr std::size_t input_functions = 21;

struct InputEdge {
  Input function;
  bool rising;
};

class Terminals {
 public:
  Terminals(const SimulatedModel& model, const Behaviour& behaviour,
            const simulation::SimulatedNodeSettings& settings);

  /// Over any switch; nothing gives the terminal back to its switch.
  void drive(std::string_view terminal, std::optional<bool> high) { bank_.drive(terminal, high); }

  /// Takes the levels at `now` with the shaft at `shaft`; returns the edges of functions that filters let
  /// through.
  std::vector<InputEdge> sample(TimePoint now, std::int64_t shaft, const Memory& memory);
  /// Takes over levels as they are, without edges: at power-up, and after a change of functions or active
  /// levels.
  void settle(std::int64_t shaft, const Memory& memory) { bank_.settle(shaft, settings(memory)); }
  /// When a filter lets a level through; TimePoint::max() if all are stable.
  [[nodiscard]] TimePoint next_event() const { return bank_.next_event(); }
  /// Next position of the shaft in `direction` at which a switch changes.
  [[nodiscard]] std::optional<std::int64_t> next_switch(std::int64_t shaft, int direction) const {
    return bank_.next_switch(shaft, direction);
  }

  [[nodiscard]] bool active(Input function) const {
    return bank_.active(static_cast<std::uint8_t>(function));
  }
  /// Bits as in 0x0008.
  [[nodiscard]] std::uint16_t bits() const { return bank_.bits(); }
  /// 1..16 as PIN0..PIN4 select, 0 for none.
  [[nodiscard]] int segment() const;

 private:
  [[nodiscard]] Duration filter(std::size_t index, const Memory& memory) const;
  [[nodiscard]] simulation::InputSettings settings(const Memory& memory) const;

  const SimulatedModel* model_;
  const Behaviour* behaviour_;
  simulation::InputBank bank_;
};

}  // namespace axisd::yako_rtu
