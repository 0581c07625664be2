#include "buses/modbus_rtu/late_replies.hpp"

#include <gtest/gtest.h>

namespace axisd::modbus_rtu {
namespace {

using namespace std::chrono_literals;

constexpr TimePoint start{1h};
const ExchangeResult lost{.status = ExchangeStatus::timeout};

ExchangeResult answered(ReplyKind kind = ReplyKind::match) {
  return {.status = ExchangeStatus::replied, .reply = {.kind = kind}};
}
Request read(std::uint16_t address, std::uint16_t count) {
  return {.node = 1, .address = address, .count = count};
}

TEST(LateReplies, ADistinctReadIsOfWhatTheNodeHasAnsweredAndNotLonger) {
  LateReplies late;
  late.note(read(0x0003, 10), answered(), start);
  late.note(read(0x0020, 6), answered(), start);
  EXPECT_FALSE(late.may_answer(read(0x0040, 2), start));
  late.note(read(0x0040, 2), lost, start);
  EXPECT_TRUE(late.may_answer(read(0x0003, 2), start));
  EXPECT_FALSE(late.may_answer(read(0x0003, 10), start)) << "another length";
  const auto distinct = late.distinct_read(read(0x0040, 2), start);
  ASSERT_TRUE(distinct);
  EXPECT_EQ(distinct->address, 0x0003);
  EXPECT_EQ(distinct->count, 1);
  late.note(*distinct, lost, start);
  EXPECT_EQ(late.distinct_read(read(0x0040, 2), start)->count, 3) << "no shorter one is left";
  late.note(read(0x0003, 3), answered(), start);
  EXPECT_FALSE(late.may_answer(read(0x0003, 2), start)) << "nothing older follows";
}

TEST(LateReplies, AnExceptionProvesNothingWhileAnOlderOneMayCome) {
  LateReplies late;
  late.note(read(0x0003, 10), answered(ReplyKind::exception), start);
  EXPECT_FALSE(late.may_answer(read(0x0003, 10), start)) << "nothing was late";
  late.note(read(0x0003, 2), lost, start);
  late.note(read(0x0003, 1), answered(ReplyKind::exception), start + 1s);
  EXPECT_TRUE(late.may_answer(read(0x0003, 1), start + 1s));
  EXPECT_TRUE(late.may_answer(read(0x0003, 2), start + LateReplies::latest));
  EXPECT_FALSE(late.may_answer(read(0x0003, 2), start + LateReplies::latest + 1ns));
  late.note(read(0x0003, 4), answered(ReplyKind::exception), start + 7s);
  EXPECT_FALSE(late.may_answer(read(0x0003, 4), start + 7s)) << "what was late can come no more";
}

TEST(LateReplies, WhereEveryLengthWasTriedThereIsNoneUntilTheFirstCanComeNoMore) {
  LateReplies late;
  const auto waiting = read(0x0500, 2);
  auto now = start;
  for (int tried = 0; tried < LateReplies::longest_read; ++tried) {
    EXPECT_LE(late.distinct_at(1, now), now);
    const auto distinct = late.distinct_read(waiting, now);
    ASSERT_TRUE(distinct) << tried;
    EXPECT_LE(distinct->count, LateReplies::longest_read);
    late.note(*distinct, answered(ReplyKind::exception), now);
    late.note(*distinct, lost, now);
    now += 10ms;
  }
  EXPECT_FALSE(late.distinct_read(waiting, now));
  const auto at = late.distinct_at(1, now);
  EXPECT_GT(at, start + LateReplies::latest);
  EXPECT_FALSE(late.distinct_read(waiting, at - 1ns));
  EXPECT_TRUE(late.distinct_read(waiting, at));
}

TEST(LateReplies, TheEchoOfAWriteMayBeThatOfTheSameOneBefore) {
  LateReplies late;
  const Request stop{
      .node = 1, .function = Function::write_single_register, .address = 0x0028, .values = {0}};
  auto other = stop;
  other.values = {1};
  late.note(stop, lost, start);
  EXPECT_TRUE(late.may_echo(stop, start));
  EXPECT_FALSE(late.may_echo(other, start));
  late.note(stop, answered(), start + 4s);
  EXPECT_TRUE(late.may_echo(stop, start + 6s)) << "its own echo may still come";
  late.note(read(0x0003, 10), answered(), start + 6s);
  EXPECT_FALSE(late.may_echo(stop, start + 6s));
}

TEST(LateReplies, AFrameAfterARequestInVainIsOfANodeThatAnswersLate) {
  LateReplies late;
  auto heard = answered();
  heard.foreign_frames = 1;
  late.note(read(0x0003, 10), heard, start);
  EXPECT_FALSE(late.answers_late(1, start)) << "somebody else's: nothing was in vain";
  late.note(read(0x0003, 10), lost, start);
  late.note(read(0x0003, 1), answered(), start);
  EXPECT_FALSE(late.answers_late(1, start)) << "nothing was heard";
  late.note(read(0x0003, 10), lost, start);
  Request other = read(0x0003, 2);
  other.node = 2;
  late.note(other, heard, start + 20ms);
  EXPECT_TRUE(late.answers_late(1, start + 20ms));
  EXPECT_FALSE(late.answers_late(2, start + 20ms));
  EXPECT_TRUE(late.answers_late(1, start + 1min));
  EXPECT_FALSE(late.answers_late(1, start + 2min));
}

}  // namespace
}  // namespace axisd::modbus_rtu
