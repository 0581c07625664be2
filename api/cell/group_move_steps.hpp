// What is told of a move of several machines while it comes along. Pure.
#pragma once

#include <string>
#include <vector>

#include "api/cell/group_move_machine.hpp"
#include "axisd/cell/v1/cell_service.pb.h"

namespace axisd::cell {

/// Which steps of a move are new:
///
///   prepared, started, done     each where it comes so far
///   failed                      it does not go on; the last one where this entrance has started nothing
///   halted, unknown             after failed: how it ended
///
/// A move that was done before this entrance was asked has none. Thread: core.
class GroupMoveSteps {
 public:
  /// Since the last call, in order. To be called whenever the move may have come further.
  [[nodiscard]] std::vector<v1::GroupMoveStep> look(const GroupMoveMachine& move);

 private:
  void look_at_end(const GroupMoveMachine& move, std::vector<v1::GroupMoveStep>& steps);

  bool prepared_ = false, attached_ = false, started_ = false, failed_ = false, ended_ = false;
};

/// For those who read events.
[[nodiscard]] v1::CellEvent event_of(v1::GroupMoveStep step, const v1::CellGroupMove& move,
                                     const std::string& client, const std::string& request_id);

}  // namespace axisd::cell
