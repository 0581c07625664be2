#include "devices/axis/command_buffer.hpp"

#include <algorithm>
#include <iterator>

namespace axisd {

Buffered CommandBuffer::take_next() {
  auto next = std::move(waiting_.front());
  waiting_.pop_front();
  starting_ = next.command;
  return next;
}

std::deque<Buffered> CommandBuffer::cut(const CommandPtr& command) {
  const auto found = std::ranges::find(waiting_, command, &Buffered::command);
  std::deque<Buffered> leaving(std::make_move_iterator(found), std::make_move_iterator(waiting_.end()));
  waiting_.erase(found, waiting_.end());
  return leaving;
}

CommandBuffer::State CommandBuffer::state() const {
  if (starting_) return State::starting;
  return waiting_.empty() ? State::empty : State::waiting;
}

}  // namespace axisd
