// Domain values to protobuf messages and back, one function per type. No decisions are made here.
#pragma once

#include <optional>

#include "axisd/v1/bus_service.pb.h"
#include "axisd/v1/error.pb.h"
#include "axisd/v1/lease_service.pb.h"
#include "axisd/v1/types.pb.h"
#include "devices/machine.hpp"

namespace axisd::server {

[[nodiscard]] v1::Reason to_proto(Reason reason);
[[nodiscard]] v1::Outcome to_proto(Outcome outcome);
[[nodiscard]] v1::State to_proto(AxisState state);
[[nodiscard]] v1::LinkState to_proto(LinkState state);
[[nodiscard]] v1::PositionTrust to_proto(PositionTrust trust);
[[nodiscard]] v1::PositionSource to_proto(PositionSource source);
[[nodiscard]] v1::MotionCause to_proto(MotionCause cause);
[[nodiscard]] v1::CommandKind to_proto(CommandKind kind);
[[nodiscard]] v1::CommandState to_proto(CommandState state);

void to_proto(Duration from, google::protobuf::Duration& to);
void to_proto(WallTime from, google::protobuf::Timestamp& to);
void to_proto(const Error& from, v1::ErrorDetail& to);
void to_proto(const ConfigurationChange& from, v1::ConfigChange& to);
void to_proto(const Conviction& from, v1::StateConviction& to);
void to_proto(const MotionValues& from, v1::MotionValues& to);
void to_proto(const Command& from, v1::Command& to);
/// Those who hold an axis, added to `to`.
void to_proto(const std::vector<StopHold>& from, google::protobuf::RepeatedPtrField<v1::StopHold>& to);
/// What is left of it is counted from Machine::now().
void to_proto(const Lease& from, const Machine& machine, v1::Lease& to);
/// `now` is Machine::now() of this very message: AxisState.age is counted up to it.
void to_proto(const AxisSnapshot& from, TimePoint now, v1::AxisState& to);
/// The times alone, where the rest is as it was: those that `to` has.
void update_times(const AxisSnapshot& from, TimePoint now, v1::AxisState& to);

/// nullopt: not a valid google.protobuf.Duration, or beyond +-100 years.
[[nodiscard]] std::optional<Duration> from_proto(const google::protobuf::Duration& from);
/// nullopt: not a valid google.protobuf.Timestamp, or beyond what a WallTime holds (about the year 2200).
[[nodiscard]] std::optional<WallTime> from_proto(const google::protobuf::Timestamp& from);

}  // namespace axisd::server
