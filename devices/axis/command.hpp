// Commands as values: what was asked, what was granted, how it stands. Shared by axis, API and tests.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <variant>

#include "buses/clock.hpp"
#include "buses/error.hpp"
#include "buses/gate.hpp"
#include "devices/access.hpp"
#include "devices/axis/settings.hpp"

namespace axisd {

enum class CommandKind : std::uint8_t {
  enable,
  disable,
  home,
  move_absolute,
  move_relative,
  move_velocity,
  jog,
  halt,
  stop,
  quick_stop,
  reset,
  set_position,
  move_group
};
std::string_view to_string(CommandKind kind);

/// Accepted -> active -> exactly one of the four ends.
enum class CommandState : std::uint8_t { accepted, active, done, aborted, error, unknown };
std::string_view to_string(CommandState state);
inline bool ended(CommandState state) { return state >= CommandState::done; }

/// Values of a motion in user units; unset ones do not apply.
struct MotionValues {
  std::optional<double> position;  ///< absolute target
  std::optional<double> distance;  ///< relative
  std::optional<double> velocity;  ///< units per second; signed for velocity and jog
  std::optional<double> search_velocity;
  std::optional<Duration> acceleration_time, deceleration_time;
  std::optional<Duration> hold;
};

/// One accepted command, as a value. Never changes once ended.
struct Command {
  std::string id;  ///< unique across restarts
  std::string axis;
  std::string request_id;
  std::string client;
  std::uint64_t lease_token = 0;  ///< that it was asked for under; not over a restart
  CommandKind kind = CommandKind::stop;
  MotionValues asked{}, granted{};
  CommandState state = CommandState::accepted;
  std::optional<Error> cause{};  ///< why it was aborted, failed or is unknown
  WallTime accepted_at{};        ///< when the request arrived at the server
  std::optional<WallTime> started_at{}, ended_at{};
  CallOriginPtr origin{};  ///< nullptr: not known; not over a restart
};

/// Nothing that a client asks for may be sent later than this after its request.
inline constexpr Duration longest_validity = std::chrono::minutes(10);

/// How far a caller wants to follow a command before it gets its answer.
enum class WaitUntil : std::uint8_t { accepted, started, done };

enum class BufferMode : std::uint8_t { aborting, buffered };

struct CommandOptions {
  std::string client;             ///< identity that request_id is scoped to
  std::string request_id;         ///< required for motion
  std::uint64_t lease_token = 0;  ///< 0: under no lease
  TimePoint not_after = TimePoint::max();
  TimePoint arrived{};  ///< at the server; not set: the daemon's own
  /// Deadline of the call, as it was known when it arrived: what does not wait in a buffer starts by then, or
  /// not at all (M31). How the call ends changes nothing.
  TimePoint call_deadline = TimePoint::max();
  BufferMode buffer_mode = BufferMode::aborting;
  CallOriginPtr origin{};  ///< nullptr: not known
};

// What a client can ask of an axis. Velocities and positions are in user units; NaN and infinity are refused.
struct EnableRequest {};
struct DisableRequest {};
struct HomeRequest {};
struct MoveAbsoluteRequest {
  double position = 0;
  MotionValues with{};
};  ///< `with`: velocity and times only
struct MoveRelativeRequest {
  double distance = 0;
  MotionValues with{};
};
struct MoveVelocityRequest {
  double velocity = 0;
  std::optional<Duration> hold{};
  MotionValues with{};
};
struct JogRequest {
  double velocity = 0;
  Duration hold = milliseconds(300);
  MotionValues with{};
};
struct StopRequest {
  StopKind kind = StopKind::stop;
  bool hold = false;
  bool all = false;  ///< of all axes
};  ///< halt, stop or quick_stop
struct ResetRequest {};
struct SetPositionRequest {
  double position = 0;
};
/// One axis's part of a group move: submitted with all the others of its group, never alone.
struct GroupMemberRequest {
  std::optional<double> position{};  ///< target, or
  std::optional<double> distance{};  ///< distance: exactly one of them
  MotionValues with{};               ///< velocity and times only
  std::string whole{};               ///< the request that it is part of, as text
};

using Action = std::variant<EnableRequest, DisableRequest, HomeRequest, MoveAbsoluteRequest,
                            MoveRelativeRequest, MoveVelocityRequest, JogRequest, StopRequest, ResetRequest,
                            SetPositionRequest, GroupMemberRequest>;
CommandKind kind_of(const Action& action);

}  // namespace axisd
