#include "buses/start_turns.hpp"

#include <algorithm>
#include <utility>

namespace axisd {

StartTurns::Turn& StartTurns::Turn::operator=(Turn&& other) noexcept {
  if (this == &other) return *this;
  leave();
  turns_ = std::exchange(other.turns_, nullptr);
  place_ = other.place_;
  return *this;
}

void StartTurns::Turn::leave() {
  if (auto* turns = std::exchange(turns_, nullptr)) turns->leave(place_);
}

StartTurns::Turn StartTurns::announce(int starts) {
  return {*this, places_.emplace(places_.end(), executor_, *clock_, starts)};
}

Task<> StartTurns::take(Turn& turn) {
  const auto place = turn.place_;
  place->state = State::waiting;
  give_to_next();
  while (place->state == State::waiting) co_await place->changed.wait();
}

void StartTurns::leave(Places::iterator place) {
  if (place->state == State::has_turn) {
    constexpr int weight = 8;
    const auto took = (clock_->now() - place->since) / place->starts;
    usual_ += (took - usual_) / weight;
    over_.reset();
  }
  places_.erase(place);
  give_to_next();
}

void StartTurns::give_to_next() {
  if (std::ranges::find(places_, State::has_turn, &Place::state) != places_.end()) return;
  const auto next = std::ranges::find(places_, State::waiting, &Place::state);
  if (next == places_.end()) return;
  next->state = State::has_turn;
  next->since = clock_->now();
  over_ = clock_->call_at(next->since + longest_start * next->starts, [this, next] {
    next->state = State::overstayed;
    give_to_next();
  });
  next->changed.notify_all();
}

std::size_t StartTurns::waiting() const {
  return static_cast<std::size_t>(std::ranges::count(places_, State::waiting, &Place::state));
}

Duration StartTurns::expected_wait() const {
  int before = 0;
  for (const auto& place : places_)
    if (place.state != State::overstayed) before += place.starts;
  return usual_ * before;
}

}  // namespace axisd
