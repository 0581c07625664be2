#include "devices/simulation/input_bank.hpp"

#include <algorithm>

namespace axisd::simulation {

InputBank::InputBank(std::span<const TerminalSpec> inputs, std::array<std::uint8_t, 3> switch_functions,
                     const SimulatedNodeSettings& settings)
    : inputs_(inputs),
      switch_functions_(switch_functions),
      mechanics_(settings.mechanics),
      terminals_(inputs.size()) {
  for (std::size_t i = 0; i < terminals_.size(); ++i) {
    const auto wire = settings.wires.find(inputs[i].name);
    if (wire == settings.wires.end()) continue;
    terminals_[i].wire = wire->second;
    wired_.at(static_cast<std::size_t>(wire->second.kind)) = true;
  }
}

bool InputBank::has(std::string_view terminal) const {
  return std::ranges::find(inputs_, terminal, &TerminalSpec::name) != inputs_.end();
}

void InputBank::drive(std::string_view terminal, std::optional<bool> high) {
  const auto found = std::ranges::find(inputs_, terminal, &TerminalSpec::name);
  if (found != inputs_.end()) terminals_.at(static_cast<std::size_t>(found - inputs_.begin())).driven = high;
}

std::optional<SwitchKind> InputBank::switch_of(std::uint8_t function) const {
  const auto* const found = std::ranges::find(switch_functions_, function);
  if (found == switch_functions_.end()) return std::nullopt;
  return static_cast<SwitchKind>(found - switch_functions_.begin());
}

bool InputBank::raw(std::size_t index, std::int64_t shaft, const InputSettings& settings) const {
  const auto& terminal = terminals_.at(index);
  const bool inverted = (settings.inverted >> index & 1U) != 0;
  if (terminal.driven) return *terminal.driven != inverted;
  if (terminal.wire)
    return switch_active(mechanics_, terminal.wire->kind, shaft) !=
           (terminal.wire->normally_closed != inverted);
  // A switch without a terminal of its own is wired to its function, in the polarity that the drive expects.
  const auto kind = switch_of(settings.functions.at(index));
  if (kind) return !wired_.at(static_cast<std::size_t>(*kind)) && switch_active(mechanics_, *kind, shaft);
  return inverted;  // nothing connected: low level
}

std::uint64_t InputBank::evaluate(const InputSettings& settings) const {
  std::uint64_t functions = 0;
  for (std::size_t i = 0; i < terminals_.size(); ++i)
    if (terminals_[i].active) functions |= std::uint64_t{1} << (settings.functions.at(i) & 63U);
  return functions & ~std::uint64_t{1};
}

std::vector<FunctionEdge> InputBank::sample(TimePoint now, std::int64_t shaft,
                                            const InputSettings& settings) {
  for (std::size_t i = 0; i < terminals_.size(); ++i) {
    auto& terminal = terminals_[i];
    const bool level = raw(i, shaft, settings);
    if (level == terminal.active) {
      terminal.due = TimePoint::max();
      continue;
    }
    if (terminal.due == TimePoint::max()) terminal.due = now + settings.filters.at(i);
    if (terminal.due > now) continue;
    terminal.active = level;
    terminal.due = TimePoint::max();
  }
  const auto before = functions_;
  functions_ = evaluate(settings);
  std::vector<FunctionEdge> edges;
  for (std::uint8_t f = 1; f < 64; ++f)
    if (((functions_ ^ before) >> f & 1U) != 0) edges.push_back({f, active(f)});
  return edges;
}

void InputBank::settle(std::int64_t shaft, const InputSettings& settings) {
  for (std::size_t i = 0; i < terminals_.size(); ++i) {
    terminals_[i].active = raw(i, shaft, settings);
    terminals_[i].due = TimePoint::max();
  }
  functions_ = evaluate(settings);
}

TimePoint InputBank::next_event() const { return std::ranges::min(terminals_, {}, &Terminal::due).due; }

std::uint16_t InputBank::bits() const {
  unsigned bits = 0;
  for (std::size_t i = 0; i < terminals_.size(); ++i) bits |= terminals_[i].active ? 1U << i : 0U;
  return static_cast<std::uint16_t>(bits);
}

}  // namespace axisd::simulation
