#include "config/budget.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <iterator>
#include <limits>

#include "buses/budget_can.hpp"
#include "buses/budget_rtu.hpp"
#include "buses/seconds.hpp"
#include "config/access_warnings.hpp"
#include "config/checks.hpp"
#include "config/file_warnings.hpp"
#include "config/motion_warnings.hpp"
#include "config/position_warnings.hpp"
#include "config/quantity.hpp"
#include "config/start_warnings.hpp"
#include "devices/axis/planner.hpp"
#include "devices/axis/poll_pace.hpp"
#include "devices/descriptor.hpp"
#include "devices/generic/value.hpp"

namespace axisd::config {
namespace {

modbus_rtu::LineDemand demand_of(const modbus_rtu::LineSettings& line, const Configuration& configuration) {
  modbus_rtu::LineDemand demand{.line = line, .axes = {}};
  for (const auto& [axis, simulation] : configuration.axes)
    if (axis.bus == line.name)
      demand.axes.push_back({.name = axis.name,
                             .set = descriptor_of(axis)->rtu_transactions,
                             .poll_moving = axis.poll_moving,
                             .poll_idle = axis.poll_idle,
                             .poll_fastest = std::min(axis.poll_moving, fastest_poll),
                             .quiet_before_end = quiet_before_end,
                             .continuity_period = continuity_period,
                             .drift_check = axis.drift_check,
                             .segments = axis.segments.has_value(),
                             .turnaround_max = axis.turnaround_max});
  for (const auto& device : configuration.devices) {
    if (device.bus != line.name) continue;
    auto& one = demand.devices.emplace_back();
    one.poll = device.poll;
    one.turnaround_max = device.turnaround_max;
    for (const auto& block : blocks_of(device.values)) one.blocks.push_back(reading(block.count));
  }
  return demand;
}

canopen::NetworkDemand demand_of(const canopen::NetworkSettings& network,
                                 const Configuration& configuration) {
  canopen::NetworkDemand demand{.network = network, .axes = {}};
  for (const auto& [axis, simulation] : configuration.axes)
    if (axis.bus == network.name)
      demand.axes.push_back({.name = axis.name,
                             .node = axis.node,
                             .set = descriptor_of(axis)->can_transactions,
                             .poll_moving = axis.poll_moving,
                             .poll_idle = axis.poll_idle,
                             .continuity_period = continuity_period,
                             .drift_check = axis.drift_check});
  for (const auto& device : configuration.devices)
    if (device.bus == network.name)
      demand.devices.push_back(
          {.node = device.node, .transfers = static_cast<int>(device.values.size()), .poll = device.poll});
  return demand;
}

/// At full speed until the stop frame is out, then along the ramp.
double way_of(const AxisSettings& axis, Duration deceleration, const StopBudget& stop) {
  if (stop.last_frame == Duration::max()) return std::numeric_limits<double>::infinity();
  return axis.limits.velocity * (in_seconds(stop.last_frame) + in_seconds(deceleration) / 2);
}

/// From its highest velocity, where a motion asks for no other ramp.
Duration deceleration_of(const AxisSettings& axis) {
  const Scale scale(axis.scale);
  const auto& limits = axis.limits;
  return Planner(axis, *descriptor_of(axis), scale)
      .braking_time(limits.velocity, limits.deceleration_time.value_or(limits.acceleration_time));
}

std::vector<AxisBudgetReport> axis_reports(const BusBudget& budget, const Configuration& configuration) {
  std::vector<AxisBudgetReport> reports;
  for (const auto& predicted : budget.axes) {
    const auto entry = std::ranges::find_if(
        configuration.axes, [&](const AxisEntry& one) { return one.axis.name == predicted.axis; });
    const auto& axis = entry->axis;
    const auto deceleration = deceleration_of(axis);
    reports.push_back({.predicted = predicted,
                       .deceleration = deceleration,
                       .unit = axis.scale.unit,
                       .way_alone = way_of(axis, deceleration, predicted.alone),
                       .way_all = way_of(axis, deceleration, predicted.all)});
  }
  return reports;
}

std::vector<BudgetExcess> excess_of(const BusBudget& budget, const BudgetPolicy& policy) {
  std::vector<BudgetExcess> found;
  if (budget.load.front().utilisation > 1)
    found.push_back({"budget",
                     fmt::format("reading everything as often as it says would take {:.0f} % of the wire's "
                                 "time while all axes rest",
                                 100 * budget.load.front().utilisation),
                     "raise poll.idle of the axes or poll of the devices, or use a faster bus"});
  else if (budget.load.size() > 1 && budget.load[1].utilisation > 1)
    found.push_back(
        {"budget",
         fmt::format("poll.moving cannot be kept: one moving axis beside the others at rest would "
                     "take {:.0f} % of the wire's time",
                     100 * budget.load[1].utilisation),
         "raise poll.moving, or use a faster bus"});
  if (budget.stops.empty()) return found;
  const auto last = budget.stops.back().last_frame;
  if (policy.stop_bound && last > *policy.stop_bound)
    found.push_back({"stop_bound",
                     fmt::format("the last stop frame of all axes may take {}, longer than {}",
                                 bound_text(last), format_duration(*policy.stop_bound)),
                     "lower turnaround_max, put axes on another bus, or raise stop_bound"});
  const auto refresh = budget.load.back().refresh_moving;
  if (policy.refresh_bound && refresh > *policy.refresh_bound)
    found.push_back(
        {"refresh_bound",
         fmt::format("while all axes move, {} may pass between two readings of one, longer than {}",
                     bound_text(refresh), format_duration(*policy.refresh_bound)),
         "lower turnaround_max, put axes on another bus, or raise refresh_bound"});
  return found;
}

/// `learnt`: what `axisd --quiesce` has to find out about the bus first, at most.
std::string note_on_hang(const BusBudget& budget, Duration learnt) {
  const auto last = budget.stops.back().last_frame;
  const auto before = killed_within + quiesce_begins_within + learnt;
  const auto all = last == Duration::max() ? last : before + last;
  return fmt::format(
      "where the daemon hangs and the service runs as it is installed, the last stop frame of all axes goes "
      "out {}: {} until systemd has killed it, {} until axisd --quiesce has the bus, and the stops",
      within_text(all), bound_text(killed_within), bound_text(quiesce_begins_within + learnt));
}

Duration learnt_first(const modbus_rtu::LineSettings& line) {
  return std::max<Duration>(longest_echo, line.turnaround_max);
}

Duration learnt_first(const canopen::NetworkSettings& /*network*/) { return Duration::zero(); }

template <class Demand>
BusBudgetReport report_on(BusKind kind, const BudgetPolicy& policy, const Demand& demand, Duration learnt,
                          const Configuration& configuration) {
  BusBudgetReport report{.kind = kind, .policy = policy, .predicted = budget_of(demand)};
  if (!report.predicted.stops.empty())
    report.predicted.notes.push_back(note_on_hang(report.predicted, learnt));
  report.axes = axis_reports(report.predicted, configuration);
  report.excess = excess_of(report.predicted, policy);
  return report;
}

}  // namespace

std::vector<BusBudgetReport> budgets(const Configuration& configuration) {
  std::vector<BusBudgetReport> reports;
  reports.reserve(configuration.lines.size() + configuration.networks.size());
  for (const auto& line : configuration.lines)
    reports.push_back(report_on(BusKind::modbus_rtu, line.budget, demand_of(line, configuration),
                                learnt_first(line), configuration));
  for (const auto& network : configuration.networks)
    reports.push_back(report_on(BusKind::canopen, network.budget, demand_of(network, configuration),
                                learnt_first(network), configuration));
  return reports;
}

std::string summary(const BusBudgetReport& report) {
  const auto& budget = report.predicted;
  if (budget.stops.empty())
    return fmt::format("{}: utilisation {:.2f}, no axes", budget.bus, budget.load.front().utilisation);
  return fmt::format(
      "{}: utilisation {:.2f} (all axes moving: {:.2f}), last stop frame of one axis {}, of all {} {}, "
      "refresh {} while all move",
      budget.bus, budget.load.front().utilisation, budget.load.back().utilisation,
      within_text(budget.stops.front().last_frame), budget.stops.size(),
      within_text(budget.stops.back().last_frame), within_text(budget.load.back().refresh_moving));
}

std::vector<std::string> warnings(const BusBudgetReport& report) {
  std::vector<std::string> lines;
  lines.reserve(report.excess.size());
  for (const auto& [key, text, remedy] : report.excess)
    lines.push_back(fmt::format("{}: {}; {}", report.predicted.bus, text, remedy));
  return lines;
}

std::vector<std::string> warnings(const std::vector<BusBudgetReport>& reports) {
  std::vector<std::string> lines;
  for (const auto& report : reports) std::ranges::move(warnings(report), std::back_inserter(lines));
  return lines;
}

std::vector<std::string> other_warnings(const Configuration& configuration) {
  std::vector<std::string> lines;
  for (const auto look : {motion_warnings, position_warnings, start_warnings, file_warnings, access_warnings})
    std::ranges::move(look(configuration), std::back_inserter(lines));
  return lines;
}

std::vector<std::string> warnings(const Configuration& configuration) {
  auto lines = warnings(budgets(configuration));
  std::ranges::move(other_warnings(configuration), std::back_inserter(lines));
  return lines;
}

void check_budgets(const Configuration& configuration, Diagnostics& diagnostics, const Places& places) {
  const auto refuses = [](const auto& bus) { return bus.budget.refuse; };
  if (!std::ranges::any_of(configuration.lines, refuses) &&
      !std::ranges::any_of(configuration.networks, refuses))
    return;
  for (const auto& report : budgets(configuration)) {
    if (!report.policy.refuse) continue;
    const auto* kind = report.kind == BusKind::modbus_rtu ? "modbus_rtu" : "canopen";
    for (const auto& [key, text, remedy] : report.excess)
      diagnostics.add(places.mark(fmt::format("buses.{}.{}.{}", report.predicted.bus, kind, key)),
                      fmt::format("bus '{}': {}", report.predicted.bus, text), remedy);
  }
}

}  // namespace axisd::config
