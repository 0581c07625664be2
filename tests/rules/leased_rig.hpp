// A rig whose axis is leased.
#pragma once

#include <algorithm>

#include "tests/support/rig.hpp"

namespace axisd::test {

/// A rig whose clients are "a" and "b".
class LeasedRig : public Rig {
 public:
  explicit LeasedRig(LeaseLoss on_loss = LeaseLoss::halt, RigOptions options = {})
      : Rig([&] {
          options.adjust = [on_loss, more = options.adjust](AxisSettings& axis) {
            axis.on_lease_loss = on_loss;
            if (more) more(axis);
          };
          return std::move(options);
        }()) {
    ready();
  }

  std::uint64_t lease(std::string client, bool take = false, Duration ttl = std::chrono::seconds(2)) {
    const auto grant = machine->leases().acquire(
        {.client = std::move(client), .axes = {"feeder"}, .ttl = ttl, .take = take});
    EXPECT_TRUE(grant) << (grant ? "" : to_string(grant.error()));
    return grant ? grant->lease.token : 0;
  }
  void renew(std::string client, std::uint64_t token) {
    EXPECT_TRUE(machine->leases().renew({.client = std::move(client), .lease_token = token}));
  }
  /// A move of 390 mm under a new lease of "a", under way.
  CommandPtr move_under_lease(std::uint64_t& token) {
    token = lease("a");
    auto move = submit(MoveAbsoluteRequest{.position = 390}, {.client = "a", .lease_token = token});
    run(std::chrono::milliseconds(500));
    EXPECT_EQ(move->value().state, CommandState::active);
    line->forget_wire();
    return move;
  }
  [[nodiscard]] Reason refused(const Action& action, const CommandOptions& options) {
    const auto command = try_submit(action, options);
    EXPECT_FALSE(command);
    return command ? Reason::internal : command.error().reason;
  }
  [[nodiscard]] bool was_stopping() const {
    return std::ranges::any_of(machine->events().events_after(0, 1000).events, [](const Event& event) {
      const auto* change = std::get_if<StateChange>(&event.content);
      return change != nullptr && change->to == AxisState::stopping;
    });
  }
  [[nodiscard]] std::vector<LeaseChange> lease_events() const {
    std::vector<LeaseChange> all;
    for (const auto& event : machine->events().events_after(0, 1000).events)
      if (const auto* change = std::get_if<LeaseChange>(&event.content)) all.push_back(*change);
    return all;
  }
};

inline void expect_lost(const CommandPtr& command) {
  EXPECT_EQ(command->value().state, CommandState::aborted) << describe(command->value());
  ASSERT_TRUE(command->value().cause);
  EXPECT_EQ(command->value().cause->reason, Reason::lease_lost);
}

}  // namespace axisd::test
