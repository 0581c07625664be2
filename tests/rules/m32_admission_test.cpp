// M32: no client's behaviour takes from another the means to move or to stop.
#include <fmt/format.h>
#include <gmock/gmock.h>

#include "tests/support/rig.hpp"

namespace axisd::test {
namespace {

using std::chrono::milliseconds;
using std::chrono::minutes;
using std::chrono::seconds;
using testing::HasSubstr;

constexpr int total = 3'000, share = 2'000;  // of one client alone

CommandOptions of(const std::string& client, const std::string& id) {
  return {.client = client, .request_id = id};
}

class M32 : public testing::Test {
 protected:
  M32() {
    rig_.configuration.server.limits.request_ids = total;
    rig_.kill_daemon();
    rig_.start_daemon();
    rig_.ready();
  }
  /// Moves to where the axis stands until nothing is taken any more; how many there were.
  int fill(const std::string& client, int first = 0) {
    for (int i = first;; ++i) {
      const auto moved =
          rig_.try_submit(MoveAbsoluteRequest{.position = 0}, of(client, fmt::format("no-op {}", i)));
      if (!moved) {
        refused_ = moved.error();
        return i - first;
      }
      EXPECT_TRUE(rig_.run_until([&] { return (*moved)->has_ended(); }, seconds(5)));
    }
  }
  void restart() {
    rig_.kill_daemon();
    rig_.start_daemon();
    rig_.run(seconds(5));
  }
  /// Enables, moves and stops.
  void expect_served(const std::string& client, const std::string& id) {
    for (const Action& action : std::initializer_list<Action>{
             EnableRequest{}, SetPositionRequest{.position = 0}, MoveRelativeRequest{.distance = 1}}) {
      const auto command = rig_.try_submit(action, of(client, fmt::format("{} {}", id, action.index())));
      ASSERT_TRUE(command) << to_string(command.error());
      ASSERT_TRUE(rig_.run_until([&] { return (*command)->has_ended(); }, seconds(10)));
      EXPECT_EQ((*command)->value().state, CommandState::done);
    }
  }
  void expect_stops(const std::string& client) {
    for (const auto kind : {StopKind::halt, StopKind::stop, StopKind::quick_stop}) {
      const auto stop = rig_.try_submit(StopRequest{.kind = kind}, of(client, "the same each time"));
      ASSERT_TRUE(stop) << to_string(stop.error());
      EXPECT_TRUE(rig_.run_until([&] { return (*stop)->has_ended(); }, seconds(5)));
      EXPECT_EQ((*stop)->value().state, CommandState::done);
    }
    EXPECT_TRUE(rig_.try_submit(DisableRequest{}, of(client, "off")));
    for (const auto& stop : rig_.machine->stop_all(client)) EXPECT_TRUE(stop);
    bool released = false;
    rig_.machine->release_inhibit(client, [&](const Result<void>& done) { released = done.has_value(); });
    EXPECT_TRUE(rig_.run_until([&] { return released; }, seconds(5)));
    rig_.run(seconds(2));
  }

