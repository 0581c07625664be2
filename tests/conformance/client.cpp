#include "tests/conformance/client.hpp"

#include <fmt/format.h>

#include <atomic>
#include <chrono>

namespace axisd::conformance {

namespace {

/// Real time: far beyond what any call of virtual time needs on a loaded computer.
constexpr auto patience = std::chrono::seconds(60);

std::string next_id() {
  static std::atomic<int> last{0};
  return fmt::format("conformance-{}", ++last);
}

template <class Request>
void set_profile(const Motion& with, Request& request) {
  if (with.velocity) request.set_velocity(*with.velocity);
  if (with.buffered) request.mutable_options()->set_buffer_mode(v1::BUFFER_MODE_BUFFERED);
  if (with.acceleration_time) to_proto(*with.acceleration_time, *request.mutable_acceleration_time());
  if (with.deceleration_time) to_proto(*with.deceleration_time, *request.mutable_deceleration_time());
}

}  // namespace

void to_proto(Duration from, google::protobuf::Duration& to) {
  to.set_seconds(from.count() / 1'000'000'000);
  to.set_nanos(static_cast<std::int32_t>(from.count() % 1'000'000'000));
}

double seconds_of(const google::protobuf::Duration& from) {
  return static_cast<double>(from.seconds()) + (from.nanos() / 1e9);
}

Duration from_proto(const google::protobuf::Timestamp& from) {
  return std::chrono::seconds(from.seconds()) + std::chrono::nanoseconds(from.nanos());
}

std::string describe(const v1::Command& command) {
  auto text = v1::CommandState_Name(command.state()).substr(std::string("COMMAND_STATE_").size());
  if (command.has_cause())
    text += fmt::format(" ({}: {}; {})", v1::Reason_Name(command.cause().reason()), command.cause().message(),
                        command.cause().remedy());
  return text;
}

void Client::set_deadline(grpc::ClientContext& context) {
  context.set_deadline(std::chrono::system_clock::now() + patience);
}

v1::ErrorDetail Client::detail_of(const grpc::Status& status) {
  v1::ErrorDetail detail;
  v1::StatusDetails details;
  if (!status.ok() && details.ParseFromString(status.error_details()) && details.details_size() == 1)
    detail.ParseFromString(details.details(0).value());
  return detail;
}

template <class Request>
Request Client::request(v1::WaitUntil wait) {
  Request request;
  request.set_axis(axis_);
  request.mutable_options()->set_request_id(next_id());
  request.mutable_options()->set_wait_until(wait);
  return request;
}

template <class Stub, class Request, class Response>
Answer<v1::Command> Client::command(grpc::Status (Stub::*method)(grpc::ClientContext*, const Request&,
                                                                 Response*),
                                    const Request& request) {
  auto answer = call(method, request);
  return {.status = answer.status, .response = answer.response.command(), .error = answer.error};
}

v1::AxisState Client::state() {
  v1::GetAxisRequest request;
  request.set_axis(axis_);
  return call(&v1::AxisService::Stub::GetAxis, request)->state();
}

Answer<v1::Command> Client::enable() {
  return command(&v1::AxisService::Stub::Enable, request<v1::EnableRequest>(v1::WAIT_UNTIL_DONE));
}
Answer<v1::Command> Client::disable() {
  return command(&v1::AxisService::Stub::Disable, request<v1::DisableRequest>(v1::WAIT_UNTIL_DONE));
}
Answer<v1::Command> Client::home(v1::WaitUntil wait) {
  return command(&v1::AxisService::Stub::Home, request<v1::HomeRequest>(wait));
}
Answer<v1::Command> Client::move_to(double position, Motion with, v1::WaitUntil wait) {
  auto move = request<v1::MoveAbsoluteRequest>(wait);
  move.set_position(position);
  set_profile(with, move);
  return command(&v1::AxisService::Stub::MoveAbsolute, move);
}
Answer<v1::Command> Client::move_by(double distance, Motion with, v1::WaitUntil wait) {
  auto move = request<v1::MoveRelativeRequest>(wait);
  move.set_distance(distance);
  set_profile(with, move);
  return command(&v1::AxisService::Stub::MoveRelative, move);
}
Answer<v1::Command> Client::velocity(double velocity, Motion with, v1::WaitUntil wait) {
  auto move = request<v1::MoveVelocityRequest>(wait);
  with.velocity = velocity;
  set_profile(with, move);
  if (with.hold) to_proto(*with.hold, *move.mutable_hold());
  return command(&v1::AxisService::Stub::MoveVelocity, move);
}
Answer<v1::Command> Client::jog(double velocity, Motion with, v1::WaitUntil wait) {
  auto move = request<v1::JogRequest>(wait);
  with.velocity = velocity;
  set_profile(with, move);
  if (with.hold) to_proto(*with.hold, *move.mutable_hold());
  return command(&v1::AxisService::Stub::Jog, move);
}
Answer<v1::Command> Client::halt(v1::WaitUntil wait) {
  return command(&v1::AxisService::Stub::Halt, request<v1::HaltRequest>(wait));
}
Answer<v1::Command> Client::stop(bool hold, v1::WaitUntil wait) {
  auto stop = request<v1::StopRequest>(wait);
  stop.set_hold(hold);
  return command(&v1::AxisService::Stub::Stop, stop);
}
Answer<v1::Command> Client::quick_stop(bool hold, v1::WaitUntil wait) {
  auto stop = request<v1::QuickStopRequest>(wait);
  stop.set_hold(hold);
  return command(&v1::AxisService::Stub::QuickStop, stop);
}
Answer<v1::Command> Client::release_stop() {
  v1::ReleaseStopRequest release;
  release.set_axis(axis_);
  release.set_mine(true);
  return command(&v1::AxisService::Stub::ReleaseStop, release);
}
Answer<v1::Command> Client::reset() {
  return command(&v1::AxisService::Stub::Reset, request<v1::ResetRequest>(v1::WAIT_UNTIL_DONE));
}
Answer<v1::Command> Client::set_position(double position) {
  auto set = request<v1::SetPositionRequest>(v1::WAIT_UNTIL_DONE);
  set.set_position(position);
  return command(&v1::AxisService::Stub::SetPosition, set);
}
v1::Command Client::look_up(const v1::Command& known) {
  v1::GetCommandRequest get;
  get.set_id(known.id());
  return call(&v1::CommandService::Stub::GetCommand, get)->command();
}

}  // namespace axisd::conformance
