// Everything of the server that needs no connection: names, values, statuses, checks, admission, identity.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cctype>
#include <limits>
#include <string>
#include <utility>
#include <vector>

#include "api/server/admission.hpp"
#include "api/server/convert.hpp"
#include "api/server/peer.hpp"
#include "api/server/status.hpp"
#include "api/server/validate.hpp"
#include "tests/unit/api/fake_machine.hpp"

namespace axisd::server {
namespace {

using namespace std::chrono_literals;
using ::testing::ElementsAre;
using testing::FakeMachine;
using ::testing::HasSubstr;

/// Letters only, so that move_absolute, MOVE_ABSOLUTE and MoveAbsolute are one name.
std::string folded(std::string_view text) {
  std::string result;
  for (const unsigned char c : text)
    if (c != '_') result += static_cast<char>(std::toupper(c));
  return result;
}

template <class Domain>
void expect_same_names(Domain last, const std::string& prefix, auto name_of) {
  for (int i = 0; i <= int{std::to_underlying(last)}; ++i) {
    const auto value = static_cast<Domain>(i);
    EXPECT_EQ(folded(name_of(to_proto(value))), folded(prefix) + folded(to_string(value)));
  }
}

TEST(Convert, EveryEnumValueHasItsNamesakeInTheContract) {
  expect_same_names(last_reason, "REASON_", [](auto v) { return v1::Reason_Name(v); });
  expect_same_names(AxisState::error_stop, "STATE_", [](auto v) { return v1::State_Name(v); });
  expect_same_names(LinkState::online, "LINK_STATE_", [](auto v) { return v1::LinkState_Name(v); });
  expect_same_names(PositionTrust::restored, "POSITION_TRUST_",
                    [](auto v) { return v1::PositionTrust_Name(v); });
  expect_same_names(CommandKind::set_position, "COMMAND_KIND_",
                    [](auto v) { return v1::CommandKind_Name(v); });
  expect_same_names(CommandState::unknown, "COMMAND_STATE_", [](auto v) { return v1::CommandState_Name(v); });
  expect_same_names(MotionCause::unknown, "MOTION_CAUSE_", [](auto v) { return v1::MotionCause_Name(v); });
  EXPECT_EQ(to_proto(Outcome::not_sent), v1::OUTCOME_NOT_SENT);
  EXPECT_EQ(to_proto(Outcome::refused), v1::OUTCOME_REFUSED);
  EXPECT_EQ(to_proto(Outcome::not_executed), v1::OUTCOME_NOT_EXECUTED);
  EXPECT_EQ(to_proto(Outcome::unknown), v1::OUTCOME_UNKNOWN);
  EXPECT_EQ(to_proto(PositionSource::unspecified), v1::POSITION_SOURCE_UNSPECIFIED);
  EXPECT_EQ(to_proto(PositionSource::commanded), v1::POSITION_SOURCE_COMMANDED);
  EXPECT_EQ(to_proto(PositionSource::encoder), v1::POSITION_SOURCE_ENCODER);
}

TEST(Convert, SnapshotKeepsEveryValue) {
  AxisSnapshot snapshot{.name = "feeder", .bus = "line-a", .node = 3, .model = "ykd2405pr", .unit = "mm"};
  snapshot.simulated = snapshot.enabled = snapshot.enabled_by_us = snapshot.inhibited = true;
  snapshot.holds = {{.key = {.holder = "hmi", .request_id = "r-1"}, .since = WallTime(5s), .durable = true}};
  snapshot.state = AxisState::error_stop;
  snapshot.link = LinkState::online;
  snapshot.link_error = Error{.reason = Reason::offline};
  snapshot.fault = Error{.reason = Reason::alarm};
  snapshot.position = 1.5;
  snapshot.commanded_position = 1.75;
  snapshot.following_error = 0.25;
  snapshot.velocity = -2;
  snapshot.target = 0;
  snapshot.moving = snapshot.in_position = snapshot.homed = true;
  snapshot.trust = PositionTrust::homed;
  snapshot.position_source = PositionSource::commanded;
  snapshot.alarm_code = 2;
  snapshot.alarm_name = "overvoltage";
  snapshot.inputs = {{"X0", "home", true}};
  snapshot.outputs = {{"Y0", "alarm", false}};
  snapshot.identity = DriveIdentity{.model_code = 1, .version = "1.2"};
  snapshot.reboots = 4;
  snapshot.sampled.set(TimePoint(9s), TimePoint(10s), WallTime(1s + 500ms));
  snapshot.command_id = "c-9";
  snapshot.revision = 77;
  snapshot.motion_cause = MotionCause::terminal;
  snapshot.drift = "X1 has no function";
  snapshot.eeprom_writes = 5;
  snapshot.link_note = "state by SDO polling";
  snapshot.start_note = "its bus has no common trigger";
  snapshot.lease_holder = "operator (panel 2)";

  v1::AxisState state;
  to_proto(snapshot, TimePoint(10s + 20ms), state);
  // No singular field may be left at its default, so that a field that nobody fills is noticed; but what
  // starts by SYNC has no start_note.
  std::vector<const google::protobuf::FieldDescriptor*> set;
  state.GetReflection()->ListFields(state, &set);
  EXPECT_EQ(static_cast<int>(set.size()), v1::AxisState::descriptor()->field_count() - 1);
  EXPECT_EQ(state.age().nanos(), 20'000'000);
  EXPECT_EQ(state.measured_at().seconds(), 1);
  EXPECT_EQ(state.measured_at().nanos(), 500'000'000);
  EXPECT_EQ(state.fault().reason(), v1::REASON_ALARM);
  EXPECT_TRUE(state.has_target());
  ASSERT_EQ(state.holds_size(), 1);
  EXPECT_EQ(state.holds(0).holder(), "hmi");
  EXPECT_EQ(state.holds(0).request_id(), "r-1");
  EXPECT_EQ(state.holds(0).since().seconds(), 5);
  EXPECT_TRUE(state.holds(0).durable());
  EXPECT_EQ(state.commanded_position(), 1.75);
  EXPECT_EQ(state.following_error(), 0.25);
  EXPECT_EQ(state.motion_cause(), v1::MOTION_CAUSE_TERMINAL);
}

TEST(Convert, HowItStartsInAGroupIsSaidOfADriveThatIsOnlineOnly) {
  AxisSnapshot snapshot{.name = "feeder", .link = LinkState::online, .start_note = "not proven yet"};
  v1::AxisState unproven, proven, offline;
  to_proto(snapshot, TimePoint(10s), unproven);
  EXPECT_EQ(unproven.start_note(), "not proven yet");
  EXPECT_FALSE(unproven.starts_by_sync());
  snapshot.start_note.clear();
  to_proto(snapshot, TimePoint(10s), proven);
  EXPECT_EQ(proven.start_note(), "");
  EXPECT_TRUE(proven.starts_by_sync());
  snapshot.link = LinkState::offline;
  to_proto(snapshot, TimePoint(10s), offline);
  EXPECT_FALSE(offline.starts_by_sync());
}

TEST(Convert, AxisThatNeverAnsweredHasNoAge) {
  v1::AxisState state;
  to_proto(AxisSnapshot{.name = "feeder"}, TimePoint(10s), state);
  EXPECT_FALSE(state.has_age());
  EXPECT_FALSE(state.has_measured_at());
  EXPECT_FALSE(state.has_target());
}

TEST(Convert, CommandKeepsEveryValue) {
  Command command{
      .id = "c-1", .axis = "feeder", .request_id = "r", .client = "hmi", .kind = CommandKind::jog};
  command.asked = {.position = 1,
                   .distance = 2,
                   .velocity = 3,
                   .search_velocity = 4,
                   .acceleration_time = 5ms,
                   .deceleration_time = 6ms,
                   .hold = 7ms};
  command.granted = command.asked;
  command.state = CommandState::error;
  command.cause = Error{.reason = Reason::alarm,
                        .message = "m",
                        .remedy = "r",
                        .where = {.bus = "line-a", .node = 3, .object = 0x27, .native_code = 7},
                        .permitted = Range{1, 2, "mm"}};
  command.started_at = command.ended_at = WallTime(3s);
  v1::Command result;
  to_proto(command, result);
  for (const google::protobuf::Message* message :
       std::initializer_list<const google::protobuf::Message*>{&result, &result.granted(), &result.cause()}) {
    std::vector<const google::protobuf::FieldDescriptor*> set;
    message->GetReflection()->ListFields(*message, &set);
    EXPECT_EQ(static_cast<int>(set.size()), message->GetDescriptor()->field_count())
        << message->GetTypeName();
  }
  EXPECT_EQ(result.asked().hold().nanos(), 7'000'000);
}

TEST(Convert, RefusesMalformedTimes) {
  google::protobuf::Duration duration;
  duration.set_seconds(1);
  duration.set_nanos(-1);
  EXPECT_FALSE(from_proto(duration));
  duration.set_nanos(1'000'000'000);
  EXPECT_FALSE(from_proto(duration));
  duration.set_nanos(0);
  duration.set_seconds(std::numeric_limits<std::int64_t>::max());
  EXPECT_FALSE(from_proto(duration));
  google::protobuf::Timestamp timestamp;
  timestamp.set_nanos(-1);
  EXPECT_FALSE(from_proto(timestamp));
  timestamp.set_nanos(0);
  timestamp.set_seconds(std::numeric_limits<std::int64_t>::min());
  EXPECT_FALSE(from_proto(timestamp));
  to_proto(-1500ms, duration);
  EXPECT_EQ(from_proto(duration), -1500ms);
  to_proto(WallTime(-1500ms), timestamp);
  EXPECT_EQ(timestamp.nanos(), 500'000'000);
  EXPECT_EQ(from_proto(timestamp), WallTime(-1500ms));
}

TEST(Status, EveryReasonHasACodeAndKeepsItsDetails) {
  for (int i = 0; i <= int{std::to_underlying(last_reason)}; ++i) {
    const auto reason = static_cast<Reason>(i);
    const auto status =
        to_status({.reason = reason, .message = "what", .remedy = "do", .where = {.bus = "line-a"}});
    EXPECT_FALSE(status.ok());
    EXPECT_NE(status.error_code(), grpc::StatusCode::UNKNOWN);
    EXPECT_EQ(status.error_code() == grpc::StatusCode::INTERNAL, reason == Reason::internal);
    v1::StatusDetails details;
    ASSERT_TRUE(details.ParseFromString(status.error_details()));
    EXPECT_EQ(details.code(), status.error_code());
    ASSERT_EQ(details.details_size(), 1);
    EXPECT_EQ(details.details(0).type_url(), "type.googleapis.com/axisd.v1.ErrorDetail");
    v1::ErrorDetail detail;
    ASSERT_TRUE(detail.ParseFromString(details.details(0).value()));
    EXPECT_EQ(detail.reason(), to_proto(reason));
    EXPECT_EQ(detail.bus(), "line-a");
    EXPECT_EQ(detail.remedy(), "do");
  }
}

TEST(Status, CodesAreThoseOfTheContract) {
  EXPECT_EQ(status_code(Reason::invalid_argument), grpc::StatusCode::INVALID_ARGUMENT);
  EXPECT_EQ(status_code(Reason::soft_limit), grpc::StatusCode::OUT_OF_RANGE);
  EXPECT_EQ(status_code(Reason::unknown_axis), grpc::StatusCode::NOT_FOUND);
  EXPECT_EQ(status_code(Reason::not_supported), grpc::StatusCode::UNIMPLEMENTED);
  EXPECT_EQ(status_code(Reason::no_reply), grpc::StatusCode::UNAVAILABLE);
  EXPECT_EQ(status_code(Reason::inhibited), grpc::StatusCode::FAILED_PRECONDITION);
  EXPECT_EQ(status_code(Reason::state_unaccepted), grpc::StatusCode::FAILED_PRECONDITION);
  EXPECT_EQ(status_code(Reason::superseded), grpc::StatusCode::ABORTED);
  EXPECT_EQ(status_code(Reason::expired), grpc::StatusCode::DEADLINE_EXCEEDED);
  EXPECT_EQ(status_code(Reason::lease_required), grpc::StatusCode::PERMISSION_DENIED);
  EXPECT_EQ(status_code(Reason::access_denied), grpc::StatusCode::PERMISSION_DENIED);
  EXPECT_EQ(status_code(Reason::request_id_conflict), grpc::StatusCode::ALREADY_EXISTS);
  EXPECT_EQ(status_code(Reason::busy), grpc::StatusCode::RESOURCE_EXHAUSTED);
  EXPECT_EQ(status_code(Reason::cancelled), grpc::StatusCode::CANCELLED);
}

TEST(Status, LongTextsFitIntoTrailers) {
  const std::string umlauts = [] {
    std::string text = "x";
    for (int i = 0; i < 5000; ++i) text += "\xC3\xA4";
    return text;
  }();
  const auto status = to_status({.reason = Reason::internal, .message = umlauts, .remedy = umlauts});
  EXPECT_LT(3 * status.error_message().size() + status.error_details().size(), 6000U);
  v1::StatusDetails details;
  ASSERT_TRUE(details.ParseFromString(status.error_details()));  // proto3 refuses a cut UTF-8 character
}

TEST(Validate, AxisNames) {
  for (const auto* good : {"a", "feeder", "x-1_b"}) EXPECT_TRUE(check_axis_name(good)) << good;
  for (const std::string& bad : {std::string(), std::string("Feeder"), std::string("1a"), std::string("a/b"),
                                 std::string("a\nb"), std::string(65, 'a')}) {
    const auto result = check_axis_name(bad);
    ASSERT_FALSE(result) << bad;
    EXPECT_EQ(result.error().reason, Reason::invalid_argument);
    EXPECT_THAT(result.error().message, ::testing::Not(HasSubstr("\n")));
  }
}

TEST(Validate, MotionNeedsARequestId) {
  FakeMachine machine;
  v1::CommandOptions options;
  const auto missing = motion_options(options, "hmi", machine);
  ASSERT_FALSE(missing);
  EXPECT_THAT(missing.error().message, HasSubstr("request_id"));
  for (const auto& bad : {std::string("two words"), std::string("line\n"), std::string(129, 'a')}) {
    options.set_request_id(bad);
    EXPECT_FALSE(motion_options(options, "hmi", machine)) << bad;
  }
  options.set_request_id("r-1");
  options.set_lease_token(5);
  const auto fine = motion_options(options, "hmi", machine);
  ASSERT_TRUE(fine);
  EXPECT_EQ(fine->options.client, "hmi");
  EXPECT_EQ(fine->options.request_id, "r-1");
  EXPECT_EQ(fine->options.lease_token, 5U);
  EXPECT_EQ(fine->options.not_after, machine.now() + 60s);
  EXPECT_EQ(fine->until, WaitUntil::accepted);
}

TEST(Validate, ValidityIsBoundedAndBecomesSteadyTime) {
  FakeMachine machine;
  v1::CommandOptions options;
  options.set_request_id("r");
  const auto reason_at = [&](Duration ahead) -> std::optional<Reason> {
    to_proto(machine.wall(machine.now()) + std::chrono::duration_cast<WallTime::duration>(ahead),
             *options.mutable_not_after());
    const auto result = motion_options(options, "hmi", machine);
    if (!result) return result.error().reason;
    EXPECT_EQ(result->options.not_after, machine.now() + ahead);
    return std::nullopt;
  };
  EXPECT_EQ(reason_at(2s), std::nullopt);
  EXPECT_EQ(reason_at(10min), std::nullopt);
  EXPECT_EQ(reason_at(10min + 1ns), Reason::out_of_range);
  EXPECT_EQ(reason_at(0s), Reason::expired);
  EXPECT_EQ(reason_at(-1h), Reason::expired);
  options.mutable_not_after()->set_nanos(-1);
  EXPECT_EQ(motion_options(options, "hmi", machine).error().reason, Reason::invalid_argument);
}

TEST(Validate, UnknownEnumValuesAreRefusedForMotionButNeverForStops) {
  FakeMachine machine;
  v1::CommandOptions options;
  options.set_request_id("r");
  const auto set_unknown = [&options](const char* field) {
    options.GetReflection()->SetEnumValue(&options, options.GetDescriptor()->FindFieldByName(field), 77);
  };
  set_unknown("wait_until");
  EXPECT_FALSE(motion_options(options, "hmi", machine));
  EXPECT_EQ(stop_options(options, "hmi").until, WaitUntil::accepted);
  options.set_wait_until(v1::WAIT_UNTIL_DONE);
  EXPECT_EQ(stop_options(options, "hmi").until, WaitUntil::done);
  EXPECT_EQ(motion_options(options, "hmi", machine)->until, WaitUntil::done);
  set_unknown("buffer_mode");
  EXPECT_FALSE(motion_options(options, "hmi", machine));
  options.set_buffer_mode(v1::BUFFER_MODE_BUFFERED);
  EXPECT_EQ(motion_options(options, "hmi", machine)->options.buffer_mode, BufferMode::buffered);
  EXPECT_EQ(stop_options({}, "hmi").options.not_after, TimePoint::max());
}

TEST(Validate, MissingAndNonFiniteNumbersNameTheirField) {
  constexpr auto nan = std::numeric_limits<double>::quiet_NaN();
  constexpr auto infinity = std::numeric_limits<double>::infinity();
  const auto refused = [](const Result<Action>& action, std::string_view field) {
    return !action && action.error().reason == Reason::invalid_argument &&
           action.error().message.starts_with(field);
  };
  v1::MoveAbsoluteRequest absolute;
  EXPECT_TRUE(refused(to_action(absolute), "position"));
  absolute.set_position(nan);
  EXPECT_TRUE(refused(to_action(absolute), "position"));
  absolute.set_position(0);
  EXPECT_TRUE(to_action(absolute));
  absolute.set_velocity(infinity);
  EXPECT_TRUE(refused(to_action(absolute), "velocity"));
  absolute.set_velocity(2);
  absolute.mutable_acceleration_time()->set_seconds(-1);
  EXPECT_EQ(to_action(absolute).error().reason, Reason::out_of_range);
  absolute.mutable_acceleration_time()->set_seconds(1);
  absolute.mutable_deceleration_time()->set_nanos(5'000'000);
  const auto action = std::get<MoveAbsoluteRequest>(*to_action(absolute));
  EXPECT_EQ(action.with.velocity, 2);
  EXPECT_EQ(action.with.acceleration_time, 1s);
  EXPECT_EQ(action.with.deceleration_time, 5ms);

  v1::MoveRelativeRequest relative;
  EXPECT_TRUE(refused(to_action(relative), "distance"));
  v1::SetPositionRequest set_position;
  EXPECT_TRUE(refused(to_action(set_position), "position"));
  v1::MoveVelocityRequest velocity;
  EXPECT_TRUE(refused(to_action(velocity), "velocity"));
  velocity.set_velocity(-infinity);
  EXPECT_TRUE(refused(to_action(velocity), "velocity"));
}

TEST(Validate, HoldHasADefaultAndABound) {
  v1::JogRequest jog;
  EXPECT_FALSE(to_action(jog));
  jog.set_velocity(-3);
  EXPECT_EQ(std::get<JogRequest>(*to_action(jog)).hold, 300ms);
  jog.mutable_hold()->set_seconds(2);
  EXPECT_EQ(std::get<JogRequest>(*to_action(jog)).hold, 2s);
  jog.mutable_hold()->set_nanos(1);
  const auto beyond = to_action(jog);
  ASSERT_FALSE(beyond);
  EXPECT_EQ(beyond.error().reason, Reason::out_of_range);
  EXPECT_EQ(beyond.error().permitted->maximum, 2);
  jog.mutable_hold()->Clear();
  EXPECT_EQ(to_action(jog).error().reason, Reason::out_of_range);

  v1::MoveVelocityRequest velocity;
  velocity.set_velocity(1);
  EXPECT_EQ(std::get<MoveVelocityRequest>(*to_action(velocity)).hold, std::nullopt);
  velocity.mutable_hold()->set_seconds(1);
  EXPECT_EQ(std::get<MoveVelocityRequest>(*to_action(velocity)).hold, Duration(1s));
}

TEST(Validate, WatchedAxesAreInOneOrderAndPeriodIsBounded) {
  FakeMachine machine;
  v1::WatchAxesRequest request;
  EXPECT_THAT(*watched_axes(request, machine), ::testing::IsEmpty()) << "all that there are, whenever it is";
  EXPECT_EQ(watch_period(request), Duration(100ms));
  for (const auto* name : {"turntable", "feeder", "turntable"}) request.add_axes(name);
  EXPECT_THAT(*watched_axes(request, machine), ElementsAre("feeder", "turntable"));
  request.add_axes("nobody");
  EXPECT_EQ(watched_axes(request, machine).error().reason, Reason::unknown_axis);
  request.mutable_period()->set_nanos(9'999'999);
  EXPECT_EQ(watch_period(request).error().reason, Reason::out_of_range);
  request.mutable_period()->set_nanos(10'000'000);
  EXPECT_EQ(watch_period(request), Duration(10ms));
}

TEST(Admission, CountsPerClientAndGivesBack) {
  Admission admission({.calls = 1, .streams = 1});
  auto first = admission.admit("a", Admission::Kind::motion);
  ASSERT_TRUE(first);
  const auto second = admission.admit("a", Admission::Kind::motion);
  ASSERT_FALSE(second);
  EXPECT_EQ(second.error().reason, Reason::busy);
  EXPECT_TRUE(admission.admit("b", Admission::Kind::motion));
  EXPECT_TRUE(admission.admit("a", Admission::Kind::stream));
  auto moved = *std::move(first);
  moved.release();
  moved.release();
  EXPECT_TRUE(admission.admit("a", Admission::Kind::motion));
}

TEST(Peer, IdentityHasNoPort) {
  for (const std::string one : {"ipv4:127.0.0.1:50312", "ipv6:%5B::1%5D:50312", "ipv6:[::1]:50312",
                                "ipv4:127.0.1.1:50312", "ipv6:%5B::ffff:127.0.0.1%5D:50312"})
    EXPECT_EQ(peer_host(one), "localhost") << one << ": the same client, by whichever family it came";
  EXPECT_EQ(peer_host("ipv4:10.0.0.7:50312"), "10.0.0.7");
  EXPECT_EQ(peer_host("ipv6:%5Bfe80::1%5D:50312"), "fe80::1");
  EXPECT_EQ(peer_host("unix:/run/axisd/axisd.sock"), "unix");
  EXPECT_EQ(peer_host("unix:"), "unix");
}

}  // namespace
}  // namespace axisd::server