  Rig rig_{{.persistence = true, .journal = true}};
  Error refused_;
};

TEST_F(M32, WhatOneClientFillsLocksOutNobodyElse) {
  EXPECT_NEAR(fill("greedy"), share, 5);
  EXPECT_EQ(refused_.reason, Reason::busy);
  EXPECT_THAT(refused_.message, HasSubstr("greedy has"));
  EXPECT_THAT(refused_.remedy, HasSubstr("the next is free in"));
  expect_served("hmi", "first");
  EXPECT_FALSE(rig_.try_submit(EnableRequest{}, of("greedy", "new")));
  expect_stops("greedy");
  expect_served("hmi", "second");
}

TEST_F(M32, NorAfterARestart) {
  fill("greedy");
  rig_.run(minutes(5));
  for (int start = 0; start < 2; ++start) {
    restart();
    EXPECT_FALSE(rig_.try_submit(EnableRequest{}, of("greedy", "new"))) << "its ids are remembered";
    expect_served("hmi", fmt::format("start {}", start));
    expect_stops("greedy");
  }
  rig_.run(minutes(7));
  EXPECT_TRUE(rig_.try_submit(EnableRequest{}, of("greedy", "new")))
      << "11 minutes, however often it was restarted";
}

/// Repeats of what is remembered by its id only move nothing, in this run of the daemon and in the next one.
TEST_F(M32, NothingMovesTwiceHoweverMuchIsRemembered) {
  const MoveRelativeRequest move{.distance = 2};
  const auto first = rig_.submit(move, of("greedy", "move"));
  ASSERT_TRUE(rig_.run_until([&] { return first->has_ended(); }, seconds(10)));
  ASSERT_EQ(rig_.submit(MoveAbsoluteRequest{.position = 0}, of("hmi", "back"))->value().state,
            CommandState::accepted);
  rig_.run(seconds(5));
  fill("greedy");
  for (int start = 0; start < 3; ++start) {
    const auto before = rig_.load_mm();
    const auto repeat = rig_.try_submit(move, of("greedy", "move"));
    ASSERT_TRUE(repeat) << to_string(repeat.error());
    EXPECT_EQ((*repeat)->value().id, first->value().id);
    EXPECT_EQ((*repeat)->value().state, CommandState::done);
    rig_.run(seconds(2));
    EXPECT_EQ(rig_.load_mm(), before);
    const auto other = rig_.try_submit(MoveRelativeRequest{.distance = 3}, of("greedy", "move"));
    ASSERT_FALSE(other);
    EXPECT_EQ(other.error().reason, Reason::request_id_conflict);
    rig_.run(minutes(3));
    restart();
  }
}

/// A jog is renewed with the request_id that it was begun with: that takes no further one, whatever is left.
TEST_F(M32, RenewalsOfAJogNeedNoNewId) {
  const JogRequest jog{.velocity = 1, .hold = milliseconds(300)};
  const auto running = rig_.submit(jog, of("hmi", "jog"));
  const auto ids = rig_.machine->book().ids();
  const auto journal = rig_.journal.text.size();
  for (int i = 0; i < 3 * total; ++i) {
    rig_.run(milliseconds(20));
    const auto renewed = rig_.try_submit(jog, of("hmi", "jog"));
    ASSERT_TRUE(renewed);
    ASSERT_EQ(*renewed, running);
    ASSERT_FALSE(running->has_ended()) << i;
  }
  EXPECT_EQ(rig_.machine->book().ids(), ids);
  EXPECT_LT(rig_.journal.text.size(), journal + 1'000);
  rig_.run(seconds(1));
  EXPECT_TRUE(running->has_ended()) << "nobody renews it";
  EXPECT_EQ(rig_.submit(jog, of("hmi", "jog")), running) << "and the id begins no other one";
}

/// Leases cannot run out: they are as many as the axes at most, and one that is held can be taken.
TEST_F(M32, WhoeverLeasesEverythingKeepsNobodyFromMovingOrStopping) {
  const auto& leases = rig_.machine->leases();
  for (int i = 0; i < 1'000; ++i) {
    const auto grant = rig_.machine->leases().acquire({.client = "greedy",
                                                       .axes = {"feeder"},
                                                       .ttl = seconds(60),
                                                       .take = true,
                                                       .request_id = fmt::format("{}", i)});
    ASSERT_TRUE(grant) << to_string(grant.error());
    ASSERT_EQ(leases.table().list().size(), 1U);
  }
  EXPECT_FALSE(rig_.try_submit(EnableRequest{}, of("hmi", "refused"))) << "the axis is leased";
  expect_stops("hmi");
  const auto taken =
      rig_.machine->leases().acquire({.client = "hmi", .axes = {"feeder"}, .ttl = seconds(60), .take = true});
  ASSERT_TRUE(taken) << to_string(taken.error());
  EXPECT_EQ(leases.table().list().size(), 1U);
  auto enable = of("hmi", "enable");
  enable.lease_token = taken->lease.token;
  EXPECT_TRUE(rig_.try_submit(EnableRequest{}, enable));
}

/// With a new id each time renewals count against the client's own share, and stops remain.
TEST_F(M32, AClientThatRunsOutOfIdsStillStops) {
  int renewals = 0;
  for (;; ++renewals) {
    const auto renewed = rig_.try_submit(JogRequest{.velocity = 1, .hold = milliseconds(300)},
                                         of("hmi", fmt::format("jog {}", renewals)));
    if (!renewed) break;
    rig_.run(milliseconds(20));
  }
  EXPECT_NEAR(renewals, share, 10);
  expect_stops("hmi");
  expect_served("other", "first");
}

}  // namespace
}  // namespace axisd::test
