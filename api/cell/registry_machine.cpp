#include "api/cell/registry_machine.hpp"

#include <fmt/format.h>
#include <google/protobuf/util/message_differencer.h>

#include <algorithm>
#include <utility>

namespace axisd::cell {
namespace {

bool same(const kept::Registration& a, const kept::Registration& b) {
  return google::protobuf::util::MessageDifferencer::Equals(a, b);
}

}  // namespace

RegistryMachine::RegistryMachine(std::string name, std::size_t endpoints, Times times)
    : name_(std::move(name)), endpoints_(endpoints), times_(times) {}

void RegistryMachine::enter(State state, TimePoint until) {
  if (std::exchange(state_, state) != state) ++revision_;
  until_ = until;
  renewing_ = false;
}

void RegistryMachine::tell(std::string trouble) {
  if (trouble == trouble_) return;
  trouble_ = std::move(trouble);
  ++revision_;
}

RegistryMachine::Effects RegistryMachine::start(TimePoint now) {
  tell("etcd has not answered yet");
  return look(now);
}

RegistryMachine::Effects RegistryMachine::look(TimePoint now) {
  enter(State::looking, now + times_.answer);
  ask_progress_ = TimePoint::max();
  return {Look{.endpoint = endpoint_}};
}

RegistryMachine::Effects RegistryMachine::grant(TimePoint now) {
  if (!own_) {
    enter(State::listening, TimePoint::max());
    tell("axisd has not said yet which machine this is");
    return {};
  }
  // Whoever takes the key away at once, again and again, is not answered as often.
  if (now < not_before_) {
    enter(State::refused, not_before_);
    return {};
  }
  not_before_ = now + times_.again;
  enter(State::granting, now + times_.answer);
  return {Grant{}};
}

RegistryMachine::Effects RegistryMachine::write(TimePoint now) {
  enter(State::writing, now + times_.answer);
  return {Write{.lease = lease_, .value = *own_}};
}

RegistryMachine::Effects RegistryMachine::time(TimePoint now) {
  if (watches() && heard_ && now - *heard_ >= times_.answer) return lost(now, "etcd says nothing any more");
  Effects effects;
  if (now >= ask_progress_) {
    ask_progress_ = now + times_.progress;
    effects.push_back(AskProgress{});
  }
  if (now < until_) return effects;
  const auto add = [&](Effects more) { effects.insert(effects.end(), more.begin(), more.end()); };
  switch (state_) {
    case State::resting:
      add(look(now));
      break;
    case State::refused:
      add(grant(now));
      break;
    case State::registered:
      if (renewing_) return lost(now, "etcd does not renew the lease");
      renewing_ = true;
      until_ = now + times_.answer;
      effects.push_back(KeepAlive{.lease = lease_});
      break;
    case State::looking:
    case State::granting:
    case State::writing:
      return lost(now, "etcd does not answer");
    case State::listening:
    case State::ended:
      break;
  }
  return effects;
}

RegistryMachine::Effects RegistryMachine::offer(TimePoint now, const kept::Registration& own) {
  if (own_ && same(*own_, own)) return {};
  own_ = own;
  if (state_ == State::listening) return grant(now);
  if (state_ == State::registered || state_ == State::writing) return write(now);
  return {};
}

RegistryMachine::Effects RegistryMachine::listed(TimePoint now, Machines machines) {
  if (state_ != State::looking) return {};
  machines_ = std::move(machines);
  ++revision_;
  heard_ = now;
  ask_progress_ = now + times_.progress;
  not_before_ = std::min(not_before_, now);
  return grant(now);
}

RegistryMachine::Effects RegistryMachine::changed(TimePoint now, const std::string& name,
                                                  std::optional<kept::Registration> registration) {
  if (!watches()) return {};
  heard_ = now;
  ++revision_;
  if (registration) {
    machines_.insert_or_assign(name, *std::move(registration));
    return {};
  }
  machines_.erase(name);
  return name == name_ ? on_own_key_gone(now) : Effects();
}

RegistryMachine::Effects RegistryMachine::on_own_key_gone(TimePoint now) {
  if (state_ == State::registered) tell("the registration is gone");
  return state_ == State::registered || state_ == State::refused ? grant(now) : Effects();
}

void RegistryMachine::heard(TimePoint now) {
  if (watches()) heard_ = now;
}

RegistryMachine::Effects RegistryMachine::granted(TimePoint now, std::int64_t lease) {
  if (state_ != State::granting) return {};
  lease_ = lease;
  return write(now);
}

RegistryMachine::Effects RegistryMachine::written(TimePoint now) {
  if (state_ != State::writing) return {};
  holder_.reset();
  tell({});
  enter(State::registered, now + times_.keep_alive);
  return {};
}

RegistryMachine::Effects RegistryMachine::held(TimePoint now, const kept::Registration& holder) {
  if (state_ != State::writing) return {};
  holder_ = holder;
  tell(fmt::format("{} is registered by another computer ({}, its axisd at {})", name_, holder.machine_id(),
                   holder.axisd_address()));
  enter(State::refused, now + times_.refused);
  return {};
}

RegistryMachine::Effects RegistryMachine::kept_alive(TimePoint now, bool alive) {
  if (state_ != State::registered) return {};
  if (alive) {
    enter(State::registered, now + times_.keep_alive);
    return {};
  }
  tell("etcd has taken the lease away");
  return grant(now);
}

RegistryMachine::Effects RegistryMachine::lost(TimePoint now, std::string why) {
  if (state_ == State::resting || state_ == State::ended) return {};
  endpoint_ = (endpoint_ + 1) % endpoints_;
  holder_.reset();  // whether it still has the name is not known
  tell(std::move(why));
  enter(State::resting, now + times_.pause);
  ask_progress_ = TimePoint::max();
  return {Leave{}};
}

void RegistryMachine::end() {
  enter(State::ended, TimePoint::max());
  ask_progress_ = TimePoint::max();
}

TimePoint RegistryMachine::due() const {
  auto due = std::min(until_, ask_progress_);
  if (watches() && heard_) due = std::min(due, *heard_ + times_.answer);
  return due;
}

}  // namespace axisd::cell
