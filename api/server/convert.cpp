#include "api/server/convert.hpp"

#include <algorithm>
#include <chrono>
#include <string>
#include <utility>

namespace axisd::server {
namespace {

using std::chrono::duration_cast;
using std::chrono::nanoseconds;
using std::chrono::seconds;

// The contract reserves 0 for "unspecified", so every enum of ours stands one further there. The unit test
// compares all names, the assertions below only catch a list that grew on one side.
template <class Proto, class Domain>
Proto one_further(Domain value) {
  return static_cast<Proto>(std::to_underlying(value) + 1);
}
static_assert(std::to_underlying(last_reason) + 1 == v1::Reason_MAX);
static_assert(std::to_underlying(Outcome::unknown) + 1 == v1::Outcome_MAX);
static_assert(std::to_underlying(AxisState::error_stop) + 1 == v1::State_MAX);
static_assert(std::to_underlying(LinkState::online) + 1 == v1::LinkState_MAX);
static_assert(std::to_underlying(PositionTrust::restored) + 1 == v1::PositionTrust_MAX);
static_assert(std::to_underlying(PositionSource::encoder) == v1::PositionSource_MAX);
static_assert(std::to_underlying(MotionCause::unknown) + 1 == v1::MotionCause_MAX);
static_assert(std::to_underlying(CommandKind::move_group) + 1 == v1::CommandKind_MAX);
static_assert(std::to_underlying(CommandState::unknown) + 1 == v1::CommandState_MAX);

void to_proto(const TerminalState& from, v1::Terminal& to) {
  to.set_name(from.name);
  to.set_function(from.function);
  to.set_active(from.active);
}

}  // namespace

v1::Reason to_proto(Reason reason) { return one_further<v1::Reason>(reason); }
v1::Outcome to_proto(Outcome outcome) { return one_further<v1::Outcome>(outcome); }
v1::State to_proto(AxisState state) { return one_further<v1::State>(state); }
v1::LinkState to_proto(LinkState state) { return one_further<v1::LinkState>(state); }
v1::PositionTrust to_proto(PositionTrust trust) { return one_further<v1::PositionTrust>(trust); }
v1::PositionSource to_proto(PositionSource source) { return static_cast<v1::PositionSource>(source); }
v1::MotionCause to_proto(MotionCause cause) { return one_further<v1::MotionCause>(cause); }
v1::CommandKind to_proto(CommandKind kind) { return one_further<v1::CommandKind>(kind); }
v1::CommandState to_proto(CommandState state) { return one_further<v1::CommandState>(state); }

void to_proto(Duration from, google::protobuf::Duration& to) {
  const auto whole =
      duration_cast<seconds>(from);  // towards zero: both fields get the same sign, as required
  to.set_seconds(whole.count());
  to.set_nanos(static_cast<std::int32_t>((from - whole).count()));
}

void to_proto(WallTime from, google::protobuf::Timestamp& to) {
  const auto whole = std::chrono::floor<seconds>(from);  // nanos count forward, also before 1970
  to.set_seconds(whole.time_since_epoch().count());
  to.set_nanos(static_cast<std::int32_t>(duration_cast<nanoseconds>(from - whole).count()));
}

void to_proto(const ConfigurationChange& from, v1::ConfigChange& to) {
  to.set_section(from.section);
  to.set_name(from.name);
  to.set_kind(static_cast<v1::ConfigChangeKind>(std::to_underlying(from.kind) + 1));  // 0 is "unspecified"
  for (const auto& key : from.keys) to.add_keys(key);
}
static_assert(std::to_underlying(ConfigurationChangeKind::changed) + 1 == v1::CONFIG_CHANGE_KIND_CHANGED);

void to_proto(const Conviction& from, v1::StateConviction& to) {
  to.set_file(std::string(name_of(from.file)));
  to.set_fault(one_further<v1::StateFault>(from.fault));
  to.set_found(from.found);
  to.set_expected(from.expected);
  to.set_text(to_string(from));
  to_proto(from.since, *to.mutable_since());
}
static_assert(std::to_underlying(KeptFault::foreign) + 1 == v1::StateFault_MAX);

void to_proto(const Error& from, v1::ErrorDetail& to) {
  to.set_reason(to_proto(from.reason));
  to.set_message(from.message);
  to.set_remedy(from.remedy);
  to.set_outcome(to_proto(from.outcome));
  to.set_bus(from.where.bus);
  if (from.where.node) to.set_node(*from.where.node);
  if (from.where.object) to.set_object(*from.where.object);
  if (from.where.native_code) to.set_native_code(*from.where.native_code);
  if (!from.permitted) return;
  to.mutable_permitted()->set_minimum(from.permitted->minimum);
  to.mutable_permitted()->set_maximum(from.permitted->maximum);
  to.mutable_permitted()->set_unit(from.permitted->unit);
}

void to_proto(const MotionValues& from, v1::MotionValues& to) {
  if (from.position) to.set_position(*from.position);
  if (from.distance) to.set_distance(*from.distance);
  if (from.velocity) to.set_velocity(*from.velocity);
  if (from.search_velocity) to.set_search_velocity(*from.search_velocity);
  if (from.acceleration_time) to_proto(*from.acceleration_time, *to.mutable_acceleration_time());
  if (from.deceleration_time) to_proto(*from.deceleration_time, *to.mutable_deceleration_time());
  if (from.hold) to_proto(*from.hold, *to.mutable_hold());
}

void to_proto(const Command& from, v1::Command& to) {
  to.set_id(from.id);
  to.set_axis(from.axis);
  to.set_kind(to_proto(from.kind));
  to.set_state(to_proto(from.state));
  to_proto(from.asked, *to.mutable_asked());
  to_proto(from.granted, *to.mutable_granted());
  if (from.cause) to_proto(*from.cause, *to.mutable_cause());
  to.set_request_id(from.request_id);
  to.set_client(from.client);
  to_proto(from.accepted_at, *to.mutable_accepted_at());
  if (from.started_at) to_proto(*from.started_at, *to.mutable_started_at());
  if (from.ended_at) to_proto(*from.ended_at, *to.mutable_ended_at());
}

void to_proto(const Lease& from, const Machine& machine, v1::Lease& to) {
  to.set_client(from.client);
  to.set_label(from.label);
  for (const auto& axis : from.axes) to.add_axes(axis);
  to_proto(from.ttl, *to.mutable_ttl());
  to_proto(std::max(from.expires - machine.now(), Duration::zero()), *to.mutable_remaining());
  to_proto(machine.wall(from.acquired), *to.mutable_acquired_at());
}

void to_proto(const std::vector<StopHold>& from, google::protobuf::RepeatedPtrField<v1::StopHold>& to) {
  for (const auto& hold : from) {
    auto& entry = *to.Add();
    entry.set_holder(hold.key.holder);
    entry.set_request_id(hold.key.request_id);
    to_proto(hold.since, *entry.mutable_since());
    entry.set_durable(hold.durable);
  }
}

void update_times(const AxisSnapshot& from, TimePoint now, v1::AxisState& to) {
  if (to.has_measured_at()) to_proto(from.sampled.measured_at(), *to.mutable_measured_at());
  if (to.has_age()) to_proto(std::max(now - from.sampled.before(), Duration::zero()), *to.mutable_age());
}

void to_proto(const AxisSnapshot& from, TimePoint now, v1::AxisState& to) {
  to.set_axis(from.name);
  to.set_unit(from.unit);
  to.set_state(to_proto(from.state));
  to.set_link(to_proto(from.link));
  if (from.link_error) to_proto(*from.link_error, *to.mutable_link_error());
  if (from.fault) to_proto(*from.fault, *to.mutable_fault());
  to.set_enabled(from.enabled);
  to.set_enabled_by_daemon(from.enabled_by_us);
  to.set_stop_held(!from.holds.empty());
  to_proto(from.holds, *to.mutable_holds());
  to.set_inhibited(from.inhibited);
  to.set_position(from.position);
  if (from.commanded_position) to.set_commanded_position(*from.commanded_position);
  if (from.following_error) to.set_following_error(*from.following_error);
  to.set_velocity(from.velocity);
  if (from.target) to.set_target(*from.target);
  to.set_moving(from.moving);
  to.set_motion_cause(to_proto(from.motion_cause));
  to.set_positive_direction(from.positive_direction);
  to.set_in_position(from.in_position);
  to.set_homed(from.homed);
  to.set_trust(to_proto(from.trust));
  to.set_position_source(to_proto(from.position_source));
  to.set_alarm_code(from.alarm_code);
  to.set_alarm_name(from.alarm_name);
  for (const auto& terminal : from.inputs) to_proto(terminal, *to.add_inputs());
  for (const auto& terminal : from.outputs) to_proto(terminal, *to.add_outputs());
  // A drive that never answered has no sample: both times stay unset instead of naming 1970 and an absurd
  // age.
  if (from.sampled.known()) {
    to.mutable_measured_at();
    to.mutable_age();
    update_times(from, now, to);
  }
  to.set_simulated(from.simulated);
  to.set_command_id(from.command_id);
  to.set_bus(from.bus);
  to.set_node(from.node);
  to.set_model(from.model);
  if (from.identity) to.set_drive_version(from.identity->version);
  to.set_drive_reboots(static_cast<std::uint32_t>(from.reboots));
  to.set_drift(from.drift);
  to.set_eeprom_writes(from.eeprom_writes);
  to.set_link_note(from.link_note);
  to.set_lease_holder(from.lease_holder);
  if (from.link == LinkState::online) {
    to.set_start_note(from.start_note);
    to.set_starts_by_sync(from.start_note.empty());
  }
  to.set_revision(from.revision);
}

std::optional<Duration> from_proto(const google::protobuf::Duration& from) {
  constexpr std::int64_t longest = std::int64_t{100} * 366 * 24 * 3600;  // far inside 64 bits of nanoseconds
  const auto whole = from.seconds();
  const auto nanos = from.nanos();
  if (whole < -longest || whole > longest || nanos <= -1'000'000'000 || nanos >= 1'000'000'000)
    return std::nullopt;
  if ((whole > 0 && nanos < 0) || (whole < 0 && nanos > 0)) return std::nullopt;
  return seconds(whole) + nanoseconds(nanos);
}

std::optional<WallTime> from_proto(const google::protobuf::Timestamp& from) {
  constexpr std::int64_t latest = 7'258'118'400;  // 2200-01-01; WallTime counts nanoseconds and ends in 2262
  if (from.seconds() < -latest || from.seconds() > latest) return std::nullopt;
  if (from.nanos() < 0 || from.nanos() >= 1'000'000'000) return std::nullopt;
  return WallTime(seconds(from.seconds()) + nanoseconds(from.nanos()));
}

}  // namespace axisd::server
