#include "devices/simulation/simulator.hpp"

#include <fmt/format.h>

#include <algorithm>

namespace axisd::simulation {

const Simulator* find_simulator(std::string_view model) {
  for (const auto* simulator : simulators())
    if (simulator->model == model) return simulator;
  return nullptr;
}

namespace {

/// "a, b, c" of everything that has a name.
template <class Named>
std::string names_of(std::span<const Named> all) {
  std::string text;
  for (const auto& one : all) text += fmt::format("{}{}", text.empty() ? "" : ", ", one.name);
  return text;
}

template <class Named>
bool contains(std::span<const Named> all, std::string_view name) {
  return std::ranges::any_of(all, [&](const Named& one) { return one.name == name; });
}

}  // namespace

Result<std::unique_ptr<SimulatedRtuNode>> make_node(const Simulator& simulator,
                                                    SimulatedNodeSettings settings) {
  if (settings.address < 1 || settings.address > 127)
    return fail(Reason::out_of_range, fmt::format("node {} is not a Modbus address", settings.address),
                "use 1 to 127");
  for (const auto& [name, on] : settings.switches)
    if (!contains(simulator.switches, name))
      return fail(Reason::invalid_argument, fmt::format("{} has no switch \"{}\"", simulator.model, name),
                  "use one of " + names_of(simulator.switches));
  for (const auto& [terminal, wire] : settings.wires)
    if (!contains(simulator.inputs, terminal))
      return fail(Reason::invalid_argument, fmt::format("{} has no input \"{}\"", simulator.model, terminal),
                  "use one of " + names_of(simulator.inputs));
  return simulator.make(std::move(settings));
}

Result<std::unique_ptr<SimulatedRtuNode>> make_node(std::string_view model, SimulatedNodeSettings settings) {
  const auto* simulator = find_simulator(model);
  if (simulator != nullptr) return make_node(*simulator, std::move(settings));
  std::string known;
  for (const auto* one : simulators()) known += fmt::format("{}{}", known.empty() ? "" : ", ", one->model);
  return fail(Reason::invalid_argument, fmt::format("there is no simulator for \"{}\"", model),
              "use one of " + known);
}

}  // namespace axisd::simulation
