#include "api/web/gateway/lane_state.hpp"

#include <algorithm>
#include <utility>

#include "api/web/gateway/big_endian.hpp"
#include "axisd/v1/axis_service.pb.h"

namespace axisd::web {
namespace {

/// It is not known whether the daemon has executed the call. What the daemon itself says has details.
bool is_open(const CallStatus& status) {
  return status.details.empty() && (status.code == code::cancelled || status.code == code::unknown ||
                                    status.code == code::deadline_exceeded || status.code == code::internal ||
                                    status.code == code::unavailable || status.code == code::data_loss);
}

std::string bytes_of(std::uint64_t number) {
  std::string bytes;
  append_big_endian32(bytes, static_cast<std::uint32_t>(number >> 32U));
  append_big_endian32(bytes, static_cast<std::uint32_t>(number));
  return bytes;
}

void refuse(std::uint32_t id, int why, std::string message, LaneEffects& effects) {
  effects.emplace_back(
      LaneSend{lane_reply(LaneReply::refused, id, {.code = why, .message = std::move(message)})});
}

}  // namespace

LaneEffects LaneState::receive(std::string_view bytes, TimePoint now) {
  if (closed_) return {};
  auto effects = pass(now);  // what was silent for too long stays so, however this message reads
  const auto close_for = [&](std::string why) {
    auto halts = close(now);
    effects.insert(effects.end(), std::make_move_iterator(halts.begin()),
                   std::make_move_iterator(halts.end()));
    effects.emplace_back(LaneClose{std::move(why)});
  };
  const auto request = parse_lane_request(bytes);
  const auto method = request ? method_of_path('/' + std::string(request->method)) : std::nullopt;
  if (!messages_.take(now)) {
    if (method && is_stop(*method)) stop(*request, *method, now, effects);
    close_for("too many messages");
    return effects;
  }
  if (!request) {
    close_for("no message of this version");
    return effects;
  }
  const auto lateness = lateness_.of(request->sent_ms, now);
  if (request->method.empty())
    echo(*request, now, effects);
  else if (method)
    carry_out(*request, *method, lateness, now, effects);
  else
    refuse(request->id, code::unimplemented, "the lane takes no such call", effects);
  if (lateness > lost) close_for("messages come far too late");
  return effects;
}

void LaneState::echo(const LaneRequest& request, TimePoint now, LaneEffects& effects) {
  // What brings the number was sent after that had left here: no message is older than that makes it.
  if (!number_.empty() && request.message == number_ && now - echoed_ <= longest_round_trip) measured_ = true;
  number_ = bytes_of(random_());
  echoed_ = now;
  effects.emplace_back(LaneSend{lane_reply(LaneReply::echo, request.id, {}, number_)});
}

void LaneState::carry_out(const LaneRequest& request, LaneMethod method, Duration lateness, TimePoint now,
                          LaneEffects& effects) {
  const auto kind = kind_of(method);
  if (kind == LaneKind::stop) return stop(request, method, now, effects);
  if (kind == LaneKind::jog) return jog(request, lateness, now, effects);
  if (lateness > latest) {
    effects.emplace_back(LaneSend{lane_reply(LaneReply::late, request.id)});
  } else if (auto why = refusal_of_move(); why.code != 0) {
    refuse(request.id, why.code, std::move(why.message), effects);
  } else if (kind == LaneKind::start) {
    start(request, method, effects);
  } else {
    call(method, {.method = method, .id = request.id}, std::string(request.message),
         kind == LaneKind::release ? patience_of_starts : patience_of_moves, effects);
  }
}

void LaneState::start(const LaneRequest& request, LaneMethod method, LaneEffects& effects) {
  auto axes = axes_of_start(method, request.message);
  if (!axes) return refuse(request.id, code::invalid_argument, std::move(axes).error(), effects);
  call(method, {.method = method, .id = request.id, .axes = *std::move(axes)}, std::string(request.message),
       patience_of_starts, effects);
}

void LaneState::overtake(std::string_view axis) {
  for (auto& [number, pending] : calls_) {
    const auto kind = kind_of(pending.method);
    if (kind == LaneKind::start &&
        (axis.empty() || std::ranges::find(pending.axes, axis) != pending.axes.end()))
      pending.overtaken = true;
  }
}

CallStatus LaneState::refusal_of_move() const {
  if (!measured_)
    return {.code = code::failed_precondition,
            .message = "how long this lane takes is not known yet: return the number of an echo"};
  if (moves_ >= most_moves)
    return {.code = code::resource_exhausted,
            .message = "too many calls of this page wait for their answers"};
  return {};
}

void LaneState::jog(const LaneRequest& request, Duration lateness, TimePoint now, LaneEffects& effects) {
  const auto readable = press_of(request.message);
  if (!readable) return refuse(request.id, code::invalid_argument, readable.error(), effects);
  const auto& press = *readable;
  if (lateness > latest) {
    bar_start(press);
    effects.emplace_back(LaneSend{lane_reply(LaneReply::late, request.id)});
    return;
  }
  if (is_barred(press.axis, press.id))
    return refuse(request.id, code::failed_precondition,
                  "this press was refused: let the button go, and press it again", effects);
  if (auto why = refusal_of_move(); why.code != 0) {
    bar_start(press);
    return refuse(request.id, why.code, std::move(why.message), effects);
  }
  begin(press, now);
  call(LaneMethod::jog, {.method = LaneMethod::jog, .id = request.id, .axis = press.axis, .press = press.id},
       std::string(request.message), patience_of_moves, effects);
}

void LaneState::stop(const LaneRequest& request, LaneMethod method, TimePoint now, LaneEffects& effects) {
  auto axis = axis_of_stop(method, request.message);
  if (!axis.empty() || is_stop_of_many(method)) overtake(axis);
  if (method == LaneMethod::stop_all)
    for (auto& [number, pending] : calls_)
      if (pending.method == LaneMethod::release_stop_all) pending.overtaken = true;
  if (stops_ >= most_stops)
    return refuse(request.id, code::resource_exhausted, "too many stops of this page wait for their answers",
                  effects);
  if (!axis.empty()) let_go(axis, now);
  call(method, {.method = method, .id = request.id, .axis = std::move(axis)}, std::string(request.message),
       patience_of_stops, effects);
  // Who stops more than one axis is not jogging any of them, whether or not it is one of those.
  if (is_stop_of_many(method)) halt_all(now, effects);
}

void LaneState::call(LaneMethod method, Pending pending, std::string message, Duration patience,
                     LaneEffects& effects) {
  const auto number = ++last_number_;
  if (pending.id) ++(is_stop(method) ? stops_ : moves_);
  calls_.emplace(number, std::move(pending));
  effects.emplace_back(
      LaneCall{.number = number, .method = method, .message = std::move(message), .patience = patience});
}

void LaneState::begin(const Press& press, TimePoint now) {
  barred_.erase(press.axis);  // of another press
  owed_.erase(press.axis);    // it would halt what begins now
  auto& axis = axes_[press.axis];
  if (axis.state != Jogging::running) axis.state = Jogging::starting;
  axis.may_run = false;
  ++axis.on_the_way;
  axis.silent_at = now + press.hold;
}

void LaneState::let_go(const std::string& name, TimePoint now) {
  barred_.erase(name);
  owed_.erase(name);  // this one stops it as well
  const auto axis = axes_.find(name);
  if (axis == axes_.end()) return;
  if (axis->second.on_the_way > 0) {
    axis->second.state = Jogging::ending;
    return;
  }
  if (axis->second.unknown) owe_another(name, now);
  axes_.erase(axis);
}

LaneState::Axes::iterator LaneState::halt(Axes::iterator axis, TimePoint now, LaneEffects& effects) {
  own_halt(axis->first, now + longest_hold, now, effects);
  if (axis->second.on_the_way > 0) {
    axis->second.state = Jogging::ending;
    return std::next(axis);
  }
  if (axis->second.unknown) owe_another(axis->first, now);
  return axes_.erase(axis);
}

void LaneState::halt_all(TimePoint now, LaneEffects& effects) {
  barred_.clear();
  for (auto axis = axes_.begin(); axis != axes_.end();)
    axis = axis->second.state != Jogging::ending ? halt(axis, now, effects) : std::next(axis);
}

void LaneState::own_halt(const std::string& axis, TimePoint until, TimePoint now, LaneEffects& effects) {
  v1::HaltRequest request;
  request.set_axis(axis);
  call(LaneMethod::halt, {.method = LaneMethod::halt, .axis = axis, .until = until},
       request.SerializeAsString(), until - now, effects);
}

void LaneState::owe_another(const std::string& axis, TimePoint now) {
  owed_[axis] = {.at = now + pause, .until = now + longest_hold};
}

bool LaneState::is_barred(const std::string& axis, std::string_view press) const {
  const auto barred = barred_.find(axis);
  return barred != barred_.end() && barred->second == press;
}

void LaneState::bar(const std::string& axis, const std::string& press) {
  if (barred_.size() >= most_barred && !barred_.contains(axis)) barred_.erase(barred_.begin());
  barred_[axis] = press;
}

void LaneState::bar_start(const Press& press) {
  const auto axis = axes_.find(press.axis);
  if (axis != axes_.end() && axis->second.running == press.id) return;
  const bool on_the_way = std::ranges::any_of(calls_, [&](const auto& call) {
    return call.second.axis == press.axis && call.second.press == press.id;
  });
  if (!on_the_way) bar(press.axis, press.id);
}

LaneState::Outcome LaneState::outcome_of(const CallStatus& status, std::string_view response) {
  if (status.code != 0) return is_open(status) && !status.not_sent ? Outcome::unknown : Outcome::refused;
  v1::JogResponse answer;
  if (!answer.ParseFromArray(response.data(), static_cast<int>(response.size()))) return Outcome::unknown;
  const auto state = answer.command().state();
  const bool over = state == v1::COMMAND_STATE_DONE || state == v1::COMMAND_STATE_ABORTED ||
                    state == v1::COMMAND_STATE_ERROR;
  return over ? Outcome::over : Outcome::runs;
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
    if (ended.method == LaneMethod::jog) jog_answered(ended, outcome_of(status, response), now, effects);
    if (ended.overtaken) overtaken_answered(ended, status, now, effects);
    return effects;
  }
  if (ended.method != LaneMethod::halt) return effects;
  const bool again = is_open(status) || status.code == code::resource_exhausted;
  const auto state = jogging(ended.axis);
  if (again && now + pause < ended.until && (state == Jogging::none || state == Jogging::ending))
    owed_[ended.axis] = {.at = now + pause, .until = ended.until};
  return effects;
}

