// Names of the axis vocabulary, as they appear in logs and on the command line.
#include "devices/axis/names.hpp"

#include <algorithm>
#include <array>
#include <utility>

#include "devices/axis/snapshot.hpp"

namespace axisd {

namespace {

constexpr auto kind_names = std::to_array<std::string_view>(
    {"enable", "disable", "home", "move_absolute", "move_relative", "move_velocity", "jog", "halt", "stop",
     "quick_stop", "reset", "set_position", "move_group"});

}  // namespace

std::string_view to_string(CommandKind kind) { return kind_names.at(std::to_underlying(kind)); }

std::optional<CommandKind> find_command_kind(std::string_view name) {
  const auto found = std::ranges::find(kind_names, name);
  if (found == kind_names.end()) return std::nullopt;
  return static_cast<CommandKind>(found - kind_names.begin());
}

std::string_view to_string(CommandState state) {
  static constexpr auto names =
      std::to_array<std::string_view>({"accepted", "active", "done", "aborted", "error", "unknown"});
  return names.at(std::to_underlying(state));
}

std::string_view to_string(AxisState state) {
  static constexpr auto names =
      std::to_array<std::string_view>({"Disabled", "Standstill", "Homing", "DiscreteMotion",
                                       "ContinuousMotion", "SynchronizedMotion", "Stopping", "ErrorStop"});
  return names.at(std::to_underlying(state));
}

std::string_view to_string(LinkState state) {
  static constexpr auto names = std::to_array<std::string_view>({"offline", "configuring", "online"});
  return names.at(std::to_underlying(state));
}

std::string_view to_string(PositionTrust trust) {
  static constexpr auto names = std::to_array<std::string_view>({"unknown", "set", "homed", "restored"});
  return names.at(std::to_underlying(trust));
}

std::string_view to_string(MotionCause cause) {
  static constexpr auto names = std::to_array<std::string_view>({"none", "command", "terminal", "unknown"});
  return names.at(std::to_underlying(cause));
}

CommandKind kind_of(const Action& action) {
  struct Kind {
    CommandKind operator()(const EnableRequest&) const { return CommandKind::enable; }
    CommandKind operator()(const DisableRequest&) const { return CommandKind::disable; }
    CommandKind operator()(const HomeRequest&) const { return CommandKind::home; }
    CommandKind operator()(const MoveAbsoluteRequest&) const { return CommandKind::move_absolute; }
    CommandKind operator()(const MoveRelativeRequest&) const { return CommandKind::move_relative; }
    CommandKind operator()(const MoveVelocityRequest&) const { return CommandKind::move_velocity; }
    CommandKind operator()(const JogRequest&) const { return CommandKind::jog; }
    CommandKind operator()(const StopRequest& stop) const {
      if (stop.kind == StopKind::halt) return CommandKind::halt;
      return stop.kind == StopKind::quick_stop ? CommandKind::quick_stop : CommandKind::stop;
    }
    CommandKind operator()(const ResetRequest&) const { return CommandKind::reset; }
    CommandKind operator()(const SetPositionRequest&) const { return CommandKind::set_position; }
    CommandKind operator()(const GroupMemberRequest&) const { return CommandKind::move_group; }
  };
  return std::visit(Kind{}, action);
}

}  // namespace axisd
