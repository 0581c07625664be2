// What commands do that are asked of a whole cell.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "api/axisctl/invocation.hpp"
#include "axisd/v1/axis_service.pb.h"
#include "axisd/v1/group_service.pb.h"
#include "axisd/v1/system_service.pb.h"

namespace axisd::axisctl {

// Each throws Failure where the entrance does not answer, or nothing is selected (Selection). Machines that
// do not answer are complained of, and make the exit status.

/// All axes, one line each.
void list_cell(Invocation& invocation, const std::vector<std::string>& words, bool names);
/// Everything known about the axes of machines.
void show_cell_axes(Invocation& invocation, const std::vector<std::string>& words);
/// What each machine's daemon keeps over restarts. `show`: prints one as text.
void show_kept_states(Invocation& invocation, void (*show)(const v1::GetStateResponse&));
/// Ticks of all that are selected, those of machines that come later, too. `request`: period and fields.
/// `count`: ends after so many ticks in all; 0: without end.
void watch_cell(Invocation& invocation, const std::vector<std::string>& words,
                const v1::WatchAxesRequest& request, std::uint64_t count);
/// StopAll of the cell, told by the entrance. `wait`: until each machine that answered has confirmed
/// standstill.
void stop_cell(Invocation& invocation, bool wait);
/// Its release, and that of each machine's own.
void release_cell(Invocation& invocation);
/// Its targets are of several machines of a cell.
[[nodiscard]] bool names_several_machines(const Invocation& invocation, const v1::MoveGroupRequest& move);
/// Moves them from one moment on, told by the entrance. `clock_tolerance`: nullptr: the usual one.
void move_cell_group(Invocation& invocation, const v1::MoveGroupRequest& move,
                     const google::protobuf::Duration* clock_tolerance);

}  // namespace axisd::axisctl
