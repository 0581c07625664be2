#include "daemon/core/event_log.hpp"

#include <gtest/gtest.h>

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
  record(log, static_cast<int>(EventLog::capacity) + 7);
  const auto batch = log.events_after(3, 1);
  EXPECT_EQ(batch.lost, 4U);
  ASSERT_EQ(batch.events.size(), 1U);
  EXPECT_EQ(batch.events[0].sequence, 8U);
  EXPECT_EQ(log.events_after(7, 1).lost, 0U);
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
