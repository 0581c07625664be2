// A cell and its machines as tables and lines. Pure.
#pragma once

#include <map>
#include <string>
#include <vector>

#include "api/axisctl/table.hpp"
#include "axisd/cell/v1/cell_service.pb.h"

namespace axisd::axisctl {

/// By name, as WatchMachines tells of them.
using Machines = std::map<std::string, cell::v1::Machine>;

/// Takes in what changed.
void update(Machines& machines, const cell::v1::WatchMachinesResponse& change);
/// Its axisd answered when it was last asked.
[[nodiscard]] bool answers(const cell::v1::Machine& machine);

/// One row per machine.
[[nodiscard]] Table machine_table(const Machines& machines);
/// "press-2  present, since 2026-11-27T02:11:26Z, 8 axes".
[[nodiscard]] std::string machine_line(const cell::v1::Machine& machine);
/// Name, entrance, registry and what stands of StopAll, a line per item.
[[nodiscard]] std::vector<std::string> cell_details(const cell::v1::GetCellResponse& cell, bool colour);
/// What a person must know before the machines are looked at: a degraded registry, a StopAll. Empty: nothing.
[[nodiscard]] std::vector<std::string> cell_warnings(const cell::v1::GetCellResponse& cell, bool colour);

/// What became of StopAll at a machine: "press-2: all axes stopped, in 12 ms".
[[nodiscard]] std::string stop_line(const cell::v1::MachineStop& stop, bool colour);
/// And of its release.
[[nodiscard]] std::string release_line(const cell::v1::MachineRelease& release, bool colour);

/// "2026-11-27T02:11:26.123Z  press-2  present -> silent: connection refused".
[[nodiscard]] std::string cell_event_line(const cell::v1::CellEvent& event);

}  // namespace axisd::axisctl
