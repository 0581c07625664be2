// Checks of requests, and their translation into actions. Everything that needs the axis (limits, units,
// state) is checked there; here is what makes a request malformed.
#pragma once

#include <optional>
#include <string>
#include <string_view>

#include "axisd/v1/axis_service.pb.h"
#include "axisd/v1/bus_service.pb.h"
#include "axisd/v1/system_service.pb.h"
#include "devices/machine.hpp"

namespace axisd::server {

/// `[a-z][a-z0-9_-]*`, at most 64 characters. Errors: invalid_argument.
[[nodiscard]] Result<void> check_axis_name(std::string_view name);

/// An id as the daemon gives them out: 1 to 128 printable characters. Errors: invalid_argument.
[[nodiscard]] Result<void> check_command_id(std::string_view id);

/// A client's own id of a request: 1 to 128 printable characters without spaces. Errors: invalid_argument,
/// naming `field`.
[[nodiscard]] Result<void> check_request_id(std::string_view id, std::string_view field);

/// UNSPECIFIED is ACCEPTED. Errors: invalid_argument.
[[nodiscard]] Result<WaitUntil> wait_until(v1::WaitUntil from);

/// How a command is to be submitted.
struct Submission {
  CommandOptions options;
  WaitUntil until = WaitUntil::accepted;
};

/// Options of a motion call: request_id is required, not_after is bounded and becomes a steady time.
/// Errors: invalid_argument, out_of_range, expired.
[[nodiscard]] Result<Submission> motion_options(const v1::CommandOptions& from, std::string client,
                                                const Machine& machine);

/// Options of Halt, Stop, QuickStop and Disable. Nothing in them can make a stop fail: validity, buffer mode,
/// lease and an unknown wait_until are ignored (the call then answers at acceptance), and so is an unusable
/// request_id.
[[nodiscard]] Submission stop_options(const v1::CommandOptions& from, std::string client);

/// What Explain is asked about.
struct Question {
  std::optional<Action> action;  ///< nullopt: motion in general
  CommandOptions options;
};
/// As to_action() and motion_options() of the command in it, which needs no request_id and need not repeat
/// the axis.
[[nodiscard]] Result<Question> question_of(const v1::ExplainRequest& from, std::string client,
                                           const Machine& machine);

/// ACCEPTED (also unspecified) or DONE. Anything else counts as ACCEPTED: a StopAll is never refused for it.
[[nodiscard]] WaitUntil stop_all_wait(v1::WaitUntil from);

// Requests to actions. Errors: invalid_argument or out_of_range, naming the field.
[[nodiscard]] Result<Action> to_action(const v1::EnableRequest& from);
[[nodiscard]] Result<Action> to_action(const v1::DisableRequest& from);
[[nodiscard]] Result<Action> to_action(const v1::HomeRequest& from);
[[nodiscard]] Result<Action> to_action(const v1::MoveAbsoluteRequest& from);
[[nodiscard]] Result<Action> to_action(const v1::MoveRelativeRequest& from);
[[nodiscard]] Result<Action> to_action(const v1::MoveVelocityRequest& from);
[[nodiscard]] Result<Action> to_action(const v1::JogRequest& from);
[[nodiscard]] Result<Action> to_action(const v1::HaltRequest& from);
[[nodiscard]] Result<Action> to_action(const v1::StopRequest& from);
[[nodiscard]] Result<Action> to_action(const v1::QuickStopRequest& from);
[[nodiscard]] Result<Action> to_action(const v1::ResetRequest& from);
[[nodiscard]] Result<Action> to_action(const v1::SetPositionRequest& from);

/// Time between the batches of WatchAxes. Errors: out_of_range.
[[nodiscard]] Result<Duration> watch_period(const v1::WatchAxesRequest& from);
/// Time between the messages of WatchBusStatistics. Errors: invalid_argument, out_of_range.
[[nodiscard]] Result<Duration> watch_period(const v1::WatchBusStatisticsRequest& from);
/// The axes to watch, in the machine's order and without repetitions. Errors: invalid_argument, unknown_axis.
[[nodiscard]] Result<std::vector<std::string>> watched_axes(const v1::WatchAxesRequest& from,
                                                            const Machine& machine);
/// What of AxisState is to be sent, in one form for all ways to say it: `axis` and the fields asked for;
/// empty: all. Errors: invalid_argument, naming the field and all that there are.
[[nodiscard]] Result<google::protobuf::FieldMask> watched_fields(const v1::WatchAxesRequest& from);
/// Errors: invalid_argument, unknown_axis.
[[nodiscard]] Result<AxisSnapshotPtr> find_axis(const Machine& machine, const std::string& name);

}  // namespace axisd::server
