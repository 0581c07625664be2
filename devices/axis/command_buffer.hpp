// Commands that wait for the one before them (PLCopen BufferMode Buffered).
#pragma once

#include <cstddef>
#include <cstdint>
#include <deque>
#include <utility>

#include "devices/axis/command.hpp"
#include "devices/axis/command_record.hpp"
#include "devices/axis/position_tracker.hpp"

namespace axisd {

/// Accepted to start when what is before it is done.
struct Buffered {
  CommandPtr command;
  Action action;
  CommandOptions options;
  PositionTracker end;  ///< as it will be when this is done
};

/// In the order in which they start. Nothing waits where nothing is executed. The caller ends the commands
/// that leave it otherwise than by their start. Pure. Thread: core.
///
///   empty    -- push() ----------------------------> waiting
///   waiting  -- take_next() -----------------------> starting: it is looked at once more
///   starting -- take_starting(): it is executed ---> waiting, or empty
///   starting -- end_start(): it is refused --------> waiting, or empty
///   waiting  -- take_all(), cut() of the first ----> empty
class CommandBuffer {
 public:
  enum class State : std::uint8_t { empty, waiting, starting };
  /// Commands that may wait at one axis.
  static constexpr std::size_t most = 16;

  void push(Buffered command) { waiting_.push_back(std::move(command)); }
  /// Precondition: not empty().
  Buffered take_next();
  /// The command that is being started; nullptr: none is.
  CommandPtr take_starting() { return std::exchange(starting_, nullptr); }
  /// Nothing is being started any more, whether that was executed or not.
  void end_start() { starting_ = nullptr; }
  std::deque<Buffered> take_all() { return std::exchange(waiting_, {}); }
  /// That command and those behind it; none, if it does not wait here.
  std::deque<Buffered> cut(const CommandPtr& command);

  [[nodiscard]] State state() const;
  [[nodiscard]] bool starts() const { return starting_ != nullptr; }
  [[nodiscard]] bool empty() const { return waiting_.empty(); }
  [[nodiscard]] std::size_t size() const { return waiting_.size(); }
  [[nodiscard]] bool full() const { return waiting_.size() >= most; }
  /// Precondition: not empty().
  [[nodiscard]] const Buffered& last() const { return waiting_.back(); }

 private:
  std::deque<Buffered> waiting_;
  CommandPtr starting_;
};

}  // namespace axisd
