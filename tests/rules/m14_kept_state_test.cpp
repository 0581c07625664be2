// M14, M20: where what the daemon remembers is not certain, nothing moves before somebody has accepted that;
// and StopAll says whether it would be remembered.
#include <gmock/gmock.h>

#include "tests/support/rig.hpp"

namespace axisd::test {
namespace {

using namespace std::chrono_literals;
using testing::ElementsAre;
using testing::HasSubstr;
using testing::SizeIs;

const Conviction rolled_back{
    .file = KeptFile::state, .fault = KeptFault::rolled_back, .found = 12, .expected = 40};

class KeptRig : public Rig {
 public:
  KeptRig() : Rig({.persistence = true}) {
    ready();
    run(200ms);
    stop_daemon();
    store.saved.convictions = {rolled_back};
    start_daemon();
  }
  [[nodiscard]] std::vector<KeptStateChange> changes() const {
    std::vector<KeptStateChange> all;
    for (const auto& event : machine->events().events_after(0, 1000).events)
      if (const auto* change = std::get_if<KeptStateChange>(&event.content)) all.push_back(*change);
    return all;
  }
  Result<std::vector<Conviction>> accept(const std::string& client) {
    std::optional<Result<std::vector<Conviction>>> answer;
    machine->state_gate().accept(client, [&](auto result) { answer = std::move(result); });
    EXPECT_TRUE(run_until([&] { return answer.has_value(); }, 1s));
    return answer.value_or(fail(Reason::internal, "no answer"));
  }
};

TEST(M14KeptState, MotionWaitsUntilSomebodyHasAccepted) {
  KeptRig rig;
  ASSERT_THAT(rig.changes(), SizeIs(1));
  EXPECT_EQ(rig.changes()[0].accepted_by, "");
  EXPECT_THAT(rig.changes()[0].convictions, ElementsAre(rolled_back));
  ASSERT_TRUE(rig.machine->state_gate().unaccepted());
  rig.run(1s);
  const auto before = rig.triggers();
  for (const Action& motion :
       {Action(MoveAbsoluteRequest{.position = 10}), Action(MoveRelativeRequest{.distance = 5}),
        Action(MoveVelocityRequest{.velocity = 5}), Action(JogRequest{.velocity = 5}),
        Action(HomeRequest{})}) {
    const auto refused = rig.try_submit(motion);
    ASSERT_FALSE(refused);
    EXPECT_EQ(refused.error().reason, Reason::state_unaccepted);
    EXPECT_THAT(refused.error().message,
                HasSubstr("state.v1 was rolled back: it has generation 12, but there was "
                          "generation 40"));
    EXPECT_THAT(refused.error().remedy, HasSubstr("axisctl state accept"));
  }
  EXPECT_EQ(rig.complete(EnableRequest{}).state, CommandState::done) << "moves nothing";
  EXPECT_EQ(rig.complete(StopRequest{}).state, CommandState::done);
  EXPECT_EQ(rig.state()->link, LinkState::online);
  EXPECT_EQ(rig.triggers(), before);

  const auto accepted = rig.accept("hmi");
  ASSERT_TRUE(accepted);
  EXPECT_THAT(*accepted, ElementsAre(rolled_back));
  EXPECT_FALSE(rig.machine->state_gate().unaccepted());
  ASSERT_THAT(rig.changes(), SizeIs(2));
  EXPECT_EQ(rig.changes()[1].accepted_by, "hmi");
  rig.run(5s);
  EXPECT_EQ(rig.triggers(), before) << "M1: nothing by itself";
  EXPECT_EQ(rig.complete(MoveRelativeRequest{.distance = 5}).state, CommandState::done);
  EXPECT_THAT(*rig.accept("panel"), SizeIs(0)) << "there is nothing more to accept";
  EXPECT_THAT(rig.changes(), SizeIs(2));
  rig.stop_daemon();
  rig.start_daemon();
  EXPECT_FALSE(rig.machine->state_gate().unaccepted()) << "it is remembered, too";
}

TEST(M14KeptState, WhatCannotBeSavedIsNotAccepted) {
  KeptRig rig;
  rig.store.failing = true;
  const auto failed = rig.accept("hmi");
  ASSERT_FALSE(failed);
  EXPECT_EQ(failed.error().reason, Reason::storage);
  EXPECT_FALSE(rig.try_submit(MoveRelativeRequest{.distance = 5}));
  EXPECT_THAT(rig.changes(), SizeIs(1));
  rig.stop_daemon();
  rig.start_daemon();
  EXPECT_TRUE(rig.machine->state_gate().unaccepted());
}

TEST(M14KeptState, ExplainTellsIt) {
  KeptRig rig;
  const auto obstacles = rig.axis().explain(MoveRelativeRequest{.distance = 5}, {});
  ASSERT_FALSE(obstacles.empty());
  EXPECT_EQ(obstacles.front().error.reason, Reason::state_unaccepted);
  EXPECT_TRUE(obstacles.front().blocking);
}

TEST(M14KeptState, StopAllSaysWhetherItsLatchIsOnTheDisk) {
  KeptRig rig;
  int answers = 0;
  std::optional<Error> trouble;
  const auto stop_all = [&] {
    answers = 0;
    rig.machine->stop_all("hmi", {}, [&](std::optional<Error> error) {
      ++answers;
      trouble = std::move(error);
    });
  };
  stop_all();
  EXPECT_EQ(answers, 0) << "the stops wait for nothing, this does";
  EXPECT_TRUE(rig.run_until([&] { return answers == 1; }, 100ms));
  EXPECT_FALSE(trouble);
  rig.store.failing = true;
  stop_all();
  EXPECT_TRUE(rig.run_until([&] { return answers == 1; }, 100ms));
  ASSERT_TRUE(trouble);
  EXPECT_EQ(trouble->reason, Reason::storage);
  EXPECT_THAT(trouble->message, HasSubstr("would not outlive a restart"));
  EXPECT_FALSE(trouble->remedy.empty());
  std::vector<InhibitChange::What> told;
  for (const auto& event : rig.machine->events().events_after(0, 1000).events)
    if (const auto* change = std::get_if<InhibitChange>(&event.content)) told.push_back(change->what);
  EXPECT_THAT(told, ElementsAre(InhibitChange::What::latched, InhibitChange::What::latched,
                                InhibitChange::What::not_durable));
  rig.store.failing = false;
  rig.store.slow = true;
  stop_all();
  rig.run(990ms);
  EXPECT_EQ(answers, 0);
  EXPECT_TRUE(rig.run_until([&] { return answers == 1; }, 20ms)) << "a disk that hangs holds up nobody";
  ASSERT_TRUE(trouble);
  EXPECT_THAT(trouble->message, HasSubstr("not on the disk yet"));
  rig.store.release();
  rig.run(2s);
  EXPECT_EQ(answers, 1) << "once";
  ASSERT_NE(rig.machine->inhibited_by(), nullptr);
}

}  // namespace
}  // namespace axisd::test
