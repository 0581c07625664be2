// Group moves as values: what is asked for, and how it stands. Shared by core, API and tests.
#pragma once

#include <functional>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "buses/clock.hpp"
#include "buses/error.hpp"
#include "devices/axis/command.hpp"
#include "devices/axis/stop_holds.hpp"

namespace axisd {

/// `groups:` of the configuration.
struct GroupSettings {
  std::string name;
  std::vector<std::string> axes;  ///< at least two, each once
  /// Between the first and the last arrival; more is refused where axes are to arrive together. Nothing: any.
  std::optional<Duration> max_arrival_error{};
};

/// Where one axis is to go.
struct GroupTarget {
  std::string axis;
  std::optional<double> position{}, distance{};  ///< exactly one of them; user units
  MotionValues with{};                           ///< velocity and times only
};

/// When a group move starts.
enum class GroupStart : std::uint8_t {
  at_once,
  when_told,  ///< at a moment that GroupAccess::start() names, once it is prepared
};

struct GroupMoveRequest {
  std::string group;                            ///< empty: the axes of the targets are one for this move
  std::vector<GroupTarget> targets;             ///< at least one, each axis once
  bool arrive_together = false;                 ///< faster axes are slowed down to the slowest
  std::optional<Duration> max_arrival_error{};  ///< in place of the group's
  GroupStart start = GroupStart::at_once;
};

/// One member of a group move, as it stands.
struct GroupMember {
  Command command;
  Duration predicted{};                     ///< from its start to its arrival; 0: it stands at its target
  bool by_sync = false;                     ///< started by a SYNC together with the others of its network
  std::string note{};                       ///< why not, where its bus has SYNC
  std::optional<Duration> started_after{};  ///< its start frame's end, after the first one's of the group
  std::optional<Duration> arrived_after{};  ///< first seen at its target, after the group's first start
};

/// Of a move that starts when told, as it stands. Moments are those of this machine's clock.
struct GroupPreparation {
  std::optional<TimePoint> expires{};  ///< no start later than this; nothing: it is not prepared yet
  Duration notice{};          ///< it has to be told so long before its moment, for a last look at the members
  Duration predicted_skew{};  ///< between the first and the last start frame
  std::optional<TimePoint> starts_at{};    ///< once it was told
  std::optional<TimePoint> first_start{};  ///< when its first start frame had gone out
};

struct GroupMove {
  std::string id;  ///< unique across restarts
  std::string group;
  CommandState state = CommandState::accepted;  ///< of all: active where all were started, done where all are
  std::optional<Error> cause{};                 ///< what ended it, of the member that was the first
  std::vector<GroupMember> members;             ///< by name of axis
  bool arrive_together = false;
  Duration predicted_arrival_error{};             ///< between the first and the last predicted arrival
  std::optional<Duration> start_skew{};           ///< between the first and the last start frame
  std::optional<Duration> arrival_error{};        ///< between the first and the last arrival seen
  std::optional<GroupPreparation> preparation{};  ///< of one that starts when told
};

/// The names of these groups.
[[nodiscard]] std::vector<std::string> names_of(const std::vector<GroupSettings>& groups);

/// An error of one member as one of the whole move: its text begins with the member's name.
[[nodiscard]] Error named(Error error, std::string_view axis);

/// What is to be stopped: groups by name, axes, or both.
struct GroupStopRequest {
  std::string group;
  std::vector<std::string> axes;
  StopKind kind = StopKind::stop;  ///< halt or stop
  bool hold = false;
  std::string request_id{};  ///< by which it is held; may be empty
  CallOriginPtr origin{};    ///< nullptr: not known
};

/// What is to be released: groups by name, axes, or both.
struct GroupReleaseRequest {
  std::string group;
  std::vector<std::string> axes;
  HoldRelease release;  ///< the same of each
};

/// When a prepared move is to start.
struct GroupStartRequest {
  std::string id;
  std::string client;  ///< who prepared it
  TimePoint at;        ///< the moment of its first start frame
};

/// Whoever coordinates a move that was told to start still does.
enum class GroupRenewal : std::uint8_t {
  waits,     ///< whether its other machines were told, too, is not known yet
  all_told,  ///< they were: it may start
};

/// What became of one axis (or of a name that there is not) of a release.
struct GroupReleaseResult {
  std::string axis;
  Result<std::vector<StopHold>> holds;  ///< who still holds it; errors: as of Machine::release_stop()
};

/// What became of one axis (or of a name that there is not) of a stop.
struct GroupStopResult {
  std::string axis;
  Result<Command> command;
};

/// Part of Machine. Thread: any; callbacks arrive on the core thread, exactly once.
class GroupAccess {
 public:
  virtual ~GroupAccess() = default;
  /// Those of the configuration.
  [[nodiscard]] virtual std::vector<GroupSettings> groups() const = 0;
  /// Calls back with an error if nothing was accepted, else when all members have come as far as `until`, or
  /// the move has ended; one that starts when told: when it is prepared, or has ended. Errors: unknown_axis
  /// (also for groups), invalid_argument, out_of_range (the arrival error), and those of each axis.
  virtual void move(GroupMoveRequest request, CommandOptions options, WaitUntil until,
                    std::function<void(Result<GroupMove>)> callback) = 0;
  /// Starts a prepared move at its moment, if a renewal says by then that all were told. Calls back as
  /// move(). From then on it has to be renewed. A repeat
  /// with the same moment attaches. Errors: unknown_command; access_denied (another client's); busy (it is
  /// not prepared yet); expired (the moment has passed, or is too near); out_of_range (it is later than the
  /// preparation lasts); request_id_conflict (another moment); what ended it before it was told.
  virtual void start(GroupStartRequest request, WaitUntil until,
                     std::function<void(Result<GroupMove>)> callback) = 0;
  /// Whoever coordinates a prepared move still does. Errors: unknown_command, access_denied.
  virtual void renew(std::string id, std::string client, GroupRenewal renewal,
                     std::function<void(Result<GroupMove>)> callback) = 0;
  /// A known group move. Errors: unknown_command.
  virtual void get(std::string id, std::function<void(Result<GroupMove>)> callback) = 0;
  /// Stops what is known, and says what is not.
  virtual void stop(GroupStopRequest request, std::string client, WaitUntil until,
                    std::function<void(std::vector<GroupStopResult>)> callback) = 0;
  /// Of what is known; says what is not.
  virtual void release_stop(GroupReleaseRequest request,
                            std::function<void(std::vector<GroupReleaseResult>)> callback) = 0;
};

}  // namespace axisd
