#include "api/axisctl/cell_view.hpp"

#include <fmt/format.h>
#include <google/protobuf/util/time_util.h>

#include "api/axisctl/error.hpp"
#include "api/axisctl/format.hpp"

namespace axisd::axisctl {
namespace {

using google::protobuf::util::TimeUtil;

std::string state_word(cell::v1::MachineState state) {
  if (state == cell::v1::MACHINE_STATE_UNSPECIFIED) return "not asked yet";
  return lower_word(cell::v1::MachineState_Name(state), "MACHINE_STATE_");
}

Colour state_colour(cell::v1::MachineState state) {
  switch (state) {
    case cell::v1::MACHINE_STATE_PRESENT:
      return Colour::green;
    case cell::v1::MACHINE_STATE_SILENT:
      return Colour::red;
    case cell::v1::MACHINE_STATE_UNREGISTERED:
      return Colour::yellow;
    case cell::v1::MACHINE_STATE_GONE:
      return Colour::dim;
    default:
      return Colour::none;
  }
}

/// Whole seconds: machines come and go slower than motions.
std::string time_text(const google::protobuf::Timestamp& at) {
  return TimeUtil::ToString(TimeUtil::SecondsToTimestamp(at.seconds()));
}

std::string remarks(const cell::v1::Machine& machine) {
  std::string text = machine.own() ? "this entrance's" : "";
  if (!machine.trouble().empty()) text += (text.empty() ? "" : ", ") + machine.trouble();
  return text;
}

std::string latch_text(const cell::v1::StopAllLatch& latch) {
  return fmt::format("by {} through {}, {}{}", latch.by(), latch.entrance(), time_text(latch.at()),
                     latch.reason().empty() ? "" : fmt::format(": {}", latch.reason()));
}

std::string registry_text(const cell::v1::GetCellResponse& cell) {
  auto text = lower_word(cell::v1::RegistryState_Name(cell.registry()), "REGISTRY_STATE_");
  if (cell.registry() == cell::v1::REGISTRY_STATE_BY_HAND)
    text = "by hand: the machines of its configuration";
  if (cell.has_registry_since()) text += fmt::format(", since {}", time_text(cell.registry_since()));
  if (cell.has_registry_trouble()) text += fmt::format(": {}", describe(cell.registry_trouble()));
  return text;
}

std::string trouble_of(const v1::ErrorDetail& error, bool given, std::string_view otherwise) {
  return given ? describe(error) : std::string(otherwise);
}

/// By etcd alone: an entrance without it asks a machine no more than whether it is there.
bool is_known_inside(const cell::v1::Machine& machine) {
  return machine.axes_size() > 0 || !machine.configuration_revision().empty();
}

}  // namespace

void update(Machines& machines, const cell::v1::WatchMachinesResponse& change) {
  for (const auto& machine : change.machines()) machines[machine.name()] = machine;
  for (const auto& name : change.forgotten()) machines.erase(name);
}

bool answers(const cell::v1::Machine& machine) {
  return machine.state() == cell::v1::MACHINE_STATE_PRESENT ||
         machine.state() == cell::v1::MACHINE_STATE_UNREGISTERED;
}

Table machine_table(const Machines& machines) {
  Table table({"MACHINE", "STATE", "AXES", "VERSION", "SINCE", "ROUND TRIP", "STOPALL", "CONFIGURATION",
               "ADDRESS", "REMARKS"},
              {2, 5});
  table.leave_out_first({8, 7, 3});
  for (const auto& [name, machine] : machines)
    table.add({name,
               {state_word(machine.state()), state_colour(machine.state())},
               is_known_inside(machine) ? std::to_string(machine.axes_size()) : "-",
               machine.version(),
               time_text(machine.since()),
               machine.has_round_trip() ? duration_text(seconds(machine.round_trip())) : "-",
               machine.stop_all() ? Cell("latched", Colour::yellow) : Cell("-"),
               is_known_inside(machine) ? machine.configuration_revision() : "-",
               machine.axisd_address(),
               {remarks(machine), machine.trouble().empty() ? Colour::none : Colour::red}});
  return table;
}

std::string machine_line(const cell::v1::Machine& machine) {
  return fmt::format("{}  {}, since {}{}{}{}{}", machine.name(), state_word(machine.state()),
                     time_text(machine.since()),
                     is_known_inside(machine) ? fmt::format(", {} axes", machine.axes_size()) : "",
                     machine.stop_all() ? ", all axes stopped" : "", machine.trouble().empty() ? "" : ": ",
                     machine.trouble());
}

std::vector<std::string> cell_details(const cell::v1::GetCellResponse& cell, bool colour) {
  std::vector<std::string> lines{fmt::format("cell:       {}", cell.cell()),
                                 fmt::format("entrance:   {}, axisd-cell {}", cell.machine(), cell.version()),
                                 fmt::format("instance:   {}", cell.instance_id()),
                                 fmt::format("you:        {}", cell.client())};
  const bool degraded = cell.registry() == cell::v1::REGISTRY_STATE_DEGRADED;
  lines.push_back(
      fmt::format("registry:   {}", coloured(registry_text(cell), Colour::yellow, colour && degraded)));
  if (cell.stop_all().empty()) lines.emplace_back("stop all:   no");
  for (const auto& latch : cell.stop_all())
    lines.push_back(fmt::format("stop all:   {}; 'axisctl release-stop --all' ends it",
                                coloured(latch_text(latch), Colour::yellow, colour)));
  if (cell.has_not_durable())
    lines.push_back(
        fmt::format("disk:       {}", coloured(describe(cell.not_durable()), Colour::red, colour)));
  return lines;
}

std::vector<std::string> cell_warnings(const cell::v1::GetCellResponse& cell, bool colour) {
  std::vector<std::string> lines;
  if (cell.registry() == cell::v1::REGISTRY_STATE_DEGRADED)
    lines.push_back(coloured(fmt::format("cell: registry {}", registry_text(cell)), Colour::yellow, colour));
  for (const auto& latch : cell.stop_all())
    lines.push_back(coloured(
        fmt::format("cell: all machines stopped {}; 'axisctl release-stop --all' ends it", latch_text(latch)),
        Colour::yellow, colour));
  return lines;
}

std::string stop_line(const cell::v1::MachineStop& stop, bool colour) {
  const auto red = [&](const std::string& text) {
    return coloured(fmt::format("{}: {}", stop.machine(), text), Colour::red, colour);
  };
  switch (stop.outcome()) {
    case cell::v1::MACHINE_OUTCOME_DONE:
      return fmt::format("{}: stopped and latched, answered in {}", stop.machine(),
                         duration_text(seconds(stop.took())));
    case cell::v1::MACHINE_OUTCOME_SILENT:
      return red(
          fmt::format("SILENT, not confirmed: {}",
                      trouble_of(stop.error(), stop.has_error(), "it does not answer; look at the machine")));
    default:
      return red(fmt::format("NOT confirmed: {}", trouble_of(stop.error(), stop.has_error(),
                                                             "it did not say why; look at the machine")));
  }
}

std::string release_line(const cell::v1::MachineRelease& release, bool colour) {
  if (release.outcome() == cell::v1::MACHINE_OUTCOME_DONE)
    return fmt::format("{}: released", release.machine());
  const bool silent = release.outcome() == cell::v1::MACHINE_OUTCOME_SILENT;
  return coloured(
      fmt::format("{0}: {1}, stays stopped: {2}; 'axisctl --machine {0} release-stop --all' releases it",
                  release.machine(), silent ? "SILENT" : "refused",
                  trouble_of(release.error(), release.has_error(), "it did not say why")),
      Colour::red, colour);
}

std::string cell_event_line(const cell::v1::CellEvent& event) {
  const auto at = TimeUtil::MillisecondsToTimestamp(TimeUtil::TimestampToMilliseconds(event.at()));
  return fmt::format("{}  {}  {}  {}", TimeUtil::ToString(at), event.sequence(),
                     event.machine().empty() ? "cell" : event.machine(), event.text());
}

}  // namespace axisd::axisctl
