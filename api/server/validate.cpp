#include "api/server/validate.hpp"

#include <fmt/format.h>
#include <google/protobuf/util/field_mask_util.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <utility>

#include "api/server/convert.hpp"
#include "buses/seconds.hpp"
#include "devices/nearest.hpp"

namespace axisd::server {
namespace {

using namespace std::chrono_literals;

constexpr std::size_t longest_axis_name = 64;
constexpr std::size_t longest_id = 128;
constexpr Duration default_validity = 60s;
constexpr Duration default_hold = 300ms;
constexpr Duration longest_hold = 2s;  // M16: these drives have no communication watchdog
constexpr Duration longest_time =
    1h;  // of a ramp; the drives take milliseconds, this only keeps sums in range
constexpr Duration default_period = 100ms, shortest_period = 10ms, longest_period = 60s;
constexpr Duration default_statistics_period = 1s;

std::unexpected<Error> outside(std::string_view field, Duration minimum, Duration maximum) {
  return fail({.reason = Reason::out_of_range,
               .message = fmt::format("{} is out of range", field),
               .remedy = "give a duration in the permitted range",
               .permitted = Range{in_seconds(minimum), in_seconds(maximum), "s"}});
}

// proto3 cannot require a field: an absent number must not be taken for a move to 0.
Result<double> required(bool present, double value, std::string_view field) {
  if (!present)
    return fail(Reason::invalid_argument, fmt::format("{} is missing", field), "set it; 0 is a value too");
  if (!std::isfinite(value))
    return fail(Reason::invalid_argument, fmt::format("{} is not a finite number", field),
                "give a finite number");
  return value;
}

Result<Duration> duration(const google::protobuf::Duration& from, std::string_view field, Duration minimum,
                          Duration maximum) {
  const auto value = from_proto(from);
  if (!value)
    return fail(Reason::invalid_argument, fmt::format("{} is not a valid duration", field),
                "seconds and nanos must have the same sign and |nanos| be below 10^9");
  if (*value < minimum || *value > maximum) return outside(field, minimum, maximum);
  return *value;
}

template <class Request>
Result<void> read_times(const Request& from, MotionValues& to) {
  if (from.has_acceleration_time()) {
    const auto time = duration(from.acceleration_time(), "acceleration_time", 0ns, longest_time);
    if (!time) return fail(time.error());
    to.acceleration_time = *time;
  }
  if (from.has_deceleration_time()) {
    const auto time = duration(from.deceleration_time(), "deceleration_time", 0ns, longest_time);
    if (!time) return fail(time.error());
    to.deceleration_time = *time;
  }
  return {};
}

template <class Request>
Result<MotionValues> profile(const Request& from) {
  MotionValues values;
  if (from.has_velocity()) {
    const auto velocity = required(true, from.velocity(), "velocity");
    if (!velocity) return fail(velocity.error());
    values.velocity = *velocity;
  }
  if (const auto times = read_times(from, values); !times) return fail(times.error());
  return values;
}

}  // namespace

Result<WaitUntil> wait_until(v1::WaitUntil from) {
  switch (from) {
    case v1::WAIT_UNTIL_UNSPECIFIED:
    case v1::WAIT_UNTIL_ACCEPTED:
      return WaitUntil::accepted;
    case v1::WAIT_UNTIL_STARTED:
      return WaitUntil::started;
    case v1::WAIT_UNTIL_DONE:
      return WaitUntil::done;
    default:
      return fail(Reason::invalid_argument, fmt::format("wait_until has the unknown value {}", int{from}),
                  "use ACCEPTED, STARTED or DONE");
  }
}

namespace {

Result<BufferMode> buffer_mode(v1::BufferMode from) {
  switch (from) {
    case v1::BUFFER_MODE_UNSPECIFIED:
    case v1::BUFFER_MODE_ABORTING:
      return BufferMode::aborting;
    case v1::BUFFER_MODE_BUFFERED:
      return BufferMode::buffered;
    default:
      return fail(Reason::invalid_argument,
                  fmt::format("options.buffer_mode has the unknown value {}", int{from}),
                  "use ABORTING or BUFFERED");
  }
}

// Ids appear in the log, so they must not be able to forge lines there.
bool usable_id(std::string_view id) {
  return !id.empty() && id.size() <= longest_id &&
         std::ranges::all_of(id, [](char c) { return c > ' ' && c <= '~'; });
}

// From the client's wall clock to the steady clock that the gate checks: later jumps of the wall clock change
// nothing.
Result<TimePoint> validity(const v1::CommandOptions& from, const Machine& machine) {
  const auto now = machine.now();
  if (!from.has_not_after()) return now + default_validity;
  const auto not_after = from_proto(from.not_after());
  if (!not_after)
    return fail(Reason::invalid_argument, "options.not_after is not a valid time",
                "give a google.protobuf.Timestamp before the year 2200");
  const auto left = std::chrono::duration_cast<Duration>(*not_after - machine.wall(now));
  if (left <= Duration::zero())
    return fail(
        Reason::expired,
        fmt::format("options.not_after passed {:.3f} s before the request arrived", -in_seconds(left)),
        "send a new request; compare the clocks of client and daemon if this was one");
  if (left > longest_validity)
    return fail(
        {.reason = Reason::out_of_range,
         .message = fmt::format("options.not_after is {:.3f} s ahead", in_seconds(left)),
         .remedy = "nothing may be valid for more than 10 minutes; compare the clocks of client and daemon",
         .permitted = Range{0, in_seconds(longest_validity), "s"}});
  return now + left;
}

}  // namespace

Result<void> check_axis_name(std::string_view name) {
  if (name.empty()) return fail(Reason::invalid_argument, "axis is missing", "name the axis; see ListAxes");
  const auto allowed = [](char c) {
    return (c >= 'a' && c <= 'z') || (c >= '0' && c <= '9') || c == '_' || c == '-';
  };
  if (name.size() <= longest_axis_name && name[0] >= 'a' && name[0] <= 'z' &&
      std::ranges::all_of(name, allowed))
    return {};
  return fail(Reason::invalid_argument,
              fmt::format("{:?} is not an axis name", name.substr(0, longest_axis_name)),
              "names are a lower-case letter, then lower-case letters, digits, _ and -; see ListAxes");
}

Result<void> check_command_id(std::string_view id) {
  if (id.empty())
    return fail(Reason::invalid_argument, "id is missing", "give the id of a command, as Command.id");
  if (usable_id(id)) return {};
  return fail(Reason::invalid_argument, "id is not a command id", "give the id as it stands in Command.id");
}

Result<void> check_request_id(std::string_view id, std::string_view field) {
  if (usable_id(id)) return {};
  return fail(Reason::invalid_argument, fmt::format("{} is not usable", field),
              fmt::format("use 1 to {} printable ASCII characters without spaces", longest_id));
}

Result<Submission> motion_options(const v1::CommandOptions& from, std::string client,
                                  const Machine& machine) {
  if (from.request_id().empty())
    return fail(Reason::invalid_argument, "options.request_id is missing",
                "give each motion an id of your own, so that repeating the call cannot repeat the motion");
  if (auto usable = check_request_id(from.request_id(), "options.request_id"); !usable)
    return fail(usable.error());
  const auto until = wait_until(from.wait_until());
  if (!until) return fail(until.error());
  const auto mode = buffer_mode(from.buffer_mode());
  if (!mode) return fail(mode.error());
  const auto not_after = validity(from, machine);
  if (!not_after) return fail(not_after.error());
  return Submission{.options = {.client = std::move(client),
                                .request_id = from.request_id(),
                                .lease_token = from.lease_token(),
                                .not_after = *not_after,
                                .buffer_mode = *mode},
                    .until = *until};
}

namespace {

template <class Request>
Result<Question> question_about(const Request& request, const v1::ExplainRequest& from, std::string client,
                                const Machine& machine) {
  if (!request.axis().empty() && request.axis() != from.axis())
    return fail(
        Reason::invalid_argument,
        fmt::format("the command names another axis, {:?}", request.axis().substr(0, longest_axis_name)),
        "leave the axis of the command out, or name the same");
  auto action = to_action(request);
  if (!action) return fail(action.error());
  if constexpr (std::is_same_v<Request, v1::DisableRequest>) {
    return Question{.action = *std::move(action),
                    .options = stop_options(request.options(), std::move(client)).options};
  } else {
    auto options = request.options();
    if (options.request_id().empty()) options.set_request_id("explain");
    if (options.lease_token() == 0) options.set_lease_token(from.lease_token());
    auto submission = motion_options(options, std::move(client), machine);
    if (!submission) return fail(submission.error());
    return Question{.action = *std::move(action), .options = std::move(submission->options)};
  }
}

}  // namespace

Result<Question> question_of(const v1::ExplainRequest& from, std::string client, const Machine& machine) {
  using Command = v1::ExplainRequest::CommandCase;
  const auto about = [&](const auto& request) {
    return question_about(request, from, std::move(client), machine);
  };
  switch (from.command_case()) {
    case Command::kEnable:
      return about(from.enable());
    case Command::kDisable:
      return about(from.disable());
    case Command::kHome:
      return about(from.home());
    case Command::kMoveAbsolute:
      return about(from.move_absolute());
    case Command::kMoveRelative:
      return about(from.move_relative());
    case Command::kMoveVelocity:
      return about(from.move_velocity());
    case Command::kJog:
      return about(from.jog());
    case Command::kReset:
      return about(from.reset());
    case Command::kSetPosition:
      return about(from.set_position());
    case Command::COMMAND_NOT_SET:
      break;
  }
  return Question{.action = {}, .options = {.client = std::move(client), .lease_token = from.lease_token()}};
}

Submission stop_options(const v1::CommandOptions& from, std::string client) {
  Submission submission{.options = {.client = std::move(client)},
                        .until = wait_until(from.wait_until()).value_or(WaitUntil::accepted)};
  if (usable_id(from.request_id())) submission.options.request_id = from.request_id();
  return submission;
}

WaitUntil stop_all_wait(v1::WaitUntil from) {
  return from == v1::WAIT_UNTIL_DONE ? WaitUntil::done : WaitUntil::accepted;
}

Result<Action> to_action(const v1::EnableRequest&) { return EnableRequest{}; }
Result<Action> to_action(const v1::DisableRequest&) { return DisableRequest{}; }
Result<Action> to_action(const v1::HomeRequest&) { return HomeRequest{}; }
Result<Action> to_action(const v1::ResetRequest&) { return ResetRequest{}; }
Result<Action> to_action(const v1::HaltRequest&) { return StopRequest{.kind = StopKind::halt}; }
Result<Action> to_action(const v1::StopRequest& from) {
  return StopRequest{.kind = StopKind::stop, .hold = from.hold()};
}
Result<Action> to_action(const v1::QuickStopRequest& from) {
  return StopRequest{.kind = StopKind::quick_stop, .hold = from.hold()};
}

Result<Action> to_action(const v1::MoveAbsoluteRequest& from) {
  const auto position = required(from.has_position(), from.position(), "position");
  if (!position) return fail(position.error());
  auto with = profile(from);
  if (!with) return fail(std::move(with).error());
  return MoveAbsoluteRequest{.position = *position, .with = *with};
}

Result<Action> to_action(const v1::MoveRelativeRequest& from) {
  const auto distance = required(from.has_distance(), from.distance(), "distance");
  if (!distance) return fail(distance.error());
  auto with = profile(from);
  if (!with) return fail(std::move(with).error());
  return MoveRelativeRequest{.distance = *distance, .with = *with};
}

Result<Action> to_action(const v1::MoveVelocityRequest& from) {
  const auto velocity = required(from.has_velocity(), from.velocity(), "velocity");
  if (!velocity) return fail(velocity.error());
  MoveVelocityRequest request{.velocity = *velocity};
  if (const auto times = read_times(from, request.with); !times) return fail(times.error());
  if (from.has_hold()) {
    const auto hold = duration(from.hold(), "hold", 1ms, longest_hold);
    if (!hold) return fail(hold.error());
    request.hold = *hold;
  }
  return request;
}

Result<Action> to_action(const v1::JogRequest& from) {
  const auto velocity = required(from.has_velocity(), from.velocity(), "velocity");
  if (!velocity) return fail(velocity.error());
  JogRequest request{.velocity = *velocity, .hold = default_hold};
  if (const auto times = read_times(from, request.with); !times) return fail(times.error());
  if (from.has_hold()) {
    const auto hold = duration(from.hold(), "hold", 1ms, longest_hold);
    if (!hold) return fail(hold.error());
    request.hold = *hold;
  }
  return request;
}

Result<Action> to_action(const v1::SetPositionRequest& from) {
  const auto position = required(from.has_position(), from.position(), "position");
  if (!position) return fail(position.error());
  return SetPositionRequest{.position = *position};
}

Result<Duration> watch_period(const v1::WatchAxesRequest& from) {
  if (!from.has_period()) return default_period;
  return duration(from.period(), "period", shortest_period, longest_period);
}

Result<Duration> watch_period(const v1::WatchBusStatisticsRequest& from) {
  if (!from.has_period()) return default_statistics_period;
  return duration(from.period(), "period", shortest_statistics_period, longest_period);
}

Result<std::vector<std::string>> watched_axes(const v1::WatchAxesRequest& from, const Machine& machine) {
  if (from.axes().empty()) return std::vector<std::string>{};
  auto names = machine.axis_names();
  for (const auto& name : from.axes())
    if (auto found = find_axis(machine, name); !found) return fail(std::move(found).error());
  // One order for all clients, so that streams of the same axes share their batches.
  std::erase_if(names,
                [&](const auto& name) { return std::ranges::find(from.axes(), name) == from.axes().end(); });
  return names;
}

Result<google::protobuf::FieldMask> watched_fields(const v1::WatchAxesRequest& from) {
  using google::protobuf::util::FieldMaskUtil;
  google::protobuf::FieldMask fields;
  if (from.fields().paths().empty()) return fields;
  for (const auto& path : from.fields().paths())
    if (path.empty() || !FieldMaskUtil::IsValidPath<v1::AxisState>(path)) {
      const auto* state = v1::AxisState::descriptor();
      std::vector<std::string> known;
      known.reserve(static_cast<std::size_t>(state->field_count()));
      for (int i = 0; i < state->field_count(); ++i) known.push_back(state->field(i)->name());
      const auto near = did_you_mean(path, known, "");
      return fail(Reason::invalid_argument,
                  fmt::format("fields: AxisState has no field {:?}", path.substr(0, longest_axis_name)),
                  fmt::format("{}{}known are {}", near, near.empty() ? "" : " ", fmt::join(known, ", ")));
    }
  auto named = from.fields();
  named.add_paths("axis");
  // Streams of the same fields share their batches, in whatever order they were named.
  FieldMaskUtil::ToCanonicalForm(named, &fields);
  return fields;
}

Result<AxisSnapshotPtr> find_axis(const Machine& machine, const std::string& name) {
  if (const auto valid = check_axis_name(name); !valid) {
    auto error = valid.error();
    if (!name.empty()) error.remedy = did_you_mean(name, machine.axis_names(), error.remedy);
    return fail(std::move(error));
  }
  if (auto snapshot = machine.snapshot(name)) return snapshot;
  return fail(no_such_axis(name, machine.axis_names()));
}

}  // namespace axisd::server
