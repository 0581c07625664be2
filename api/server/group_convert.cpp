#include "api/server/group_convert.hpp"

#include <fmt/format.h>

#include <utility>

#include "api/server/convert.hpp"
#include "api/server/validate.hpp"

namespace axisd::server {
namespace {

/// The values of a target, checked as those of a single axis's move.
Result<GroupTarget> to_target(const v1::GroupTarget& from) {
  if (auto valid = check_axis_name(from.axis()); !valid) return fail(valid.error());
  GroupTarget target{.axis = from.axis()};
  v1::MoveAbsoluteRequest single;
  if (from.has_velocity()) single.set_velocity(from.velocity());
  if (from.has_acceleration_time()) *single.mutable_acceleration_time() = from.acceleration_time();
  if (from.has_deceleration_time()) *single.mutable_deceleration_time() = from.deceleration_time();
  if (from.has_position()) {
    target.position = from.position();
    single.set_position(from.position());
  } else if (from.has_distance()) {
    target.distance = from.distance();
    single.set_position(from.distance());
  } else {
    return fail(Reason::invalid_argument,
                fmt::format("targets: {} has neither position nor distance", from.axis()),
                "set one of them; 0 is a value too");
  }
  const auto action = to_action(single);
  if (!action) {
    auto error = action.error();
    error.message = fmt::format("targets: {}: {}", from.axis(), error.message);
    return fail(std::move(error));
  }
  target.with = std::get<MoveAbsoluteRequest>(*action).with;
  return target;
}

}  // namespace

Result<GroupMoveRequest> to_request(const v1::MoveGroupRequest& from) {
  GroupMoveRequest request{.group = from.group(), .arrive_together = from.arrive_together()};
  if (!from.group().empty())
    if (auto valid = check_axis_name(from.group()); !valid)
      return fail(Reason::invalid_argument, "group: " + valid.error().message, valid.error().remedy);
  for (const auto& each : from.targets()) {
    auto target = to_target(each);
    if (!target) return fail(target.error());
    request.targets.push_back(*std::move(target));
  }
  if (from.has_max_arrival_error()) {
    request.max_arrival_error = from_proto(from.max_arrival_error());
    if (!request.max_arrival_error || *request.max_arrival_error < Duration{})
      return fail(Reason::invalid_argument, "max_arrival_error is not a valid duration",
                  "give one of 0 or more");
  }
  return request;
}

Result<GroupMoveRequest> to_request(const v1::PrepareMoveRequest& from) {
  if (from.move().options().wait_until() != v1::WAIT_UNTIL_UNSPECIFIED)
    return fail(Reason::invalid_argument, "move.options.wait_until has no meaning here",
                "leave it out: the answer comes when the move is prepared, or has ended");
  auto request = to_request(from.move());
  if (request) request->start = GroupStart::when_told;
  return request;
}

Result<GroupStartRequest> to_request(const v1::StartPreparedRequest& from, std::string client) {
  if (auto valid = check_command_id(from.id()); !valid) return fail(valid.error());
  const auto at = from_proto(from.at());
  if (!from.has_at() || !at || *at <= Duration{})
    return fail(Reason::invalid_argument, "at is no moment",
                "give one of this machine's clock; see PrepareMove");
  return GroupStartRequest{.id = from.id(), .client = std::move(client), .at = TimePoint(*at)};
}

void to_proto(TimePoint from, google::protobuf::Duration& to) { to_proto(from.time_since_epoch(), to); }

Error nothing_named() {
  return {.reason = Reason::invalid_argument,
          .message = "neither a group nor an axis is named",
          .remedy = "name one, or use StopAll"};
}

void to_proto(const GroupSettings& from, v1::Group& to) {
  to.set_name(from.name);
  for (const auto& axis : from.axes) to.add_axes(axis);
  if (from.max_arrival_error) to_proto(*from.max_arrival_error, *to.mutable_max_arrival_error());
}

void to_proto(const GroupPreparation& from, v1::Preparation& to) {
  if (from.expires) to_proto(*from.expires, *to.mutable_expires());
  to_proto(from.notice, *to.mutable_notice());
  to_proto(from.predicted_skew, *to.mutable_predicted_start_skew());
  if (from.starts_at) to_proto(*from.starts_at, *to.mutable_starts_at());
  if (from.first_start) to_proto(*from.first_start, *to.mutable_first_start());
}

void to_proto_without_members(const GroupMove& from, v1::GroupMove& to) {
  to.set_id(from.id);
  to.set_group(from.group);
  to.set_state(to_proto(from.state));
  if (from.cause) to_proto(*from.cause, *to.mutable_cause());
  to.set_arrive_together(from.arrive_together);
  to_proto(from.predicted_arrival_error, *to.mutable_predicted_arrival_error());
  if (from.start_skew) to_proto(*from.start_skew, *to.mutable_start_skew());
  if (from.arrival_error) to_proto(*from.arrival_error, *to.mutable_arrival_error());
  if (from.preparation) to_proto(*from.preparation, *to.mutable_preparation());
}

void to_proto(const GroupMove& from, v1::GroupMove& to) {
  to_proto_without_members(from, to);
  for (const auto& member : from.members) {
    auto& entry = *to.add_members();
    to_proto(member.command, *entry.mutable_command());
    to_proto(member.predicted, *entry.mutable_predicted_duration());
    entry.set_by_sync(member.by_sync);
    entry.set_start_note(member.note);
    if (member.started_after) to_proto(*member.started_after, *entry.mutable_started_after());
    if (member.arrived_after) to_proto(*member.arrived_after, *entry.mutable_arrived_after());
  }
}

void to_proto(const GroupStopResult& from, v1::GroupStopResult& to) {
  to.set_name(from.axis);
  if (from.command)
    to_proto(*from.command, *to.mutable_command());
  else
    to_proto(from.command.error(), *to.mutable_error());
}

void to_proto(const GroupReleaseResult& from, v1::GroupReleaseStopResult& to) {
  to.set_name(from.axis);
  if (from.holds)
    to_proto(*from.holds, *to.mutable_holds());
  else
    to_proto(from.holds.error(), *to.mutable_error());
}

}  // namespace axisd::server
