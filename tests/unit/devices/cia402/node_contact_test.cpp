#include "devices/cia402/node_contact.hpp"

#include <gtest/gtest.h>

#include "devices/cia402/seen_objects.hpp"
#include "devices/cia402/stops_sent.hpp"

namespace axisd::cia402 {
namespace {

using namespace std::chrono_literals;

constexpr TimePoint start{1h};

TEST(NodeContact, ANewContactHasToSettleAndStartTheNodeAgain) {
  NodeContact contact;
  contact.settle();
  contact.note_started(true);
  EXPECT_TRUE(contact.is_settled());
  contact.begin();
  EXPECT_FALSE(contact.is_settled());
  EXPECT_FALSE(contact.started());
}

TEST(NodeContact, ARestartIsKnownUntilTheNextContact) {
  NodeContact contact;
  contact.booted(false);
  EXPECT_FALSE(contact.rebooted()) << "nothing of its memory was needed";
  contact.booted(true);
  contact.booted(false);
  EXPECT_TRUE(contact.rebooted());
  contact.begin();
  EXPECT_FALSE(contact.rebooted());
}

TEST(NodeContact, ABootUpEndsWhatWasBefore) {
  NodeContact contact;
  contact.note_heartbeat(true);
  contact.note_alarm(0x2310);
  contact.booted(false);
  EXPECT_FALSE(contact.heartbeat_lost());
  EXPECT_FALSE(contact.has_alarm());
}

TEST(NodeContact, SilenceCountsFromTheFirstQuestionOrTheLastSign) {
  NodeContact contact;
  contact.note_silence(start);
  contact.note_silence(start + 5s);
  EXPECT_EQ(contact.silent_for(start + 6s, std::nullopt), 6s);
  EXPECT_EQ(contact.silent_for(start + 6s, start + 4s), 2s);
  contact.note_answer();
  contact.note_silence(start + 6s);
  EXPECT_EQ(contact.silent_for(start + 7s, start), 1s);
}

TEST(NodeContact, AnAlarmIsToldOnce) {
  NodeContact contact;
  contact.note_alarm(0x2310);
  EXPECT_TRUE(contact.has_alarm());
  EXPECT_EQ(contact.take_alarm(), 0x2310);
  EXPECT_EQ(contact.take_alarm(), 0);
}

TEST(NodeContact, AFaultThatWasLeftAfterItWasAskedForIsOver) {
  NodeContact contact;
  contact.note_fault_left(start);
  EXPECT_TRUE(contact.has_left_fault_since(start - 1ms));
  EXPECT_FALSE(contact.has_left_fault_since(start));
}

TEST(StopsSent, AReadingIsAfterTheStopsThatHaveEnded) {
  StopsSent stops;
  EXPECT_TRUE(stops.is_after(start));
  stops.begin_stop();
  stops.begin_stop();
  stops.end_stop(start);
  EXPECT_FALSE(stops.is_after(start + 1s)) << "one is on its way";
  stops.end_stop(start + 1ms);
  EXPECT_FALSE(stops.is_after(start));
  EXPECT_TRUE(stops.is_after(start + 1ms));
  EXPECT_EQ(stops.count(), 2U);
}

TEST(StopsSent, TheLastFrameCounts) {
  StopsSent stops;
  EXPECT_FALSE(stops.frame_at());
  stops.note_frame(start);
  stops.note_frame(start + 1ms);
  EXPECT_EQ(stops.frame_at(), start + 1ms);
}

TEST(StopsSent, TriggersMayOverlap) {
  StopsSent stops;
  stops.begin_trigger();
  stops.begin_trigger();
  stops.end_trigger();
  EXPECT_TRUE(stops.triggers());
  stops.end_trigger();
  EXPECT_FALSE(stops.triggers());
}

TEST(SeenObjects, TheLongestAnswerOfLateCounts) {
  SeenObjects seen;
  seen.note_answer(80ms);
  seen.note_answer(1ms);
  EXPECT_EQ(seen.answer_time, 70ms);
}

TEST(SeenObjects, APowerCycleLeavesWhatTheFirmwareIs) {
  SeenObjects seen{.other_homing_codes = true, .closed_loop = true};
  seen.sizes[canopen::Object{0x6081, 0}.key()] = 2;
  seen.forget_power_cycle();
  EXPECT_FALSE(seen.closed_loop);
  EXPECT_TRUE(seen.other_homing_codes);
  EXPECT_EQ(seen.size({0x6081, 0}), 2);
  EXPECT_FALSE(seen.size({0x6083, 0}));
}

}  // namespace
}  // namespace axisd::cia402
