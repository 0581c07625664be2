// The commands of a machine, and their events, in virtual time.
#include "daemon/core/command_log.hpp"

#include <gmock/gmock.h>

#include <string>
#include <vector>

#include "tests/unit/daemon/core/machine_rig.hpp"

namespace axisd::core {
namespace {

using namespace std::chrono_literals;
using testing::ElementsAre;
using testing::IsEmpty;

class Commands : public MachineOnALine {
 protected:
  Commands() : MachineOnALine("two", {1, 2}) { start_with({1, 2}); }

  Command complete(const std::string& axis, const Action& action, const CommandOptions& options) {
    const auto command = machine_->submit(axis, action, options);
    EXPECT_TRUE(command) << to_string(command.error());
    EXPECT_TRUE(world_.run_until([&] { return (*command)->has_ended(); }, 60s));
    return (*command)->value();
  }
  template <class Content>
  std::vector<Content> events() const {
    std::vector<Content> all;
    for (const auto& event : machine_->events().events_after(0, 10'000).events)
      if (const auto* content = std::get_if<Content>(&event.content)) all.push_back(*content);
    return all;
  }
  std::vector<std::string> ids(const std::string& axis, std::size_t most) const {
    std::vector<std::string> all;
    for (const auto& command : machine_->commands().newest(axis, most)) all.push_back(command.id);
    return all;
  }
};

TEST_F(Commands, AreListedNewestFirstAsTheyStand) {
  const auto enable = complete("a1", EnableRequest{}, {.client = "hmi", .request_id = "r1"});
  const auto other = complete("a2", EnableRequest{}, {.client = "panel", .request_id = "r1"});
  const auto run =
      machine_->submit("a1", MoveVelocityRequest{.velocity = 50}, {.client = "hmi", .request_id = "r2"});
  world_.run_for(500ms);
  EXPECT_THAT(ids("", 10), ElementsAre((*run)->value().id, other.id, enable.id));
  EXPECT_THAT(ids("a1", 10), ElementsAre((*run)->value().id, enable.id));
  EXPECT_THAT(ids("a1", 1), ElementsAre((*run)->value().id));
  EXPECT_THAT(ids("a3", 10), IsEmpty());
  const auto before = machine_->commands().newest("a1", 1).front();
  EXPECT_EQ(before.state, CommandState::active);
  EXPECT_EQ(before.client, "hmi");
  EXPECT_EQ(before.asked.velocity, 50);
  (void)complete("a1", StopRequest{}, {.client = "panel"});
  const auto now = machine_->commands().newest("a1", 2);
  EXPECT_EQ(now.at(0).kind, CommandKind::stop);
  EXPECT_EQ(now.at(1).state, CommandState::aborted);
  ASSERT_TRUE(now.at(1).cause);
  EXPECT_EQ(now.at(1).cause->reason, Reason::superseded);
  EXPECT_TRUE(now.at(1).ended_at);
}

TEST_F(Commands, EachIsTwoEventsHoweverOftenItIsRepeatedOrRenewed) {
  (void)complete("a1", EnableRequest{}, {.client = "hmi", .request_id = "r1"});
  for (int i = 0; i < 20; ++i) {
    ASSERT_TRUE(machine_->submit("a1", JogRequest{.velocity = 20}, {.client = "hmi", .request_id = "r2"}));
    world_.run_for(100ms);
  }
  for (int i = 0; i < 20; ++i) {
    ASSERT_TRUE(machine_->submit("a1", JogRequest{.velocity = 20},
                                 {.client = "hmi", .request_id = "n" + std::to_string(i)}));
    world_.run_for(100ms);
  }
  world_.run_for(3s);
  const auto changes = events<CommandChange>();
  std::vector<std::string> seen;
  seen.reserve(changes.size());
  for (const auto& change : changes)
    seen.push_back(std::string(to_string(change.command->kind)) + " " +
                   std::string(to_string(change.command->state)));
  EXPECT_THAT(seen, ElementsAre("enable accepted", "enable done", "jog accepted", "jog aborted"));
  EXPECT_EQ(changes.back().command->cause->reason, Reason::expired);
}

TEST_F(Commands, AFaultIsAnEventWithItsCodeAndAddress) {
  (void)complete("a1", EnableRequest{}, {.client = "hmi", .request_id = "r1"});
  line_->network().node(1)->raise_alarm(2);
  ASSERT_TRUE(world_.run_until(
      [this] { return machine_->find("a1")->snapshot()->state == AxisState::error_stop; }, 5s));
  world_.run_for(2s);
  const auto faults = events<AxisFault>();
  ASSERT_EQ(faults.size(), 1U) << "once, however long it lasts";
  EXPECT_EQ(faults.front().cause.reason, Reason::alarm);
  EXPECT_EQ(faults.front().cause.where.native_code, 2U);
  EXPECT_EQ(faults.front().cause.where.bus, "line-a");
  EXPECT_EQ(faults.front().cause.where.node, 1);
}

TEST_F(Commands, OneThatFloodsIsForgottenBeforeOthers) {
  const auto kept = complete("a1", EnableRequest{}, {.client = "hmi", .request_id = "r1"});
  for (std::size_t i = 0; i < CommandLog::capacity + 100; ++i)
    ASSERT_TRUE(machine_->submit("a2", StopRequest{}, {.client = "flood"}));
  const auto all = machine_->commands().newest("", 2 * CommandLog::capacity);
  EXPECT_EQ(all.size(), CommandLog::capacity);
  EXPECT_EQ(all.back().id, kept.id);
}

}  // namespace
}  // namespace axisd::core
