// What a lane takes, and what a request of it says that the lane has to know. Pure.
#pragma once

#include <cstddef>
#include <cstdint>
#include <expected>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "buses/clock.hpp"

namespace axisd::web {

enum class LaneMethod : std::uint8_t {
  halt,
  stop,
  quick_stop,
  group_halt,
  group_stop,
  stop_all,
  jog,
  renew_lease,
  enable,
  home,
  move_absolute,
  move_relative,
  move_velocity,
  move_group,
  reset,
  set_position,
  release_stop,
  release_stop_all
};

enum class LaneKind : std::uint8_t {
  stop,     ///< may be asked for twice, and late
  jog,      ///< starts, and is renewed, while a button is held
  renewal,  ///< of a lease
  start,    ///< of whatever goes on by itself: late it is not meant any more
  release   ///< of what stops hold: late it would undo a newer stop
};

/// "Halt": the name of the call, in StopService and in its own.
[[nodiscard]] std::string_view name_of(LaneMethod method);
/// "/axisd.v1.AxisService/Halt": where the daemon's main address has it.
[[nodiscard]] std::string_view main_path_of(LaneMethod method);
[[nodiscard]] LaneKind kind_of(LaneMethod method);
/// It may be asked for twice, and late.
[[nodiscard]] inline bool is_stop(LaneMethod method) { return kind_of(method) == LaneKind::stop; }
/// A stop of more than one axis.
[[nodiscard]] bool is_stop_of_many(LaneMethod method);
/// Whether the daemon's stop lane has it: starts and releases go to the main address.
[[nodiscard]] bool is_at_stop_lane(LaneMethod method);
/// What that path asks for; nothing: the lane does not take it.
[[nodiscard]] std::optional<LaneMethod> method_of_path(std::string_view path);

/// The axis that a stop is for; empty: it is not for one, or is not readable, which the daemon tells.
[[nodiscard]] std::string axis_of_stop(LaneMethod method, std::string_view message);

/// Axes of one start, at most.
inline constexpr std::size_t most_members = 64;
/// The axes that a start is for: at least one. Errors: why the lane does not take it; it has to say until
/// when it is valid, as it may wait in the daemon's socket.
[[nodiscard]] std::expected<std::vector<std::string>, std::string> axes_of_start(LaneMethod method,
                                                                                 std::string_view message);

/// A press of a button, or its renewal.
struct Press {
  std::string axis, id;
  Duration hold{};
};
/// What the daemon takes for a jog that says nothing, and its longest (M16).
inline constexpr Duration usual_hold = std::chrono::milliseconds(300), longest_hold = std::chrono::seconds(2);
/// Errors: why the lane does not take it.
[[nodiscard]] std::expected<Press, std::string> press_of(std::string_view message);

}  // namespace axisd::web
