#include "api/web/gateway/lane_state.hpp"

#include <algorithm>
#include <array>
#include <utility>

#include "axisd/v1/axis_service.pb.h"

namespace axisd::web {
namespace {

struct Known {
  LaneMethod method;
  std::string_view path;
};
constexpr std::array<Known, 8> methods{{
    {LaneMethod::halt, "/axisd.v1.AxisService/Halt"},
    {LaneMethod::stop, "/axisd.v1.AxisService/Stop"},
    {LaneMethod::quick_stop, "/axisd.v1.AxisService/QuickStop"},
    {LaneMethod::jog, "/axisd.v1.AxisService/Jog"},
    {LaneMethod::group_halt, "/axisd.v1.GroupService/GroupHalt"},
    {LaneMethod::group_stop, "/axisd.v1.GroupService/GroupStop"},
    {LaneMethod::stop_all, "/axisd.v1.SystemService/StopAll"},
    {LaneMethod::renew_lease, "/axisd.v1.LeaseService/RenewLease"},
}};

std::optional<LaneMethod> method_of(std::string_view name) {
  const auto found =
      std::ranges::find(methods, name, [](const Known& known) { return known.path.substr(1); });
  if (found == methods.end()) return std::nullopt;
  return found->method;
}

v1::JogRequest jog_of(std::string_view message, bool& readable) {
  v1::JogRequest request;
  readable = request.ParseFromArray(message.data(), static_cast<int>(message.size()));
  return request;
}

Duration hold_of(const v1::JogRequest& request) {
  if (!request.has_hold()) return LaneState::usual_hold;
  // What is out of range is refused by the daemon; here it only must not overflow.
  const auto seconds = std::clamp<std::int64_t>(request.hold().seconds(), 0, 2);
  const auto hold = std::chrono::seconds(seconds) +
                    std::chrono::nanoseconds(std::clamp(request.hold().nanos(), 0, 999'999'999));
  return std::min<Duration>(hold, LaneState::longest_hold);
}

/// The axis that a stop is for; empty: it is not for one, or is not readable, which the daemon tells.
std::string axis_of(LaneMethod method, std::string_view message) {
  const auto read = [&](auto request) {
    return request.ParseFromArray(message.data(), static_cast<int>(message.size())) ? request.axis() : "";
  };
  switch (method) {
    case LaneMethod::halt:
      return read(v1::HaltRequest());
    case LaneMethod::stop:
      return read(v1::StopRequest());
    case LaneMethod::quick_stop:
      return read(v1::QuickStopRequest());
    default:
      return {};
  }
}

/// It is not known whether the daemon has executed the call.
bool is_open(const CallStatus& status) {
  return status.code == code::cancelled || status.code == code::unknown ||
         status.code == code::deadline_exceeded || status.code == code::internal ||
         status.code == code::unavailable || status.code == code::data_loss;
}

/// Nothing of this jog runs, nor will.
bool is_over(const CallStatus& status, std::string_view response) {
  if (status.code != 0) return !is_open(status);
  v1::JogResponse answer;
  if (!answer.ParseFromArray(response.data(), static_cast<int>(response.size()))) return false;
  const auto state = answer.command().state();
  return state == v1::COMMAND_STATE_DONE || state == v1::COMMAND_STATE_ABORTED ||
         state == v1::COMMAND_STATE_ERROR;
}

void refuse(std::uint32_t id, int why, std::string message, LaneEffects& effects) {
  effects.emplace_back(
      LaneSend{lane_reply(LaneReply::refused, id, {.code = why, .message = std::move(message)})});
}

}  // namespace

std::string_view main_path_of(LaneMethod method) {
  return std::ranges::find(methods, method, &Known::method)->path;
}

std::string_view name_of(LaneMethod method) {
  const auto path = main_path_of(method);
  return path.substr(path.rfind('/') + 1);
}

bool is_stop(LaneMethod method) { return method != LaneMethod::jog && method != LaneMethod::renew_lease; }

LaneEffects LaneState::receive(std::string_view bytes, TimePoint now) {
  if (closed_) return {};
  auto effects = pass(now);  // what was silent for too long stays so, however this message reads
  const auto close_for = [&](std::string why) {
    auto halts = close(now);
    effects.insert(effects.end(), std::make_move_iterator(halts.begin()),
                   std::make_move_iterator(halts.end()));
    effects.emplace_back(LaneClose{std::move(why)});
  };
  if (!messages_.take(now)) {
    close_for("too many messages");
    return effects;
  }
  const auto request = parse_lane_request(bytes);
  if (!request) {
    close_for("no message of this version");
    return effects;
  }
  const auto lateness = lateness_.of(request->sent_ms, now);
  if (request->method.empty())
    effects.emplace_back(LaneSend{lane_reply(LaneReply::echo, request->id)});
  else if (const auto method = method_of(request->method))
    carry_out(*request, *method, lateness, now, effects);
  else
    refuse(request->id, code::unimplemented, "the lane takes no such call", effects);
  if (lateness > lost) close_for("messages come far too late");
  return effects;
}

CallStatus LaneState::refusal(LaneMethod method) const {
  if (is_stop(method) ? stops_ < most_stops : moves_ < most_moves) return {};
  return {.code = code::resource_exhausted, .message = "too many calls of this page wait for their answers"};
}

void LaneState::carry_out(const LaneRequest& request, LaneMethod method, Duration lateness, TimePoint now,
                          LaneEffects& effects) {
  if (!is_stop(method) && lateness > latest) {
    effects.emplace_back(LaneSend{lane_reply(LaneReply::late, request.id)});
    return;
  }
  if (auto why = refusal(method); why.code != 0) {
    refuse(request.id, why.code, std::move(why.message), effects);
    return;
  }
  std::string axis;
  if (method == LaneMethod::jog) {
    bool readable = false;
    const auto jog = jog_of(request.message, readable);
    if (!readable || jog.axis().empty()) {
      refuse(request.id, code::invalid_argument, "no JogRequest of an axis", effects);
      return;
    }
    if (jog.options().wait_until() == v1::WAIT_UNTIL_DONE) {
      refuse(request.id, code::invalid_argument, "a jog on the lane is not waited for until it is done",
             effects);
      return;
    }
    axis = jog.axis();
    press(axis, hold_of(jog), now);
  } else if (is_stop(method)) {
    axis = axis_of(method, request.message);
    if (!axis.empty()) let_go(axis);
  }
  call(method, request.id, std::move(axis), std::string(request.message), {}, effects);
}

void LaneState::call(LaneMethod method, std::optional<std::uint32_t> id, std::string axis,
                     std::string message, TimePoint until, LaneEffects& effects) {
  const auto number = ++last_number_;
  calls_.emplace(number, Pending{.method = method, .id = id, .axis = std::move(axis), .until = until});
  if (id) ++(is_stop(method) ? stops_ : moves_);
  effects.emplace_back(LaneCall{.number = number, .method = method, .message = std::move(message)});
}

void LaneState::press(const std::string& name, Duration hold, TimePoint now) {
  owed_.erase(name);  // it would halt what begins now
  auto& axis = axes_[name];
  if (axis.state != Jogging::running) axis.state = Jogging::starting;
  axis.may_run = false;
  ++axis.on_the_way;
  axis.silent_at = now + hold;
}

void LaneState::let_go(const std::string& name) {
  owed_.erase(name);  // this one stops it as well
  const auto axis = axes_.find(name);
  if (axis == axes_.end()) return;
  if (axis->second.on_the_way == 0)
    axes_.erase(axis);
  else
    axis->second.state = Jogging::ending;
}

LaneState::Axes::iterator LaneState::halt(Axes::iterator axis, TimePoint now, LaneEffects& effects) {
  own_halt(axis->first, now + longest_hold, effects);
  if (axis->second.on_the_way == 0) return axes_.erase(axis);
  axis->second.state = Jogging::ending;
  return std::next(axis);
}

void LaneState::own_halt(const std::string& axis, TimePoint until, LaneEffects& effects) {
  v1::HaltRequest request;
  request.set_axis(axis);
  call(LaneMethod::halt, std::nullopt, axis, request.SerializeAsString(), until, effects);
}

LaneEffects LaneState::answered(std::uint64_t number, const CallStatus& status, std::string_view response,
                                TimePoint now) {
  LaneEffects effects;
  auto found = calls_.extract(number);
  if (found.empty()) return effects;
  const auto& ended = found.mapped();
  if (ended.id) {
    --(is_stop(ended.method) ? stops_ : moves_);
    if (!closed_) effects.emplace_back(LaneSend{lane_reply(LaneReply::answer, *ended.id, status, response)});
    if (ended.method == LaneMethod::jog) jog_answered(ended.axis, is_over(status, response), now, effects);
  } else if (is_open(status) && now + pause < ended.until &&
             (jogging(ended.axis) == Jogging::none || jogging(ended.axis) == Jogging::ending)) {
    owed_[ended.axis] = {.at = now + pause, .until = ended.until};
  }
  return effects;
}

void LaneState::jog_answered(const std::string& name, bool over, TimePoint now, LaneEffects& effects) {
  const auto found = axes_.find(name);
  if (found == axes_.end()) return;
  auto& axis = found->second;
  --axis.on_the_way;
  if (axis.state == Jogging::ending) {
    axis.may_run = axis.may_run || !over;
    if (axis.on_the_way > 0) return;
    if (axis.may_run) own_halt(name, now + longest_hold, effects);
    axes_.erase(found);
  } else if (over) {
    if (axis.on_the_way == 0) axes_.erase(found);
  } else {
    axis.state = Jogging::running;
  }
}

LaneEffects LaneState::pass(TimePoint now) {
  LaneEffects effects;
  for (auto axis = axes_.begin(); axis != axes_.end();)
    axis = axis->second.state != Jogging::ending && axis->second.silent_at <= now ? halt(axis, now, effects)
                                                                                  : std::next(axis);
  for (auto owed = owed_.begin(); owed != owed_.end();) {
    if (owed->second.at > now) {
      ++owed;
      continue;
    }
    own_halt(owed->first, owed->second.until, effects);
    owed = owed_.erase(owed);
  }
  return effects;
}

LaneEffects LaneState::close(TimePoint now) {
  LaneEffects effects;
  if (std::exchange(closed_, true)) return effects;
  for (auto axis = axes_.begin(); axis != axes_.end();)
    axis = axis->second.state != Jogging::ending ? halt(axis, now, effects) : std::next(axis);
  return effects;
}

TimePoint LaneState::next_due() const {
  auto due = TimePoint::max();
  for (const auto& [name, axis] : axes_)
    if (axis.state != Jogging::ending) due = std::min(due, axis.silent_at);
  for (const auto& [name, owed] : owed_) due = std::min(due, owed.at);
  return due;
}

Jogging LaneState::jogging(std::string_view axis) const {
  const auto found = axes_.find(axis);
  return found == axes_.end() ? Jogging::none : found->second.state;
}

}  // namespace axisd::web
