#include "daemon/simulation_control.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <future>
#include <optional>

#include "buses/limited_log.hpp"
#include "devices/nearest.hpp"
#include "devices/simulation/axis_control.hpp"

namespace axisd {

namespace {

std::string refusal(const Error& error) { return fmt::format("error {}; {}", error.message, error.remedy); }

/// The first word, which is taken from `text`.
std::string_view take_word(std::string_view& text) {
  const auto word = text.substr(0, text.find(' '));
  text.remove_prefix(std::min(word.size() + 1, text.size()));
  return word;
}

}  // namespace

SimulationControl::SimulationControl(core::CoreLoop& loop, SimulatedLines& lines, SimulatedNetworks& networks,
                                     const config::Configuration& configuration)
    : loop_(&loop), lines_(&lines), networks_(&networks), axes_(configuration.axes) {
  for (const auto& line : configuration.lines) buses_.push_back(line.name);
  for (const auto& network : configuration.networks) buses_.push_back(network.name);
}

void SimulationControl::reconfigure(const config::Configuration& configuration) {
  const std::lock_guard lock(mutex_);
  axes_ = configuration.axes;
}

std::string SimulationControl::execute(std::string_view line) {
  log_limited(spdlog::level::info, "simulation", "commands", line);
  auto rest = line;
  const auto kind = take_word(rest);
  const auto name = take_word(rest);
  if (kind == "axis") return on_axis(name, rest);
  if (kind == "bus") return on_bus(name, rest);
  return "error that is no command for simulated drives; use: axis NAME ... or bus NAME ...";
}

std::string SimulationControl::on_axis(std::string_view name, std::string_view command) {
  std::optional<config::AxisEntry> found;
  std::vector<std::string> names;
  {
    const std::lock_guard lock(mutex_);
    for (const auto& entry : axes_) {
      names.push_back(entry.axis.name);
      if (entry.axis.name == name) found = entry;
    }
  }
  if (!found) return refusal(no_such_axis(name, names));
  const auto made = simulation::axis_command(found->axis, command);
  if (!made) return refusal(made.error());
  return simulation::axis_reply(found->axis, found->simulation.start_position,
                                on_network(found->axis.bus, *made));
}

std::string SimulationControl::on_bus(std::string_view name, std::string_view command) {
  if (std::ranges::find(buses_, name) == buses_.end())
    return refusal({.reason = Reason::invalid_argument,
                    .message = fmt::format("there is no bus '{}'", name),
                    .remedy = fmt::format("name one of {}", fmt::join(buses_, ", "))});
  if (command == "cut" || command == "join") return on_network(std::string(name), std::string(command));
  if (command == "clear") return on_network(std::string(name), "fault clear");
  return "error that is no command for a simulated bus; use: cut, join or clear";
}

std::string SimulationControl::on_network(const std::string& bus, const std::string& command) {
  if (const auto reply = lines_->control(bus, command)) return *reply;
  // Simulated CAN nodes run on the core.
  std::promise<std::optional<std::string>> promise;
  auto reply = promise.get_future();
  post(loop_->executor(), [&] { promise.set_value(networks_->control(bus, command)); });
  return reply.get().value_or(fmt::format(
      "error bus '{}' is not simulated; only drives on a bus with port: sim or interface: sim take this",
      bus));
}

std::string simulation_socket(std::string_view instance_id) {
  return fmt::format("@axisd-sim-{}", instance_id);
}

}  // namespace axisd
