// What of a machine goes into the audit, in virtual time.
#include "daemon/core/audit_trail.hpp"

#include <gmock/gmock.h>

#include <memory>
#include <string>
#include <vector>

#include "daemon/core/drive_access_service.hpp"
#include "tests/unit/daemon/core/machine_rig.hpp"

namespace axisd::core {
namespace {

using namespace std::chrono_literals;
using testing::ElementsAre;
using testing::IsEmpty;
using testing::SizeIs;

struct Kept : AuditSink {
  void add(AuditEntry entry) override { entries.push_back(std::move(entry)); }
  template <class Content>
  std::vector<Content> all() const {
    std::vector<Content> found;
    for (const auto& entry : entries)
      if (const auto* content = std::get_if<Content>(&entry.content)) found.push_back(*content);
    return found;
  }
  std::vector<Command> commands() const {
    std::vector<Command> found;
    for (const auto& event : all<Event>())
      if (const auto* change = std::get_if<CommandChange>(&event.content)) found.push_back(*change->command);
    return found;
  }
  std::vector<AuditEntry> entries;
};

class Audited : public Kept, public MachineOnALine {  // in this order: it outlives the machine
 protected:
  Audited() : MachineOnALine("one", {1}) {
    audit_ = this;
    start_with({1});
  }
  void complete(const Action& action, const std::string& request_id) {
    const auto command = machine_->submit("a1", action, {.client = "hmi", .request_id = request_id});
    ASSERT_TRUE(command) << to_string(command.error());
    ASSERT_TRUE(world_.run_until([&] { return (*command)->has_ended(); }, 60s));
  }
};

TEST_F(Audited, ACommandIsToldBeforeAnythingIsSentForItAndWhenItHasEnded) {
  const auto seen = commands().size();
  const auto origin = std::make_shared<const CallOrigin>(CallOrigin{.role = Role::operator_});
  const auto command =
      machine_->submit("a1", EnableRequest{}, {.client = "hmi", .request_id = "r1", .origin = origin});
  ASSERT_TRUE(command);
  ASSERT_THAT(commands(), SizeIs(seen + 1)) << "before the core did anything else";
  EXPECT_EQ(commands().back().client, "hmi");
  EXPECT_EQ(commands().back().origin, origin);
  EXPECT_EQ(commands().back().state, CommandState::accepted);
  ASSERT_TRUE(world_.run_until([&] { return (*command)->has_ended(); }, 60s));
  EXPECT_THAT(commands(), SizeIs(seen + 2));
  EXPECT_EQ(commands().back().state, CommandState::done);
}

TEST_F(Audited, AStopIsToldToo) {
  complete(StopRequest{}, "");
  ASSERT_THAT(commands(), SizeIs(2));
  EXPECT_EQ(commands()[0].kind, CommandKind::stop);
}

TEST_F(Audited, ARefusalIsToldWithItsCause) {
  const auto refused = machine_->submit(
      "a1", MoveAbsoluteRequest{.position = 5},
      {.client = "hmi",
       .request_id = "r1",
       .origin = std::make_shared<const CallOrigin>(CallOrigin{.peer = "ipv4:10.0.0.5:51234"})});
  ASSERT_FALSE(refused);
  const auto told = all<RefusedCommand>();
  ASSERT_THAT(told, SizeIs(1));
  EXPECT_EQ(told[0].command.kind, CommandKind::move_absolute);
  EXPECT_EQ(told[0].command.asked.position, 5);
  EXPECT_EQ(told[0].command.request_id, "r1");
  ASSERT_TRUE(told[0].command.origin);
  EXPECT_EQ(told[0].command.origin->peer, "ipv4:10.0.0.5:51234");
  ASSERT_TRUE(told[0].command.cause);
  EXPECT_EQ(told[0].command.cause->reason, refused.error().reason);
}

TEST_F(Audited, ARefusedGroupIsNamed) {
  AuditTrail(world_.clock(), this)
      .refused("a1", GroupMemberRequest{}, {.client = "hmi"}, {.reason = Reason::offline}, "portal");
  const auto told = all<RefusedCommand>();
  ASSERT_THAT(told, SizeIs(1));
  EXPECT_EQ(told[0].group, "portal");
  EXPECT_EQ(told[0].command.axis, "a1");
}

/// One client does not write the others out of the files (M32).
TEST_F(Audited, ManyRefusalsOfOneClientAreCounted) {
  const auto ask = [this](const std::string& client) {
    EXPECT_FALSE(
        machine_->submit("a1", MoveAbsoluteRequest{.position = 5}, {.client = client, .request_id = "r"}));
  };
  for (int i = 0; i < 100; ++i) ask("loud");
  ask("calm");
  EXPECT_THAT(all<RefusedCommand>(), SizeIs(audit_ration::refusals.most + 1));
  world_.run_for(61s);
  ask("loud");
  EXPECT_EQ(all<RefusedCommand>().back().left_out, 100 - audit_ration::refusals.most);
  ask("loud");
  EXPECT_EQ(all<RefusedCommand>().back().left_out, 0U);
}

TEST_F(Audited, WhomADelegateSpeaksForShareItsRation) {
  for (std::uint64_t i = 0; i < 2 * audit_ration::refusals.most; ++i)
    EXPECT_FALSE(machine_->submit("a1", MoveAbsoluteRequest{.position = 5},
                                  {.client = "p" + std::to_string(i) + " via web", .request_id = "r"}));
  EXPECT_THAT(all<RefusedCommand>(), SizeIs(audit_ration::refusals.most));
}

/// Nobody needs a role to stop: a crowd of stops writes nobody else out of the files either.
TEST_F(Audited, ManyStopsOfOneIdentityAreCounted) {
  AuditTrail trail(world_.clock(), this);
  int number = 0;
  const auto stop = [&](const std::string& client) {
    Command command{.id = "s-" + std::to_string(++number), .client = client, .kind = CommandKind::stop};
    for (const auto state : {CommandState::accepted, CommandState::done}) {
      command.state = state;
      trail.event({.content = CommandChange{.command = std::make_shared<const Command>(command)}});
    }
  };
  const auto before = entries.size();
  for (std::uint64_t i = 0; i < audit_ration::stops.most + 10; ++i) stop("loud");
  stop("p1 via loud");
  stop("calm");
  EXPECT_EQ(entries.size() - before, 2 * (audit_ration::stops.most + 1)) << "each with its end";
  world_.run_for(61s);
  EXPECT_THAT(all<AuditGap>(), IsEmpty());
  stop("loud");
  const auto gaps = all<AuditGap>();
  ASSERT_THAT(gaps, SizeIs(1));
  EXPECT_EQ(gaps[0].left_out, 11U);
  EXPECT_EQ(gaps[0].client, "loud");
}

TEST_F(Audited, WhatAnAxisDoesByItselfIsNotKept) {
  complete(EnableRequest{}, "r1");
  for (const auto& event : all<Event>()) EXPECT_FALSE(std::holds_alternative<StateChange>(event.content));
}

TEST_F(Audited, StopAllAndItsRelease) {
  const auto origin = std::make_shared<const CallOrigin>(CallOrigin{.peer = "unix:hmi"});
  (void)machine_->stop_all("panel", {}, {}, origin);
  EXPECT_EQ(commands().back().origin, origin);
  world_.run_for(1s);
  machine_->release_inhibit("hmi", [](const Result<void>&) {});
  world_.run_for(1s);
  std::vector<std::string> who;
  for (const auto& event : all<Event>())
    if (const auto* change = std::get_if<InhibitChange>(&event.content)) who.push_back(change->by);
  EXPECT_THAT(who, ElementsAre("panel", "hmi"));
}

TEST_F(Audited, AParameterIsToldWithWhatTheDriveHeldBefore) {
  complete(DisableRequest{}, "");
  DriveAccessService drives(world_.executor(), world_.clock(), *machine_);
  constexpr std::uint32_t homing_time = 0x0034;
  std::optional<Result<std::vector<ParameterValue>>> before, written;
  drives.read_parameters("a1", {homing_time}, [&](auto result) { before = std::move(result); });
  ASSERT_TRUE(world_.run_until([&] { return before.has_value(); }, 10s));
  ASSERT_TRUE(*before) << to_string(before->error());
  const auto held = before->value().front().value;
  drives.write_parameters("a1", {{.address = homing_time, .value = held + 1}}, {.client = "hmi"},
                          [&](auto result) { written = std::move(result); });
  ASSERT_TRUE(world_.run_until([&] { return written.has_value(); }, 10s));
  const auto told = all<AuditedCall>();
  ASSERT_THAT(told, SizeIs(2));
  EXPECT_EQ(told[0].phase, AuditedCall::Phase::asked);
  EXPECT_EQ(told[1].client, "hmi");
  EXPECT_EQ(told[1].rpc, "DriveService.WriteParameters");
  ASSERT_THAT(told[1].parameters, SizeIs(1));
  EXPECT_FALSE(told[1].parameters[0].name.empty());
  EXPECT_EQ(told[1].parameters[0].asked, held + 1);
  if (*written) {
    EXPECT_EQ(told[1].phase, AuditedCall::Phase::done);
    EXPECT_EQ(told[1].parameters[0].before, held);
    EXPECT_EQ(told[1].parameters[0].after, held + 1);
  } else {
    ADD_FAILURE() << to_string(written->error());
  }
}

}  // namespace
}  // namespace axisd::core
