// Input terminals of a simulated drive: levels, inversion, filters, functions and their edges.
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <span>
#include <string_view>
#include <vector>

#include "buses/clock.hpp"
#include "devices/descriptor.hpp"
#include "devices/simulation/mechanics.hpp"
#include "devices/simulation/simulated_node.hpp"

namespace axisd::simulation {

/// What the drive has them set to, by input.
struct InputSettings {
  std::uint16_t inverted = 0;
  std::array<std::uint8_t, 16> functions{};  ///< 0: none
  std::array<Duration, 16> filters{};        ///< how long a level must last
};

/// A function became active or inactive.
struct FunctionEdge {
  std::uint8_t function;
  bool rising;
};

class InputBank {
 public:
  /// `switch_functions`: the function codes of home, positive and negative limit. `inputs` must outlive it.
  InputBank(std::span<const TerminalSpec> inputs, std::array<std::uint8_t, 3> switch_functions,
            const SimulatedNodeSettings& settings);

  [[nodiscard]] bool has(std::string_view terminal) const;
  /// Over any switch; nothing gives the terminal back to its switch.
  void drive(std::string_view terminal, std::optional<bool> high);
  /// Takes the levels at `now` with the shaft at `shaft`; the edges of functions that filters let through.
  std::vector<FunctionEdge> sample(TimePoint now, std::int64_t shaft, const InputSettings& settings);
  /// Takes over levels as they are, without edges: at power-up, and after a change of the settings.
  void settle(std::int64_t shaft, const InputSettings& settings);
  /// When a filter lets a level through; TimePoint::max() if all are stable.
  [[nodiscard]] TimePoint next_event() const;
  /// Next position of the shaft in `direction` at which a switch changes.
  [[nodiscard]] std::optional<std::int64_t> next_switch(std::int64_t shaft, int direction) const {
    return simulation::next_switch(mechanics_, shaft, direction);
  }
  [[nodiscard]] bool active(std::uint8_t function) const { return (functions_ >> function & 1U) != 0; }
  /// After filter and inversion; bit 0 is the first input.
  [[nodiscard]] std::uint16_t bits() const;

 private:
  struct Terminal {
    std::optional<bool> driven;
    std::optional<Wire> wire;
    bool active = false;               ///< after the filter
    TimePoint due = TimePoint::max();  ///< when the other level gets through the filter
  };
  [[nodiscard]] std::optional<SwitchKind> switch_of(std::uint8_t function) const;
  [[nodiscard]] bool raw(std::size_t index, std::int64_t shaft, const InputSettings& settings) const;
  [[nodiscard]] std::uint64_t evaluate(const InputSettings& settings) const;

  std::span<const TerminalSpec> inputs_;
  std::array<std::uint8_t, 3> switch_functions_;
  Mechanics mechanics_;
  std::vector<Terminal> terminals_;
  std::array<bool, 3> wired_{};  ///< by SwitchKind: has a terminal of its own
  std::uint64_t functions_ = 0;  ///< bit = code of an active function
};

}  // namespace axisd::simulation
