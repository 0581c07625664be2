#include "devices/simulation/simulator.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

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

std::string models_with_sheet() {
  std::string text;
  for (const auto* simulator : simulators())
    if (simulator->takes_sheet) text += fmt::format("{}{}", text.empty() ? "" : ", ", simulator->model);
  return text;
}

/// What the model cannot be set to.
Result<void> check(const Simulator& simulator, const SimulatedNodeSettings& settings) {
  if (settings.address < 1 || settings.address > simulator.maximum_node)
    return fail(Reason::out_of_range,
                fmt::format("node {} is no address of {}", settings.address, simulator.model),
                fmt::format("use 1 to {}", simulator.maximum_node));
  if (settings.dip_address > simulator.maximum_dip_address)
    return fail(
        Reason::out_of_range,
        fmt::format("the address switches of {} do not go to {}", simulator.model, *settings.dip_address),
        fmt::format("use dip=0 to {}", simulator.maximum_dip_address));
  if (settings.dip_baud.value_or(0) != 0 &&
      std::ranges::find(simulator.dip_bauds, *settings.dip_baud) == simulator.dip_bauds.end())
    return fail(Reason::out_of_range,
                fmt::format("{} has no switch for {} bit/s", simulator.model, *settings.dip_baud),
                fmt::format("use dip_baud=custom{}{}", simulator.dip_bauds.empty() ? "" : " or ",
                            fmt::join(simulator.dip_bauds, ", ")));
  if (settings.sheet && !simulator.takes_sheet)
    return fail(Reason::invalid_argument, fmt::format("{} is not made by a data sheet", simulator.model),
                fmt::format("leave eds= out; models that are made by one: {}", models_with_sheet()));
  for (const auto& [name, on] : settings.switches)
    if (!contains(simulator.switches, name))
      return fail(Reason::invalid_argument, fmt::format("{} has no switch \"{}\"", simulator.model, name),
                  "use one of " + names_of(simulator.switches));
  if (!settings.eeprom.empty() && settings.eeprom.rbegin()->first > simulator.last_register)
    return fail(Reason::out_of_range,
                fmt::format("{} has no register 0x{:04X}", simulator.model, settings.eeprom.rbegin()->first),
                fmt::format("its last is 0x{:04X}", simulator.last_register));
  for (const auto& [address, value] : settings.eeprom)
    // A signed value of 16 bits came with the bits of 32.
    if (simulator.make != nullptr && value > 0xFFFF && value < 0xFFFF8000)
      return fail(
          Reason::out_of_range,
          fmt::format("{} does not fit into register 0x{:04X} of {}", value, address, simulator.model),
          "use -32768 to 65535");
  for (const auto& [terminal, wire] : settings.wires)
    if (!contains(simulator.inputs, terminal))
      return fail(Reason::invalid_argument, fmt::format("{} has no input \"{}\"", simulator.model, terminal),
                  "use one of " + names_of(simulator.inputs));
  return {};
}

Error wrong_bus(std::string_view model) {
  return {.reason = Reason::invalid_argument,
          .message = fmt::format("{} is not for this kind of bus", model),
          .remedy = "put it on another: RS-485 and CAN drives do not mix"};
}

Result<const Simulator*> find_or_explain(std::string_view model) {
  if (const auto* simulator = find_simulator(model)) return simulator;
  std::string known;
  for (const auto* one : simulators()) known += fmt::format("{}{}", known.empty() ? "" : ", ", one->model);
  return fail(Reason::invalid_argument, fmt::format("there is no simulator for \"{}\"", model),
              "use one of " + known);
}

}  // namespace

Result<std::unique_ptr<SimulatedRtuNode>> make_node(const Simulator& simulator,
                                                    SimulatedNodeSettings settings) {
  if (const auto possible = check(simulator, settings); !possible) return fail(possible.error());
  if (simulator.make == nullptr) return fail(wrong_bus(simulator.model));
  return simulator.make(std::move(settings));
}

Result<std::unique_ptr<SimulatedRtuNode>> make_node(std::string_view model, SimulatedNodeSettings settings) {
  const auto simulator = find_or_explain(model);
  if (!simulator) return fail(simulator.error());
  return make_node(**simulator, std::move(settings));
}

Result<std::unique_ptr<SimulatedCanNode>> make_can_node(std::string_view model,
                                                        SimulatedNodeSettings settings) {
  const auto simulator = find_or_explain(model);
  if (!simulator) return fail(simulator.error());
  if (const auto possible = check(**simulator, settings); !possible) return fail(possible.error());
  if ((*simulator)->make_can == nullptr) return fail(wrong_bus(model));
  return (*simulator)->make_can(std::move(settings));
}

}  // namespace axisd::simulation
