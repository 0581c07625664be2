#include "devices/axis/motion_machine.hpp"

#include <algorithm>

namespace axisd {

namespace {

/// Beyond the predicted time: the prediction is exact for the profile, the drive's own latency is unknown.
constexpr Duration overrun_margin = std::chrono::seconds(1);
/// A motion that no sample can tell from noise is over so long after its predicted end, if it began at once.
constexpr Duration unseen_margin = std::chrono::milliseconds(100);
/// A shaft that was seen in its window, and has been beside it at most since, may be there by a later
/// reading.
constexpr Duration longest_wavering = std::chrono::seconds(2);

}  // namespace

TimePoint MotionMachine::latest() const {
  if (motion_.endless) return TimePoint::max();
  return motion_.since + motion_.predicted + motion_.predicted / 4 + overrun_margin;
}

void MotionMachine::go_on() {
  if (state_ == State::arrived) state_ = State::running;
  rests_since_.reset();
  there_since_.reset();
  was_beside_ = false;
}

MotionMachine::State MotionMachine::look(const Reading& reading) {
  if (state_ > State::settling || reading.asked_at < motion_.since) return state_;
  if (state_ == State::starting && (reading.moving || reading.elsewhere)) {
    state_ = State::running;
    rests_since_.reset();  // what rested before it began says nothing of its settling
  }
  // Its motion was acknowledged, and may have begun and ended between two samples.
  const auto unseen_until = motion_.since + std::max(motion_.predicted + unseen_margin, start_window);
  const bool unseen_end = motion_.unseen && !reading.held_back && reading.asked_at >= unseen_until;
  if (state_ == State::starting && unseen_end) state_ = State::running;
  if (!reading.positioning) return state_ = State::taken_over;
  if (reading.moving) {
    if (reading.astray) return state_ = State::astray;
    rests_since_.reset();
    there_since_.reset();
    was_beside_ = false;
    if (state_ == State::settling) state_ = State::running;
  } else {
    state_ = judge_rest(reading);
    if (state_ > State::settling) return state_;
  }
  // Only who was asked after the window and still rests has not started: a silent drive may well run.
  if (state_ == State::starting && reading.asked_at >= motion_.since + start_window)
    return state_ = State::did_not_start;
  // Where it is there in time but for its settling, the next reading tells: on a full line that may take
  // long.
  const bool is_there = reading.at_target && !reading.moving;
  if (reading.asked_at >= latest() && !is_there) state_ = State::took_too_long;
  return state_;
}

MotionMachine::State MotionMachine::judge_rest(const Reading& reading) {
  if (!rests_since_) rests_since_ = reading.asked_at;
  // Before it moved it may rest within the tolerance, too.
  if (state_ == State::starting) {
    was_beside_ = was_beside_ || reading.beside;
    return State::starting;
  }
  if (reading.at_target) {
    if (!there_since_) there_since_ = reading.asked_at;
    const bool seen_unsettled = state_ == State::settling || was_beside_;
    const bool settled = reading.in_position && !seen_unsettled;
    if (settled || reading.asked_at - *there_since_ >= still) return State::arrived;
    rests_since_ = reading.asked_at;
    return State::settling;
  }
  if (!reading.near_target) there_since_.reset();
  const bool wavers = there_since_ && reading.asked_at - *there_since_ < longest_wavering;
  const bool settles = wavers || reading.asked_at - *rests_since_ < motion_.settling;
  return settles && !reading.held_back ? State::settling : State::rests_elsewhere;
}

StartReadback::State StartReadback::look(const std::optional<Reading>& reading, TimePoint now) {
  if (state_ != State::reading || !reading) return state_;
  if (reading->asked_at >= since_ && reading->shows_it) return state_ = State::executed;
  if (now >= deadline() && reading->asked_at >= deadline()) state_ = State::resting;
  return state_;
}

StartReadback::State StartReadback::proven(bool tellable) {
  if (state_ == State::resting) state_ = tellable ? State::not_executed : State::unresolved;
  return state_;
}

}  // namespace axisd
