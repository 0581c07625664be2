// The messages of clients, up to what they ask of the machine.
#include <cmath>
#include <string>

#include "api/server/bounds.hpp"
#include "api/server/bus_validate.hpp"
#include "api/server/drive_validate.hpp"
#include "api/server/event_validate.hpp"
#include "api/server/group_convert.hpp"
#include "api/server/hold_validate.hpp"
#include "api/server/reflection_service.hpp"
#include "api/server/validate.hpp"
#include "tests/fuzz/target.hpp"
#include "tests/unit/api/fake_machine.hpp"

namespace axisd::fuzz {
namespace {

testing::FakeMachine& machine() {
  static testing::FakeMachine made;
  return made;
}

template <class Message>
Message parsed(std::span<const std::uint8_t> bytes) {
  Message message;
  (void)message.ParseFromArray(bytes.data(), static_cast<int>(bytes.size()));
  (void)server::check_bounds(message);
  return message;
}

/// A motion of one axis.
template <class Message>
void motion(std::span<const std::uint8_t> bytes) {
  const auto message = parsed<Message>(bytes);
  (void)server::to_action(message);
  const auto options = server::motion_options(message.options(), "fuzz", machine());
  if (options)
    expect(!options->options.request_id.empty() && options->options.request_id.size() <= 128,
           "each motion has an id");
}

template <class Message>
void stop(std::span<const std::uint8_t> bytes) {
  const auto message = parsed<Message>(bytes);
  (void)server::to_action(message);
  (void)server::stop_options(message.options(), "fuzz");
}

void move_absolute(std::span<const std::uint8_t> bytes) {
  motion<v1::MoveAbsoluteRequest>(bytes);
  const auto action = server::to_action(parsed<v1::MoveAbsoluteRequest>(bytes));
  if (action) expect(std::isfinite(std::get<MoveAbsoluteRequest>(*action).position), "a target is a number");
}

void move_relative(std::span<const std::uint8_t> bytes) {
  motion<v1::MoveRelativeRequest>(bytes);
  const auto action = server::to_action(parsed<v1::MoveRelativeRequest>(bytes));
  if (action)
    expect(std::isfinite(std::get<MoveRelativeRequest>(*action).distance), "a distance is a number");
}

void explain(std::span<const std::uint8_t> bytes) {
  (void)server::question_of(parsed<v1::ExplainRequest>(bytes), "fuzz", machine());
}

void move_group(std::span<const std::uint8_t> bytes) {
  (void)server::to_request(parsed<v1::MoveGroupRequest>(bytes));
  (void)server::to_request(parsed<v1::PrepareMoveRequest>(bytes));
  (void)server::to_request(parsed<v1::StartPreparedRequest>(bytes), "anna");
}

void releases(std::span<const std::uint8_t> bytes) {
  (void)server::release_of(parsed<v1::ReleaseStopRequest>(bytes), "fuzz");
  (void)server::release_of(parsed<v1::GroupReleaseStopRequest>(bytes), "fuzz");
}

void watches(std::span<const std::uint8_t> bytes) {
  const auto axes = parsed<v1::WatchAxesRequest>(bytes);
  (void)server::watch_period(axes);
  (void)server::watched_axes(axes, machine());
  (void)server::watched_fields(axes);
  (void)server::watch_period(parsed<v1::WatchBusStatisticsRequest>(bytes));
  (void)server::event_query(parsed<v1::WatchEventsRequest>(bytes), machine());
}

void transact(std::span<const std::uint8_t> bytes) {
  const auto message = parsed<v1::TransactRequest>(bytes);
  if (server::names_object(message))
    (void)server::to_object_request(message);
  else
    (void)server::to_transact(message);
  (void)server::to_scan(parsed<v1::ScanRequest>(bytes));
}

void parameters(std::span<const std::uint8_t> bytes) {
  const auto drive = server::find_drive(machine(), "feeder");
  if (!drive) return;
  (void)server::parameters_to_read(parsed<v1::ReadParametersRequest>(bytes), *drive);
  (void)server::parameters_to_write(parsed<v1::WriteParametersRequest>(bytes), *drive);
  (void)server::serial_change(parsed<v1::ReaddressRequest>(bytes), *drive);
  (void)server::serial_change(parsed<v1::SetSerialRequest>(bytes), *drive);
}

void reflection(std::span<const std::uint8_t> bytes) {
  server::ReflectionMessage question;
  if (!question.ParseFromArray(bytes.data(), static_cast<int>(bytes.size()))) return;
  const auto answer = server::reflect(question, {"axisd.v1.AxisService"});
  expect(answer.GetReflection()->GetUnknownFields(answer).field_count() == 2,
         "there is one answer to one question");
}

constexpr void (*kinds[])(std::span<const std::uint8_t>) = {
    move_absolute,
    move_relative,
    motion<v1::HomeRequest>,
    motion<v1::MoveVelocityRequest>,
    motion<v1::JogRequest>,
    motion<v1::EnableRequest>,
    motion<v1::ResetRequest>,
    motion<v1::SetPositionRequest>,
    stop<v1::StopRequest>,
    stop<v1::HaltRequest>,
    stop<v1::DisableRequest>,
    stop<v1::QuickStopRequest>,
    explain,
    move_group,
    releases,
    watches,
    transact,
    parameters,
    reflection,
};

}  // namespace

void run(Input input) {
  const auto kind = input.byte() % std::size(kinds);
  kinds[kind](input.rest());
}

}  // namespace axisd::fuzz
