#include "buses/start_turns.hpp"

#include <algorithm>
#include <utility>

namespace axisd {

struct StartTurns::Place {
  Place(const Executor& executor, Clock& clock, int starts) : starts(starts), changed(executor, clock) {}
  int starts;
  State state = State::announced;
  TimePoint since{};  ///< when it got its turn
  Signal changed;
};

StartTurns::Turn::Turn(Turn&& other) noexcept : turns_(other.turns_), place_(std::move(other.place_)) {}

StartTurns::Turn& StartTurns::Turn::operator=(Turn&& other) noexcept {
  if (this == &other) return *this;
  leave();
  turns_ = other.turns_;
  place_ = std::move(other.place_);
  return *this;
}

void StartTurns::Turn::leave() {
  if (const auto place = std::exchange(place_, nullptr)) turns_->leave(place);
}

void StartTurns::Turn::done() {
  if (place_) turns_->learn(*place_);
  leave();
}

StartTurns::Turn StartTurns::announce(int starts) {
  return {*this, places_.emplace_back(std::make_shared<Place>(executor_, *clock_, starts))};
}

Task<> StartTurns::take(const Turn& turn) {
  const auto place = turn.place_;  // it may leave meanwhile
  place->state = State::waiting;
  give_to_next();
  while (place->state == State::waiting) co_await place->changed.wait();
}

void StartTurns::leave(const PlacePtr& place) {
  const auto before = std::exchange(place->state, State::left);
  places_.remove(place);
  place->changed.notify_all();
  if (before == State::has_turn) over_.reset();
  give_to_next();
}

void StartTurns::learn(const Place& place) {
  constexpr int weight = 8;
  if (place.state != State::has_turn && place.state != State::overstayed) return;
  usual_ += ((clock_->now() - place.since) / place.starts - usual_) / weight;
}

void StartTurns::give_to_next() {
  const auto first_of = [this](State state) { return std::ranges::find(places_, state, &Place::state); };
  if (first_of(State::has_turn) != places_.end()) return;
  const auto waiting = first_of(State::waiting);
  if (waiting == places_.end()) return;
  const auto& next = *waiting;
  next->state = State::has_turn;
  next->since = clock_->now();
  ++begun_;
  over_ = clock_->call_at(next->since + longest_start * next->starts, [this, overdue = next] {
    overdue->state = State::overstayed;
    give_to_next();
  });
  next->changed.notify_all();
}

int StartTurns::starts_of_turn() const {
  const auto turn = std::ranges::find(places_, State::has_turn, &Place::state);
  return turn == places_.end() ? 0 : (*turn)->starts;
}

std::size_t StartTurns::waiting() const {
  return static_cast<std::size_t>(std::ranges::count(places_, State::waiting, &Place::state));
}

Duration StartTurns::expected_wait() const {
  int before = 0;
  for (const auto& place : places_)
    if (place->state != State::overstayed) before += place->starts;
  return usual_ * before;
}

}  // namespace axisd
