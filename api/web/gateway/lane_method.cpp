#include "api/web/gateway/lane_method.hpp"

#include <algorithm>
#include <array>
#include <utility>

#include "axisd/v1/axis_service.pb.h"
#include "axisd/v1/group_service.pb.h"

namespace axisd::web {
namespace {

struct Known {
  LaneMethod method;
  LaneKind kind;
  std::string_view path;
};
constexpr std::array<Known, 18> methods{{
    {LaneMethod::halt, LaneKind::stop, "/axisd.v1.AxisService/Halt"},
    {LaneMethod::stop, LaneKind::stop, "/axisd.v1.AxisService/Stop"},
    {LaneMethod::quick_stop, LaneKind::stop, "/axisd.v1.AxisService/QuickStop"},
    {LaneMethod::group_halt, LaneKind::stop, "/axisd.v1.GroupService/GroupHalt"},
    {LaneMethod::group_stop, LaneKind::stop, "/axisd.v1.GroupService/GroupStop"},
    {LaneMethod::stop_all, LaneKind::stop, "/axisd.v1.SystemService/StopAll"},
    {LaneMethod::jog, LaneKind::jog, "/axisd.v1.AxisService/Jog"},
    {LaneMethod::renew_lease, LaneKind::renewal, "/axisd.v1.LeaseService/RenewLease"},
    {LaneMethod::enable, LaneKind::start, "/axisd.v1.AxisService/Enable"},
    {LaneMethod::home, LaneKind::start, "/axisd.v1.AxisService/Home"},
    {LaneMethod::move_absolute, LaneKind::start, "/axisd.v1.AxisService/MoveAbsolute"},
    {LaneMethod::move_relative, LaneKind::start, "/axisd.v1.AxisService/MoveRelative"},
    {LaneMethod::move_velocity, LaneKind::start, "/axisd.v1.AxisService/MoveVelocity"},
    {LaneMethod::move_group, LaneKind::start, "/axisd.v1.GroupService/MoveGroup"},
    {LaneMethod::reset, LaneKind::start, "/axisd.v1.AxisService/Reset"},
    {LaneMethod::set_position, LaneKind::start, "/axisd.v1.AxisService/SetPosition"},
    {LaneMethod::release_stop, LaneKind::release, "/axisd.v1.AxisService/ReleaseStop"},
    {LaneMethod::release_stop_all, LaneKind::release, "/axisd.v1.SystemService/ReleaseStopAll"},
}};

template <typename Request>
std::optional<Request> read(std::string_view message) {
  Request request;
  if (!request.ParseFromArray(message.data(), static_cast<int>(message.size()))) return std::nullopt;
  return request;
}

template <typename Request>
std::string axis_in(std::string_view message) {
  const auto request = read<Request>(message);
  return request ? request->axis() : "";
}

/// What a start says that the lane has to know.
struct Start {
  std::vector<std::string> axes;
  v1::CommandOptions options;
};

template <typename Request>
std::optional<Start> start_in(std::string_view message) {
  const auto request = read<Request>(message);
  if (!request) return std::nullopt;
  Start start{.axes = {}, .options = request->options()};
  if constexpr (std::is_same_v<Request, v1::MoveGroupRequest>)
    for (const auto& target : request->targets()) start.axes.push_back(target.axis());
  else
    start.axes.push_back(request->axis());
  return start;
}

std::optional<Start> start_of(LaneMethod method, std::string_view message) {
  switch (method) {
    case LaneMethod::enable:
      return start_in<v1::EnableRequest>(message);
    case LaneMethod::home:
      return start_in<v1::HomeRequest>(message);
    case LaneMethod::move_absolute:
      return start_in<v1::MoveAbsoluteRequest>(message);
    case LaneMethod::move_relative:
      return start_in<v1::MoveRelativeRequest>(message);
    case LaneMethod::move_velocity:
      return start_in<v1::MoveVelocityRequest>(message);
    case LaneMethod::move_group:
      return start_in<v1::MoveGroupRequest>(message);
    case LaneMethod::reset:
      return start_in<v1::ResetRequest>(message);
    case LaneMethod::set_position:
      return start_in<v1::SetPositionRequest>(message);
    default:
      return std::nullopt;
  }
}

Duration hold_of(const v1::JogRequest& request) {
  if (!request.has_hold()) return usual_hold;
  // What is out of range is refused by the daemon; here it only must not overflow.
  const auto seconds = std::clamp<std::int64_t>(request.hold().seconds(), 0, 2);
  const auto hold = std::chrono::seconds(seconds) +
                    std::chrono::nanoseconds(std::clamp(request.hold().nanos(), 0, 999'999'999));
  return std::min<Duration>(hold, longest_hold);
}

}  // namespace

std::string_view main_path_of(LaneMethod method) {
  return std::ranges::find(methods, method, &Known::method)->path;
}

LaneKind kind_of(LaneMethod method) { return std::ranges::find(methods, method, &Known::method)->kind; }

std::string_view name_of(LaneMethod method) {
  const auto path = main_path_of(method);
  return path.substr(path.rfind('/') + 1);
}

bool is_stop_of_many(LaneMethod method) {
  return method == LaneMethod::stop_all || method == LaneMethod::group_stop ||
         method == LaneMethod::group_halt;
}

bool is_at_stop_lane(LaneMethod method) {
  const auto kind = kind_of(method);
  return kind != LaneKind::start && kind != LaneKind::release;
}

std::optional<LaneMethod> method_of_path(std::string_view path) {
  const auto found = std::ranges::find(methods, path, &Known::path);
  if (found == methods.end()) return std::nullopt;
  return found->method;
}

std::string axis_of_stop(LaneMethod method, std::string_view message) {
  switch (method) {
    case LaneMethod::halt:
      return axis_in<v1::HaltRequest>(message);
    case LaneMethod::stop:
      return axis_in<v1::StopRequest>(message);
    case LaneMethod::quick_stop:
      return axis_in<v1::QuickStopRequest>(message);
    default:
      return {};
  }
}

std::expected<std::vector<std::string>, std::string> axes_of_start(LaneMethod method,
                                                                   std::string_view message) {
  auto start = start_of(method, message);
  if (!start || start->axes.empty() || std::ranges::any_of(start->axes, &std::string::empty))
    return std::unexpected("no start of an axis that can be read");
  if (start->axes.size() > most_members) return std::unexpected("a start on the lane has at most 64 axes");
  if (!start->options.has_not_after())
    return std::unexpected("a start on the lane says until when it is valid: options.not_after");
  if (start->options.wait_until() == v1::WAIT_UNTIL_DONE)
    return std::unexpected("a start on the lane is not waited for until it is done");
  return std::move(start->axes);
}

std::expected<Press, std::string> press_of(std::string_view message) {
  const auto jog = read<v1::JogRequest>(message);
  if (!jog || jog->axis().empty()) return std::unexpected("no JogRequest of an axis");
  if (jog->options().request_id().empty())
    return std::unexpected("a jog on the lane needs a request_id, one for each press");
  if (jog->options().wait_until() == v1::WAIT_UNTIL_DONE)
    return std::unexpected("a jog on the lane is not waited for until it is done");
  return Press{.axis = jog->axis(), .id = jog->options().request_id(), .hold = hold_of(*jog)};
}

}  // namespace axisd::web
