// The stop lane of a daemon, as its clients see it.
#pragma once

#include <grpcpp/channel.h>

#include <chrono>
#include <memory>
#include <string>

#include "axisd/v1/stop_service.grpc.pb.h"

namespace axisd::axisctl {

/// The method of StopService for a request; nullptr: it takes none of that kind.
template <class Request>
inline constexpr auto on_stop_lane = nullptr;
template <>
inline constexpr auto on_stop_lane<v1::HaltRequest> = &v1::StopService::Stub::Halt;
template <>
inline constexpr auto on_stop_lane<v1::StopRequest> = &v1::StopService::Stub::Stop;
template <>
inline constexpr auto on_stop_lane<v1::QuickStopRequest> = &v1::StopService::Stub::QuickStop;
template <>
inline constexpr auto on_stop_lane<v1::DisableRequest> = &v1::StopService::Stub::Disable;
template <>
inline constexpr auto on_stop_lane<v1::JogRequest> = &v1::StopService::Stub::Jog;
template <>
inline constexpr auto on_stop_lane<v1::GroupHaltRequest> = &v1::StopService::Stub::GroupHalt;
template <>
inline constexpr auto on_stop_lane<v1::GroupStopRequest> = &v1::StopService::Stub::GroupStop;
template <>
inline constexpr auto on_stop_lane<v1::StopAllRequest> = &v1::StopService::Stub::StopAll;
template <>
inline constexpr auto on_stop_lane<v1::RenewLeaseRequest> = &v1::StopService::Stub::RenewLease;
template <>
inline constexpr auto on_stop_lane<v1::RenewPreparedRequest> = &v1::StopService::Stub::RenewPrepared;
template <>
inline constexpr auto on_stop_lane<v1::CancelCommandRequest> = &v1::StopService::Stub::CancelCommand;

/// Where a daemon takes stops, unless its configuration says otherwise (stop_service.proto); empty: `server`
/// is no address with a port.
[[nodiscard]] std::string stop_lane_of(const std::string& server);

/// Connects, for so long at most; false at once where nobody listens.
[[nodiscard]] bool is_reachable(grpc::Channel& lane, std::chrono::milliseconds patience);

/// May be asked for twice when the first one may have been lost. Disable may not: it lets go of the load.
template <class Request>
inline constexpr bool may_be_repeated = true;
template <>
inline constexpr bool may_be_repeated<v1::DisableRequest> = false;

/// The call was not taken there, or may have been lost and may be repeated: the main address is asked for the
/// same. Whoever has that port may be something else altogether: only an answer of axisd's counts.
[[nodiscard]] bool is_for_the_main_address(const grpc::Status& status, bool repeatable);

}  // namespace axisd::axisctl
