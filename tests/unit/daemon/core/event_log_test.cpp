#include "daemon/core/event_log.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <iterator>
#include <map>

namespace axisd::core {
namespace {

void record(EventLog& log, int count) {
  for (int i = 0; i < count; ++i) log.record({}, "feeder", ConfigurationDrift{.text = std::to_string(i)});
}

TEST(EventLog, EventsAfterACursorInBoundedBatches) {
  EventLog log;
  EXPECT_EQ(log.events_after(0, 10).newest, 0U);
  record(log, 5);
  const auto batch = log.events_after(2, 2);
  ASSERT_EQ(batch.events.size(), 2U);
  EXPECT_EQ(batch.events[0].sequence, 3U);
  EXPECT_EQ(batch.events[1].sequence, 4U);
  EXPECT_EQ(batch.newest, 5U);
  EXPECT_EQ(batch.lost, 0U);
  EXPECT_TRUE(log.events_after(5, 10).events.empty());
  EXPECT_TRUE(log.events_after(99, 10).events.empty());
}

TEST(EventLog, SaysHowManyAreNoLongerKept) {
  EventLog log;
  record(log, static_cast<int>(EventLog::capacity_of_rare) + 7);
  const auto batch = log.events_after(3, 1);
  EXPECT_EQ(batch.lost, 4U);
  ASSERT_EQ(batch.events.size(), 1U);
  EXPECT_EQ(batch.events[0].sequence, 8U);
  EXPECT_EQ(log.events_after(7, 1).lost, 0U);
}

EventContent command(const std::string& client, CommandState state = CommandState::accepted) {
  return CommandChange{.command = std::make_shared<const Command>(Command{.client = client, .state = state})};
}

/// Everything that is kept, read in pages as a client does; `lost`: in all of them.
std::vector<Event> kept(const EventLog& log, std::uint64_t& lost) {
  std::vector<Event> all;
  lost = 0;
  for (std::uint64_t cursor = 0;;) {
    auto batch = log.events_after(cursor, 100);
    lost += batch.lost;
    if (batch.events.empty()) return all;
    cursor = batch.events.back().sequence;
    std::ranges::move(batch.events, std::back_inserter(all));
  }
}

TEST(EventLog, AClientThatFloodsPushesOutOnlyItsOwn) {
  EventLog log;
  log.record({}, "feeder", AxisFault{.cause = {.reason = Reason::alarm, .message = "first"}});
  log.record({}, "feeder", command("hmi"));
  log.record({}, "feeder", StateChange{.to = AxisState::error_stop});
  const int flood = 3 * static_cast<int>(EventLog::capacity);
  for (int i = 0; i < flood; ++i) log.record({}, "table", command("flood"));
  for (int i = 0; i < flood; ++i) log.record({}, "table", StateChange{});
  for (int i = 0; i < flood; ++i) log.record({}, "table", TerminalEdge{});
  log.record({}, "feeder", command("hmi", CommandState::done));
  std::uint64_t lost = 0;
  const auto all = kept(log, lost);
  EXPECT_EQ(all.size(), 3 * EventLog::capacity + 1);
  EXPECT_EQ(lost + all.size(), static_cast<std::uint64_t>(3 * flood + 4))
      << "each event is kept, or told lost, once";
  EXPECT_TRUE(std::holds_alternative<AxisFault>(all.at(0).content));
  const auto ours = std::ranges::count(all, "feeder", &Event::axis);
  EXPECT_EQ(ours, 4) << "the fault, the change of state, and the other client's commands";
  EXPECT_EQ(all.back().sequence, static_cast<std::uint64_t>(3 * flood + 4));
}

TEST(EventLog, AClientThatFloodsWithStopAllPushesOutOnlyItsOwn) {
  EventLog log;
  log.record({}, "", InhibitChange{.by = "hmi"});
  log.record({}, "", InhibitChange{.what = InhibitChange::What::released, .by = "panel"});
  for (std::size_t i = 0; i < 3 * EventLog::capacity; ++i) log.record({}, "", InhibitChange{.by = "flood"});
  std::uint64_t lost = 0;
  const auto all = kept(log, lost);
  EXPECT_GT(lost, 0U);
  EXPECT_EQ(std::get<InhibitChange>(all.at(0).content).by, "hmi");
  EXPECT_EQ(std::get<InhibitChange>(all.at(1).content).by, "panel");
}

TEST(EventLog, ManyClientsShareEvenly) {
  EventLog log;
  for (std::size_t i = 0; i < 2 * EventLog::capacity; ++i) log.record({}, "x", command("a"));
  for (std::size_t i = 0; i < 2 * EventLog::capacity; ++i)
    log.record({}, "x", command(i % 2 == 0 ? "b" : "c"));
  std::uint64_t lost = 0;
  std::map<std::string, std::size_t> share;
  for (const auto& event : kept(log, lost)) ++share[std::get<CommandChange>(event.content).command->client];
  for (const auto* client : {"a", "b", "c"})
    EXPECT_NEAR(share[client], EventLog::capacity / 3.0, 2) << client;
}

TEST(EventLog, TellsOfEach) {
  EventLog log;
  int told = 0;
  log.on_event([&] { ++told; });
  record(log, 3);
  EXPECT_EQ(told, 3);
}

}  // namespace
}  // namespace axisd::core