void LaneState::overtaken_answered(const Pending& ended, const CallStatus& status, TimePoint now,
                                   LaneEffects& effects) {
  const bool open = is_open(status) && !status.not_sent;
  if (status.code != 0 && !open) return;
  if (ended.method == LaneMethod::release_stop_all)
    return call(LaneMethod::stop_all, {.method = LaneMethod::stop_all}, {}, patience_of_stops, effects);
  for (const auto& axis : ended.axes) own_halt(axis, now + longest_hold, now, effects);
  if (!open) return;
  for (const auto& axis : ended.axes) owe_another(axis, now);
}

void LaneState::jog_answered(const Pending& jog, Outcome outcome, TimePoint now, LaneEffects& effects) {
  const auto found = axes_.find(jog.axis);
  if (found == axes_.end()) return;
  auto& axis = found->second;
  --axis.on_the_way;
  axis.unknown = axis.unknown || outcome == Outcome::unknown;
  if (axis.state == Jogging::ending) {
    axis.may_run = axis.may_run || outcome == Outcome::runs;
    if (axis.on_the_way > 0) return;
    if (axis.may_run) own_halt(jog.axis, now + longest_hold, now, effects);
    if (axis.unknown) owe_another(jog.axis, now);
    axes_.erase(found);
    return;
  }
  const bool refused_before = is_barred(jog.axis, jog.press);
  if (outcome == Outcome::unknown || (outcome == Outcome::refused && axis.running != jog.press))
    bar(jog.axis, jog.press);
  if (outcome == Outcome::runs || outcome == Outcome::unknown) {
    axis.state = Jogging::running;
    if (outcome == Outcome::runs) axis.running = jog.press;
    if (refused_before) (void)halt(found, now, effects);
  } else if (axis.on_the_way == 0 && (outcome == Outcome::over || axis.state == Jogging::starting)) {
    axes_.erase(found);
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
    own_halt(owed->first, owed->second.until, now, effects);
    owed = owed_.erase(owed);
  }
  return effects;
}

LaneEffects LaneState::close(TimePoint now) {
  LaneEffects effects;
  if (std::exchange(closed_, true)) return effects;
  halt_all(now, effects);
  overtake({});  // nobody sees any more what becomes of it
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
