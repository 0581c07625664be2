#pragma once

#include <cstddef>
#include <cstdint>
#include <list>
#include <utility>

#include "buses/clock.hpp"
#include "buses/signal.hpp"
#include "buses/task.hpp"

namespace axisd {

/// Who may start motion on a bus now. A start is one uninterrupted chain of requests with a time limit (M6):
/// several at once would keep each other from ending, so each has its turn, in the order in which they asked
/// for it. What is no start (stops, readings, canaries) asks for none. Thread: core.
class StartTurns {
 private:
  enum class State : std::uint8_t { announced, waiting, has_turn, overstayed };
  struct Place {
    Place(const Executor& executor, Clock& clock, int starts) : starts(starts), changed(executor, clock) {}
    int starts;
    State state = State::announced;
    TimePoint since{};  ///< when it got its turn
    Signal changed;
  };
  using Places = std::list<Place>;

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
    Turn(Turn&& other) noexcept : turns_(std::exchange(other.turns_, nullptr)), place_(other.place_) {}
    Turn& operator=(Turn&& other) noexcept;
    /// The next one's turn begins.
    void leave();
    /// It was announced, and not left.
    explicit operator bool() const { return turns_ != nullptr; }

   private:
    friend StartTurns;
    Turn(StartTurns& turns, Places::iterator place) : turns_(&turns), place_(place) {}
    StartTurns* turns_ = nullptr;
    Places::iterator place_{};
  };

  /// A place for one start, or for those of a group. It keeps nobody waiting before take(): what is announced
  /// may still wait for a disk.
  Turn announce(int starts = 1);
  /// Returns when the turn begins. After longest_start for each of its starts it is the next one's, too: what
  /// a silent drive holds up is its own start, not those of all others. Precondition: it was announced, and
  /// stays where it is meanwhile.
  Task<> take(Turn& turn);

  /// How long who asks now would wait for all that were announced, by how long starts took lately.
  [[nodiscard]] Duration expected_wait() const;
  /// Those that wait, without the one whose turn it is.
  [[nodiscard]] std::size_t waiting() const;

 private:
  void leave(Places::iterator place);
  void give_to_next();

  Executor executor_;
  Clock* clock_;
  Places places_;  ///< in the order in which they were announced
  Clock::Timer over_;
  Duration usual_;  ///< of a start: a mean of the last
};

}  // namespace axisd
