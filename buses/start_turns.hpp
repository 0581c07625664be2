#pragma once

#include <cstddef>
#include <cstdint>
#include <list>
#include <memory>

#include "buses/clock.hpp"
#include "buses/signal.hpp"
#include "buses/task.hpp"

namespace axisd {

/// Who may start motion on a bus now. A start is one uninterrupted chain of requests with a time limit (M6):
/// several at once would keep each other from ending. So each has its turn: of those that wait for one, who
/// was announced first. What is no start (stops, readings, canaries) needs none. Thread: core.
class StartTurns {
 private:
  struct Place;
  using PlacePtr = std::shared_ptr<Place>;

 public:
  /// Of one axis's start: it is read, loaded and triggered, and what fails of it is repeated.
  static constexpr Duration longest_start = std::chrono::milliseconds(500);

  /// `usual`: how long a start takes, until some were seen.
  StartTurns(Executor executor, Clock& clock, Duration usual)
      : executor_(std::move(executor)), clock_(&clock), usual_(usual) {}
  StartTurns(const StartTurns&) = delete;

  /// A turn, or a place in the queue for one; given up when this ends. It does not outlive its StartTurns.
  class Turn {
   public:
    Turn() = default;
    ~Turn() { leave(); }
    Turn(Turn&& other) noexcept;
    Turn& operator=(Turn&& other) noexcept;
    /// The next one's turn begins; a take() that still waits returns.
    void leave();
    /// Leaves; and its starts were sent, so that how long they took tells of the next ones.
    void done();
    /// It was announced, and not left.
    explicit operator bool() const { return place_ != nullptr; }

   private:
    friend StartTurns;
    Turn(StartTurns& turns, PlacePtr place) : turns_(&turns), place_(std::move(place)) {}
    StartTurns* turns_ = nullptr;
    PlacePtr place_;
  };

  /// A place for one start, or for those of a group. It keeps nobody waiting before take(): what is announced
  /// may still wait for a disk.
  Turn announce(int starts = 1);
  /// Returns when the turn begins, or was left: the caller knows. After longest_start for each of its starts
  /// it is the next one's, too: what a silent drive holds up is its own start, not those of all others.
  /// Precondition: it was announced.
  Task<> take(const Turn& turn);

  /// How long who asks now would wait for all that were announced, by how long starts took lately.
  [[nodiscard]] Duration expected_wait() const;
  /// Turns that have begun so far.
  [[nodiscard]] std::uint64_t begun() const { return begun_; }
  /// Of the turn under way: 1, or how many of a group; 0: nobody has the turn.
  [[nodiscard]] int starts_of_turn() const;
  /// Those that wait, without the one whose turn it is.
  [[nodiscard]] std::size_t waiting() const;

 private:
  enum class State : std::uint8_t { announced, waiting, has_turn, overstayed, left };

  void leave(const PlacePtr& place);
  void learn(const Place& place);
  void give_to_next();

  Executor executor_;
  Clock* clock_;
  std::list<PlacePtr> places_;  ///< in the order in which they were announced; none has left
  Clock::Timer over_;
  std::uint64_t begun_ = 0;
  Duration usual_;  ///< of a start: a mean of the last that were sent
};

}  // namespace axisd
