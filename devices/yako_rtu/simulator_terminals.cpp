#include "devices/yako_rtu/simulator_terminals.hpp"

#include <algorithm>

namespace axisd::yako_rtu {

namespace {

using simulation::SwitchKind;

Input function_of(std::size_t index, const Memory& memory) {
  const auto code = memory.get(static_cast<std::uint16_t>(memory.first_input_function() + index));
  return code < input_functions ? static_cast<Input>(code) : Input::none;
}

std::optional<SwitchKind> switch_of(Input function) {
  if (function == Input::home) return SwitchKind::home;
  if (function == Input::positive_limit) return SwitchKind::positive_limit;
  if (function == Input::negative_limit) return SwitchKind::negative_limit;
  return std::nullopt;
}

}  // namespace

Terminals::Terminals(const SimulatedModel& model, const Behaviour& behaviour,
                     const simulation::SimulatedNodeSettings& settings)
    : model_(&model),
      behaviour_(&behaviour),
      mechanics_(settings.mechanics),
      terminals_(model.inputs.size()) {
  for (std::size_t i = 0; i < terminals_.size(); ++i) {
    const auto wire = settings.wires.find(model.inputs[i].name);
    if (wire == settings.wires.end()) continue;
    terminals_[i].wire = wire->second;
    wired_.at(static_cast<std::size_t>(wire->second.kind)) = true;
  }
}

void Terminals::drive(std::string_view terminal, std::optional<bool> high) {
  const auto found = std::ranges::find(model_->inputs, terminal, &TerminalSpec::name);
  if (found != model_->inputs.end())
    terminals_.at(static_cast<std::size_t>(found - model_->inputs.begin())).driven = high;
}

bool Terminals::raw(std::size_t index, std::int64_t shaft, const Memory& memory) const {
  const auto& terminal = terminals_.at(index);
  const bool inverted = (memory.get(reg::input_levels) >> index & 1U) != 0;
  if (terminal.driven) return *terminal.driven != inverted;
  if (terminal.wire)
    return switch_active(mechanics_, terminal.wire->kind, shaft) !=
           (terminal.wire->normally_closed != inverted);
  // A switch without a terminal of its own is wired to its function, in the polarity that the drive expects.
  const auto kind = switch_of(function_of(index, memory));
  if (kind) return !wired_.at(static_cast<std::size_t>(*kind)) && switch_active(mechanics_, *kind, shaft);
  return inverted;  // nothing connected: low level
}

/// 4.3: a pulse must be longer than 10 ms, the default of the filters (one register for two inputs), which
/// are taken as milliseconds. The high-speed inputs of YKD2405PR have none.
Duration Terminals::filter(std::size_t index, const Memory& memory) const {
  if (index < model_->unfiltered_inputs) return {};
  if (switch_of(function_of(index, memory)) && !behaviour_->filter_home_and_limits) return {};
  const auto pair = (index - model_->unfiltered_inputs) / 2;
  return std::chrono::milliseconds(memory.get(static_cast<std::uint16_t>(model_->first_filter + pair)));
}

std::array<bool, input_functions> Terminals::evaluate(const Memory& memory) const {
  std::array<bool, input_functions> functions{};
  for (std::size_t i = 0; i < terminals_.size(); ++i)
    if (terminals_.at(i).active) functions.at(static_cast<std::size_t>(function_of(i, memory))) = true;
  return functions;
}

std::vector<InputEdge> Terminals::sample(TimePoint now, std::int64_t shaft, const Memory& memory) {
  for (std::size_t i = 0; i < terminals_.size(); ++i) {
    auto& terminal = terminals_.at(i);
    const bool level = raw(i, shaft, memory);
    if (level == terminal.active) {
      terminal.due = TimePoint::max();
    } else if (terminal.due == TimePoint::max()) {
      terminal.due = now + filter(i, memory);
    }
    if (terminal.due > now) continue;
    terminal.active = level;
    terminal.due = TimePoint::max();
  }
  const auto before = functions_;
  functions_ = evaluate(memory);
  std::vector<InputEdge> edges;
  for (std::size_t f = 1; f < input_functions; ++f)
    if (functions_.at(f) != before.at(f)) edges.push_back({static_cast<Input>(f), functions_.at(f)});
  return edges;
}

void Terminals::settle(std::int64_t shaft, const Memory& memory) {
  for (std::size_t i = 0; i < terminals_.size(); ++i) {
    terminals_.at(i).active = raw(i, shaft, memory);
    terminals_.at(i).due = TimePoint::max();
  }
  functions_ = evaluate(memory);
}

TimePoint Terminals::next_event() const { return std::ranges::min(terminals_, {}, &Terminal::due).due; }

std::uint16_t Terminals::bits() const {
  unsigned bits = 0;
  for (std::size_t i = 0; i < terminals_.size(); ++i) bits |= terminals_.at(i).active ? 1U << i : 0U;
  return static_cast<std::uint16_t>(bits);
}

int Terminals::segment() const {
  int number = 0;
  for (int pin = 0; pin < 5; ++pin)
    if (functions_.at(static_cast<std::size_t>(Input::pin0) + static_cast<std::size_t>(pin)))
      number |= 1 << pin;
  const int most = behaviour_->all_segments ? 16 : model_->segments;
  return number <= most ? number : 0;  // 7.3.2 lists 1..16; its note on ESS42-R: 7 at most
}

}  // namespace axisd::yako_rtu
