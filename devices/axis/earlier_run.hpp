// What the run of the daemon before this one has left open at an axis.
#pragma once

#include <cstdint>
#include <utility>
#include <vector>

#include "buses/clock.hpp"
#include "devices/axis/command_book.hpp"

namespace axisd {

/// Commands of which nobody knows yet what became of them, and whether the position that was saved may be
/// taken over (M20). Pure. Thread: core.
///
/// The commands (State):
///
///   settled -- take_over(), some --------------------------------> open
///   open    -- drop_ended(), the last; take_all() ---------------> settled
///
/// The position:
///
///   saved    -- doubt(): the counter may mean something else ----> doubtful
///   saved, doubtful -- tried(): taken over, or void for good ----> tried
class EarlierRun {
 public:
  enum class State : std::uint8_t { settled, open };
  enum class Position : std::uint8_t { saved, doubtful, tried };

  /// `settle_by`: what cannot be read from the drive by then is not waited for any longer.
  void take_over(std::vector<Unsettled> commands, TimePoint settle_by) {
    commands_ = std::move(commands);
    settle_by_ = settle_by;
  }
  void drop_ended() {
    std::erase_if(commands_, [](const Unsettled& earlier) { return earlier.command->has_ended(); });
  }
  std::vector<Unsettled> take_all() { return std::exchange(commands_, {}); }
  void doubt() {
    if (position_ == Position::saved) position_ = Position::doubtful;
  }
  void tried() { position_ = Position::tried; }

  [[nodiscard]] State state() const { return commands_.empty() ? State::settled : State::open; }
  [[nodiscard]] bool open() const { return state() == State::open; }
  [[nodiscard]] const std::vector<Unsettled>& commands() const { return commands_; }
  [[nodiscard]] bool overdue(TimePoint now) const { return open() && now >= settle_by_; }
  [[nodiscard]] Position position() const { return position_; }

 private:
  std::vector<Unsettled> commands_;
  TimePoint settle_by_{};
  Position position_ = Position::saved;
};

}  // namespace axisd
