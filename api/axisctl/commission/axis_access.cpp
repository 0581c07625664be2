#include "api/axisctl/commission/axis_access.hpp"

#include <fmt/format.h>

#include "api/axisctl/commission/operator.hpp"
#include "api/axisctl/commission/verdict.hpp"
#include "axisd/v1/axis_service.grpc.pb.h"
#include "axisd/v1/bus_service.grpc.pb.h"
#include "axisd/v1/command_service.grpc.pb.h"
#include "axisd/v1/drive_service.grpc.pb.h"
#include "axisd/v1/system_service.grpc.pb.h"

namespace axisd::axisctl::commission {
namespace {

using Axis = v1::AxisService::Stub;
using System = v1::SystemService::Stub;

/// The daemon knows earlier that a standstill cannot be confirmed, on any bus.
constexpr auto longest_stop = std::chrono::minutes(2);

}  // namespace

v1::GetInfoResponse AxisAccess::info() { return client().call(&System::GetInfo, v1::GetInfoRequest(), {}); }

v1::GetConfigResponse AxisAccess::configuration() {
  return client().call(&System::GetConfig, v1::GetConfigRequest(), {});
}

v1::GetDriveResponse AxisAccess::drive() {
  v1::GetDriveRequest request;
  request.set_axis(axis_);
  return client().call(&v1::DriveService::Stub::GetDrive, request, axis_);
}

std::optional<v1::AxisBudget> AxisAccess::budget(const std::string& bus) {
  v1::GetBudgetRequest request;
  request.set_bus(bus);
  const auto response = client().call(&v1::BusService::Stub::GetBudget, request, axis_);
  for (const auto& one : response.budgets())
    for (const auto& axis : one.axes())
      if (axis.axis() == axis_) return axis;
  return std::nullopt;
}

v1::ExplainResponse AxisAccess::explain(v1::ExplainRequest request) {
  request.set_axis(axis_);
  if (lease_) request.set_lease_token(lease_->token());
  return client().call(&System::Explain, request, axis_);
}

v1::ExplainResponse AxisAccess::explain_move(double distance, double velocity) {
  v1::ExplainRequest request;
  request.mutable_move_relative()->set_distance(distance);
  request.mutable_move_relative()->set_velocity(velocity);
  return explain(std::move(request));
}

v1::ExplainResponse AxisAccess::explain_target(double position) {
  v1::ExplainRequest request;
  request.mutable_move_absolute()->set_position(position);
  return explain(std::move(request));
}

VelocityRange AxisAccess::velocities() {
  // No motion has the velocity 0: what is permitted is in the answer.
  const auto response = explain_move(0, 0);
  const auto* range = blocked_by(response, v1::REASON_OUT_OF_RANGE);
  if (range == nullptr || !range->has_permitted())
    throw Failure(ExitCode::refused,
                  fmt::format("{}: the daemon does not say which velocities it permits", axis_));
  return {.minimum = range->permitted().minimum(), .maximum = range->permitted().maximum()};
}

void AxisAccess::acquire_lease(const std::string& label) {
  if (lease_) return;
  lease_ = std::make_unique<HeldLease>(client(), axis_, label);
  ours_ = true;
}

v1::CommandOptions AxisAccess::options() const {
  v1::CommandOptions options;
  options.set_request_id(random_uuid());
  if (lease_) options.set_lease_token(lease_->token());
  options.set_wait_until(v1::WAIT_UNTIL_ACCEPTED);
  return options;
}

template <class Method, class Request>
v1::Command AxisAccess::start(Method method, Request request) {
  request.set_axis(axis_);
  *request.mutable_options() = options();
  const std::lock_guard lock(starting_);
  if (stopped_) throw Ended(true, "interrupted");
  return client().call(method, request, axis_).command();
}

v1::Command AxisAccess::enable() { return start(&Axis::Enable, v1::EnableRequest()); }

v1::Command AxisAccess::move(double distance, double velocity) {
  v1::MoveRelativeRequest request;
  request.set_distance(distance);
  request.set_velocity(velocity);
  return start(&Axis::MoveRelative, std::move(request));
}

v1::Command AxisAccess::home() { return start(&Axis::Home, v1::HomeRequest()); }

v1::Command AxisAccess::disable() {
  v1::DisableRequest request;
  request.set_axis(axis_);
  *request.mutable_options() = options();
  return client().call(&Axis::Disable, request, axis_, Lane::stop).command();
}

v1::Command AxisAccess::stop(bool hold) {
  v1::StopRequest request;
  request.set_axis(axis_);
  request.set_hold(hold);
  *request.mutable_options() = options();
  request.mutable_options()->set_wait_until(v1::WAIT_UNTIL_DONE);
  if (hold) request.mutable_options()->set_request_id(hold_id_);
  holds_ = holds_ || hold;
  return client().call_within(longest_stop, &Axis::Stop, request, axis_, Lane::stop).command();
}

void AxisAccess::release_stop() {
  v1::ReleaseStopRequest request;
  request.set_axis(axis_);
  request.set_request_id(hold_id_);
  client().call(&Axis::ReleaseStop, request, axis_, Lane::stop);
  holds_ = false;
}

void AxisAccess::end_hold() {
  if (holds_) release_stop();
}

v1::Command AxisAccess::command(const std::string& id) {
  v1::GetCommandRequest request;
  request.set_id(id);
  return client().call(&v1::CommandService::Stub::GetCommand, request, axis_).command();
}

void AxisAccess::stop_at_once() noexcept {
  stopped_ = true;
  if (!ours_) return;
  try {
    v1::StopRequest request;
    request.set_axis(axis_);
    client().call(&Axis::Stop, request, axis_, Lane::stop);
    // A start that was on its way meanwhile may have come after the stop; none comes later than this.
    const std::lock_guard lock(starting_);
    client().call(&Axis::Stop, request, axis_, Lane::stop);
  } catch (const std::exception&) {  // NOLINT(bugprone-empty-catch)
    // The end of the program stops it again, and tells what became of that.
  }
}

}  // namespace axisd::axisctl::commission
