#include "devices/yako_rtu/simulator_terminals.hpp"

namespace axisd::yako_rtu {

namespace {

Input function_of(std::size_t index, const Memory& memory) {
  const auto code = memory.get(static_cast<std::uint16_t>(memory.first_input_function() + index));
  return code < input_functions ? static_cast<Input>(code) : Input::none;
}

constexpr std::uint8_t code(Input function) { return static_cast<std::uint8_t>(function); }

bool is_switch(Input function) {
  return function == Input::home || function == Input::positive_limit || function == Input::negative_limit;
}

}  // namespace

Terminals::Terminals(const SimulatedModel& model, const Behaviour& behaviour,
                     const simulation::SimulatedNodeSettings& settings)
    : model_(&model),
      behaviour_(&behaviour),
      bank_(model.inputs, {code(Input::home), code(Input::positive_limit), code(Input::negative_limit)},
            settings) {}

/// 4.3: a pulse must be longer than 10 ms, the default of the filters (one register for two inputs), which
/// are taken as milliseconds. The high-speed inputs of YKD2405PR have none.
Duration Terminals::filter(std::size_t index, const Memory& memory) const {
  if (index < model_->unfiltered_inputs) return {};
  if (is_switch(function_of(index, memory)) && !behaviour_->filter_home_and_limits) return {};
  const auto pair = (index - model_->unfiltered_inputs) / 2;
  return std::chrono::milliseconds(memory.get(static_cast<std::uint16_t>(model_->first_filter + pair)));
}

simulation::InputSettings Terminals::settings(const Memory& memory) const {
  simulation::InputSettings settings;
  settings.inverted = memory.get(reg::input_levels);
  for (std::size_t i = 0; i < model_->inputs.size(); ++i) {
    settings.functions.at(i) = code(function_of(i, memory));
    settings.filters.at(i) = filter(i, memory);
  }
  return settings;
}

std::vector<InputEdge> Terminals::sample(TimePoint now, std::int64_t shaft, const Memory& memory) {
  std::vector<InputEdge> edges;
  for (const auto& edge : bank_.sample(now, shaft, settings(memory)))
    edges.push_back({static_cast<Input>(edge.function), edge.rising});
  return edges;
}

int Terminals::segment() const {
  int number = 0;
  for (int pin = 0; pin < 5; ++pin)
    if (bank_.active(static_cast<std::uint8_t>(code(Input::pin0) + pin))) number |= 1 << pin;
  const int most = behaviour_->all_segments ? 16 : model_->segments;
  return number <= most ? number : 0;  // 7.3.2 lists 1..16; its note on ESS42-R: 7 at most
}

}  // namespace axisd::yako_rtu
