// Machines whose axes move together, as their entrance hears of them.
#pragma once

#include <gmock/gmock.h>

#include <algorithm>
#include <string>
#include <utility>
#include <vector>

#include "api/cell/group_move_machine.hpp"
#include "api/cell/roster.hpp"
#include "api/cell/status.hpp"

namespace axisd::cell::group_move {

using namespace std::chrono_literals;
using axisd::v1::COMMAND_STATE_ABORTED;
using axisd::v1::COMMAND_STATE_ACCEPTED;
using axisd::v1::COMMAND_STATE_ACTIVE;
using axisd::v1::COMMAND_STATE_DONE;
using axisd::v1::COMMAND_STATE_UNKNOWN;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using Errand = GroupMoveMachine::Errand;
using Kind = Errand::Kind;
using State = GroupMoveMachine::State;

inline grpc::Status refusal(axisd::v1::Reason reason = axisd::v1::REASON_SOFT_LIMIT) {
  return to_status(grpc::StatusCode::FAILED_PRECONDITION, reason, "feeder: no", "ask for less");
}

/// Machines press-1, press-2 ..., whose clocks are an hour, two hours ... ahead.
class Bench {
 public:
  explicit Bench(std::size_t machines = 3, GroupMoveMachine::Limits limits = {.clock_tolerance = 1ms})
      : count(machines), move(names(machines), limits) {
    wire = move.begin();
  }

  static std::vector<std::string> names(std::size_t count) {
    std::vector<std::string> all;
    for (std::size_t i = 0; i < count; ++i) all.push_back("press-" + std::to_string(i + 1));
    return all;
  }
  [[nodiscard]] Duration offset(std::size_t machine) const { return (machine + 1) * Duration(1h); }
  [[nodiscard]] axisd::v1::GroupMove part(std::size_t machine, axisd::v1::CommandState state) const {
    axisd::v1::GroupMove made;
    made.set_id("g-" + std::to_string(machine));
    made.set_state(state);
    auto& command = *made.add_members()->mutable_command();
    command.set_id("c-" + std::to_string(machine));
    command.set_state(state);
    auto& preparation = *made.mutable_preparation();
    set_duration(*preparation.mutable_expires(), expires + offset(machine));
    set_duration(*preparation.mutable_notice(), (machine + 1) * Duration(50ms));
    if (state == COMMAND_STATE_ABORTED) made.mutable_cause()->set_message("arm: alarm 7");
    return made;
  }
  /// Its answer after a round trip, half of which each way.
  [[nodiscard]] GroupMoveMachine::Answer answer(std::size_t machine, axisd::v1::CommandState state) {
    const auto sent = now;
    now += trip;
    return {.sent = sent,
            .received = now,
            .move = part(machine, state),
            .clock = (sent + trip / 2).time_since_epoch() + offset(machine)};
  }
  /// Of a part that another entrance has told.
  [[nodiscard]] GroupMoveMachine::Answer foreign(std::size_t machine, axisd::v1::CommandState state) {
    auto made = answer(machine, state);
    made.move.mutable_preparation()->mutable_starts_at()->set_seconds(7);
    return made;
  }
  [[nodiscard]] GroupMoveMachine::Answer failure(grpc::Status status) const {
    return {.sent = now, .received = now, .status = std::move(status)};
  }
  void add(GroupMoveMachine::Errands more) { wire.insert(wire.end(), more.begin(), more.end()); }
  /// The errands of one kind, which leave the wire.
  GroupMoveMachine::Errands take(Kind kind) {
    GroupMoveMachine::Errands taken;
    std::erase_if(wire, [&](const Errand& errand) {
      if (errand.kind != kind) return false;
      taken.push_back(errand);
      return true;
    });
    return taken;
  }
  [[nodiscard]] std::vector<std::size_t> asked(Kind kind) {
    std::vector<std::size_t> machines;
    for (const auto& errand : take(kind)) machines.push_back(errand.machine);
    return machines;
  }

  void prepare() {
    for (const auto& errand : take(Kind::prepare))
      add(move.prepared(errand.machine, answer(errand.machine, COMMAND_STATE_ACCEPTED)));
  }
  void measure() {
    for (auto errands = take(Kind::measure); !errands.empty(); errands = take(Kind::measure))
      for (const auto& errand : errands)
        add(move.measured(errand.machine, answer(errand.machine, COMMAND_STATE_ACCEPTED)));
  }
  void tell() {
    for (const auto& errand : take(Kind::tell))
      add(move.told(errand.machine, answer(errand.machine, COMMAND_STATE_ACCEPTED)));
  }
  void run_up_to(State state) {
    if (state == State::preparing) return;
    prepare();
    if (state == State::measuring) return;
    measure();
    if (state == State::telling) return;
    tell();
    EXPECT_EQ(move.state(), State::running);
    take(Kind::renew);
  }
  void pass(Duration time) {
    now += time;
    add(move.tick(now));
  }
  void end(std::size_t machine, axisd::v1::CommandState state) {
    add(move.looked(machine, answer(machine, state)));
  }

  /// That it has this moment.
  [[nodiscard]] GroupMoveMachine::Answer taken(const Errand& tell) {
    auto made = answer(tell.machine, COMMAND_STATE_ACCEPTED);
    set_duration(*made.move.mutable_preparation()->mutable_starts_at(), tell.at);
    return made;
  }
  /// Those that wait for a moment take one of this entrance, and are stopped then.
  void stop_waiting(const std::vector<std::size_t>& machines) {
    EXPECT_THAT(asked(Kind::cancel), IsEmpty()) << "another entrance may have told them since";
    EXPECT_EQ(asked(Kind::look), machines);
    const auto tellings = take(Kind::tell);
    ASSERT_EQ(tellings.size(), machines.size());
    for (const auto machine : machines) end(machine, COMMAND_STATE_ACCEPTED);
    EXPECT_THAT(asked(Kind::cancel), IsEmpty()) << "it may be told before that arrives";
    for (const auto& tell : tellings) add(move.told(tell.machine, taken(tell)));
    EXPECT_EQ(asked(Kind::cancel), machines);
    EXPECT_THAT(asked(Kind::renew), IsEmpty()) << "nobody says that all were told";
  }
  void release_waiting(const std::vector<std::size_t>& machines) {
    stop_waiting(machines);
    for (const auto machine : machines) end(machine, COMMAND_STATE_ABORTED);
  }

  const std::size_t count;
  TimePoint now{100s};
  Duration expires = 102s, trip = 200us;
  GroupMoveMachine move;
  GroupMoveMachine::Errands wire;
};

}  // namespace axisd::cell::group_move
