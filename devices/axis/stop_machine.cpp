#include "devices/axis/stop_machine.hpp"

#include <algorithm>
#include <utility>

namespace axisd {

void StopMachine::ask(StopKind kind) {
  kind_ = std::max(kind_, kind);
  ++requests_;
}

CommandPtr StopMachine::serve(CommandPtr command) {
  last_ = command;
  auto& served = served_[command->value().client];
  commands_.push_back(std::move(command));
  if (++served <= most_of_one_client) return nullptr;
  --served;
  const auto oldest = std::ranges::find(commands_, last_->value().client,
                                        [](const CommandPtr& each) -> auto& { return each->value().client; });
  auto ends = *oldest;
  commands_.erase(oldest);
  return ends;
}

bool StopMachine::begin() {
  if (state_ != State::none) return false;
  state_ = State::sending;
  silent_ = rounds_ = 0;
  released_ = false;
  return true;
}

StopKind StopMachine::next_attempt() {
  state_ = State::sending;
  attempt_ = {.kind = kind_, .requests = requests_};
  return kind_;
}

StopMachine::Step StopMachine::go_to(State state, Step step) {
  state_ = state;
  return step;
}

StopMachine::Step StopMachine::sent(Answer answer, bool offline) {
  attempt_.answer = answer;
  const bool no_reply = answer == Answer::no_reply;
  if (no_reply && !offline && ++silent_ < attempts) return Step::send;
  silent_ = 0;
  // Replies may be lost where the stop itself is not: what counts is the motor, so it is looked at.
  if (answer == Answer::failed || (no_reply && offline))
    return overtaken() ? Step::send : Step::unreachable;  // each gets a frame, also by a silent node
  return go_to(State::confirming, Step::look);
}

StopMachine::Step StopMachine::looked(RestVerdict found, bool offline, bool may_release) {
  const bool rests = found == RestVerdict::rests;
  if (overtaken() || found == RestVerdict::undecided)
    return go_to(State::sending, Step::send);  // each gets a frame of its own
  if (rests && attempt_.answer == Answer::no_reply && ++rounds_ < unacknowledged_rounds)
    return go_to(State::sending, Step::send);
  if (rests) return Step::rests;
  if (offline) return Step::fell_silent;
  if (attempt_.kind != StopKind::quick_stop) {
    kind_ = StopKind::quick_stop;
    return go_to(State::sending, Step::quicken);
  }
  if (!may_release || released_) return Step::not_confirmed;
  released_ = true;
  return go_to(State::releasing, Step::release);
}

std::vector<CommandPtr> StopMachine::end() {
  state_ = State::none;
  kind_ = StopKind::none;
  of_motion_ = false;
  served_.clear();
  std::vector<CommandPtr> commands(commands_.begin(), commands_.end());
  commands_.clear();
  return commands;
}

std::vector<CommandPtr> StopMachine::confirmed() {
  debt_ = Debt::none;
  return end();
}

std::vector<CommandPtr> StopMachine::failed() {
  owe();
  ++failures_;
  return end();
}

void StopMachine::leave_running() {
  if (debt_ == Debt::none) debt_ = Debt::motion;
  if (debt_ == Debt::stop) debt_ = Debt::stop_of_motion;
}

void StopMachine::owe() {
  if (debt_ == Debt::none) debt_ = Debt::stop;
  if (debt_ == Debt::motion) debt_ = Debt::stop_of_motion;
}

void StopMachine::restarted() {
  if (debt_ == Debt::motion) debt_ = Debt::none;
  if (debt_ == Debt::stop_of_motion) debt_ = Debt::stop;
}

void StopMachine::seen_at_rest() {
  if (state_ == State::none) debt_ = Debt::none;
}

}  // namespace axisd
