#include "api/cell/peer_machine.hpp"

#include <fmt/format.h>

#include <utility>

#include "config/text.hpp"

namespace axisd::cell {

PeerMachine::Effect PeerMachine::time(TimePoint now) {
  if (now < due_) return Effect::none;
  due_ = TimePoint::max();
  return std::exchange(anew_, false) ? Effect::ask_anew : Effect::ask;
}

void PeerMachine::answered(TimePoint now, PeerAnswer answer) {
  if (answer.machine != name_)
    return be_silent(
        now, fmt::format("the address of {} leads to the machine {}", name_, config::quoted(answer.machine)));
  last_ = std::move(answer);
  trouble_.clear();
  state_ = State::answering;
  due_ = now + times_.pause;
}

void PeerMachine::be_silent(TimePoint now, std::string why) {
  state_ = State::silent;
  trouble_ = std::move(why);
  due_ = now + times_.pause;
  anew_ = true;
}

void PeerMachine::late(TimePoint now, std::string why) {
  if (state_ != State::answering) return be_silent(now, std::move(why));
  state_ = State::late;
  due_ = now + times_.again;
}

void PeerMachine::failed(TimePoint now, std::string why) {
  if (state_ != State::answering) return be_silent(now, std::move(why));
  state_ = State::lost;
  due_ = now + times_.again;
  anew_ = true;
}

void PeerMachine::connection_lost(TimePoint now) {
  if (!is_open()) return;
  state_ = State::lost;
  due_ = now;
  anew_ = true;
}

void PeerMachine::moved(TimePoint now) {
  if (is_open()) state_ = State::lost;
  due_ = now;
  anew_ = true;
}

}  // namespace axisd::cell
