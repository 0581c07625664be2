#include "api/cell/group_move_steps.hpp"

#include <fmt/format.h>

#include <utility>

#include "api/cell/roster.hpp"
#include "config/text.hpp"

namespace axisd::cell {
namespace {

using State = GroupMoveMachine::State;

constexpr int most_named = 4;

/// Now, and not at an earlier call.
bool is_new(bool& before, bool now) { return now && !std::exchange(before, true); }

std::string milliseconds(const google::protobuf::Duration& time) {
  return fmt::format("{:.3f} ms", std::chrono::duration<double, std::milli>(duration_of(time)).count());
}

std::string names_of(const v1::GroupMoveEvent& event) {
  std::string names;
  for (int i = 0; i < event.machines_size() && i < most_named; ++i)
    names += (i == 0 ? "" : ", ") + event.machines(i);
  if (event.machines_size() > most_named)
    names += fmt::format(" and {} more", event.machines_size() - most_named);
  return names;
}

std::string words_of(const v1::GroupMoveEvent& event) {
  switch (event.step()) {
    case v1::GROUP_MOVE_STEP_PREPARED:
      return "prepared";
    case v1::GROUP_MOVE_STEP_STARTED:
      if (!event.has_start_skew()) return "started";
      return fmt::format("started, skew {}, off by {} at most", milliseconds(event.start_skew()),
                         milliseconds(event.start_skew_error()));
    case v1::GROUP_MOVE_STEP_DONE:
      return "done";
    case v1::GROUP_MOVE_STEP_FAILED:
      return fmt::format("failed: {}", config::printable(event.cause().message(), 256));
    case v1::GROUP_MOVE_STEP_HALTED:
      return "halted";
    default:
      return "a machine does not say what became of its part; look at it";
  }
}

}  // namespace

std::vector<v1::GroupMoveStep> GroupMoveSteps::look(const GroupMoveMachine& move) {
  std::vector<v1::GroupMoveStep> steps;
  const auto state = move.state();
  const bool goes_on = state == State::measuring || state == State::telling || state == State::running;
  if (is_new(prepared_, goes_on)) steps.push_back(v1::GROUP_MOVE_STEP_PREPARED);
  attached_ = attached_ || state == State::attached;
  const bool runs = state == State::running || state == State::attached;
  if (is_new(started_, runs && move.reached(axisd::v1::WAIT_UNTIL_STARTED)))
    steps.push_back(v1::GROUP_MOVE_STEP_STARTED);
  if (is_new(failed_, state == State::giving_up)) steps.push_back(v1::GROUP_MOVE_STEP_FAILED);
  if (is_new(ended_, state == State::over)) look_at_end(move, steps);
  return steps;
}

void GroupMoveSteps::look_at_end(const GroupMoveMachine& move, std::vector<v1::GroupMoveStep>& steps) {
  const auto state = move.value().state();
  if (state == axisd::v1::COMMAND_STATE_DONE) {
    if (!prepared_ && !attached_) return;
    if (is_new(started_, true)) steps.push_back(v1::GROUP_MOVE_STEP_STARTED);
    steps.push_back(v1::GROUP_MOVE_STEP_DONE);
    return;
  }
  if (is_new(failed_, true)) steps.push_back(v1::GROUP_MOVE_STEP_FAILED);
  if (!move.refusal().ok()) return;
  steps.push_back(state == axisd::v1::COMMAND_STATE_UNKNOWN ? v1::GROUP_MOVE_STEP_UNKNOWN
                                                            : v1::GROUP_MOVE_STEP_HALTED);
}

v1::CellEvent event_of(v1::GroupMoveStep step, const v1::CellGroupMove& move, const std::string& client,
                       const std::string& request_id) {
  v1::CellEvent event;
  event.set_kind(v1::CELL_EVENT_KIND_GROUP_MOVE);
  auto& told = *event.mutable_group_move();
  told.set_step(step);
  told.set_request_id(request_id);
  told.set_client(client);
  for (const auto& part : move.machines()) told.add_machines(part.machine());
  const bool good = step == v1::GROUP_MOVE_STEP_STARTED || step == v1::GROUP_MOVE_STEP_DONE;
  if (good && move.has_start_skew()) {
    *told.mutable_start_skew() = move.start_skew();
    *told.mutable_start_skew_error() = move.start_skew_error();
  }
  if (!good && move.has_cause()) *told.mutable_cause() = move.cause();
  event.set_text(
      fmt::format("move of {} by {}: {}", names_of(told), config::printable(client), words_of(told)));
  return event;
}

}  // namespace axisd::cell
