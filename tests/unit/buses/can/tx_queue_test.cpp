#include "buses/can/tx_queue.hpp"

#include <gtest/gtest.h>

#include <random>

#include "tests/unit/buses/can/frames.hpp"

namespace axisd::can {
namespace {

using namespace std::chrono_literals;
using test::frame_of;
using test::guarded_by;
using test::options_of;
using Class = TransactionClass;
using Texts = std::vector<std::string>;

struct Bench {
  TxQueue queue{PortSettings{.window = 4, .queue_limit = 8, .stall_timeout = 100ms}};
  test::Endings endings;
  TimePoint now{1h};

  void push(std::uint32_t id, const SendOptions& options = options_of(Class::motion)) {
    queue.push(frame_of(id), options, endings.of(id));
  }
  /// Hands over what may go; the ids in order.
  std::vector<std::uint32_t> hand_over() {
    std::vector<std::uint32_t> ids;
    while (const auto* frame = queue.next(now)) {
      ids.push_back(frame->id);
      queue.handed_over(now);
    }
    return ids;
  }
  Texts ended() {
    for (auto& each : queue.take_ended()) each.completion(each.result);
    return endings.texts();
  }
};
using Ids = std::vector<std::uint32_t>;

TEST(TxQueue, StopBeforeMotionBeforeTheRestAndInOrderWithinAClass) {
  Bench bench;
  bench.push(1, options_of(Class::parameters));
  bench.push(2, options_of(Class::motion));
  bench.push(3, options_of(Class::motion));
  bench.push(4, options_of(Class::stop));
  EXPECT_EQ(bench.hand_over(), (Ids{4, 2, 3, 1}));
}

TEST(TxQueue, HoldsBackBeyondTheWindowUntilAnEchoComes) {
  Bench bench;
  for (std::uint32_t id = 1; id <= 6; ++id) bench.push(id);
  EXPECT_EQ(bench.hand_over(), (Ids{1, 2, 3, 4}));
  bench.push(7, options_of(Class::stop));
  EXPECT_TRUE(bench.hand_over().empty());
  EXPECT_TRUE(bench.queue.echo(frame_of(1), bench.now + 1us, bench.now));
  EXPECT_EQ(bench.hand_over(), (Ids{7}));
  EXPECT_EQ(bench.ended(), (Texts{"1:sent"}));
  EXPECT_EQ(bench.endings.results().at(0).handed_over, bench.now);
  EXPECT_EQ(bench.endings.results().at(0).sent_at, bench.now + 1us);
}

TEST(TxQueue, MatchesEchoesByContentOldestFirst) {
  Bench bench;
  bench.push(1);
  bench.push(2);
  bench.push(1);
  bench.hand_over();
  EXPECT_TRUE(bench.queue.echo(frame_of(2), bench.now, bench.now));  // a controller with mailboxes
  EXPECT_FALSE(bench.queue.echo(frame_of(2), bench.now, bench.now));
  EXPECT_FALSE(bench.queue.echo(frame_of(1, {0}), bench.now, bench.now));
  EXPECT_TRUE(bench.queue.echo(frame_of(1), bench.now, bench.now));
  EXPECT_EQ(bench.queue.unconfirmed(), 1U);
  EXPECT_EQ(bench.ended(), (Texts{"2:sent", "1:sent"}));
}

TEST(TxQueue, AsksTheGuardWhenTheFrameIsHandedOver) {
  Bench bench;
  const auto gate = std::make_shared<AxisGate>();
  auto leased = guarded_by(gate);
  leased.guard.fencing_token = 7;
  auto late = guarded_by(gate);
  late.guard.not_after = bench.now - 1ns;
  bench.push(1, leased);
  bench.push(2, late);
  bench.push(3, guarded_by(gate));
  EXPECT_EQ(bench.hand_over(), (Ids{3}));
  bench.push(4, guarded_by(gate));
  gate->raise();
  bench.push(5, options_of(Class::motion));
  EXPECT_EQ(bench.hand_over(), (Ids{5}));
  EXPECT_EQ(bench.ended(), (Texts{"1:lease_lost", "2:expired", "4:superseded"}));
}

TEST(TxQueue, PurgeEndsWhatAStopOvertookThoughTheWindowIsFull) {
  Bench bench;
  const auto gate = std::make_shared<AxisGate>();
  for (std::uint32_t id = 1; id <= 4; ++id) bench.push(id);
  bench.hand_over();
  bench.push(5, guarded_by(gate));
  bench.push(6);
  gate->raise();
  bench.queue.purge_superseded(*gate, bench.now);
  EXPECT_EQ(bench.ended(), (Texts{"5:superseded"}));
  EXPECT_EQ(bench.queue.queued(), 1U);
}

/// Whatever a purge looks at and finds forbidden it ends: what it leaves it has not looked at.
TEST(TxQueue, APurgeLooksAtNothingThatOtherGatesGuard) {
  Bench bench;
  const auto own = std::make_shared<AxisGate>();
  std::vector<std::shared_ptr<AxisGate>> others;
  for (std::uint32_t id = 1; id <= 6; ++id) {
    others.push_back(std::make_shared<AxisGate>());
    bench.push(id, guarded_by(others.back()));
    others.back()->raise();
  }
  auto shared = guarded_by(others.front());  // of a common start: two gates, both still old
  shared.guard = {};
  shared.more_guards = {{.gate = own, .epoch = own->epoch()},
                        {.gate = others.front(), .epoch = others.front()->epoch()}};
  bench.push(300, shared);
  bench.push(301, guarded_by(own));
  own->raise();
  bench.queue.purge_superseded(*own, bench.now);
  EXPECT_EQ(bench.ended(), (Texts{"300:superseded", "301:superseded"}));
  EXPECT_EQ(bench.queue.queued(), 6U);
  bench.queue.purge_superseded(*others.front(), bench.now);
  EXPECT_EQ(bench.ended(), (Texts{"300:superseded", "301:superseded", "1:superseded"}));
  EXPECT_EQ(bench.hand_over(), Ids{}) << "nor is any of the others ever sent";
  EXPECT_EQ(bench.queue.queued(), 0U);
}

TEST(TxQueue, EndsWaitingFramesJustAfterTheirDeadline) {
  Bench bench;
  for (std::uint32_t id = 1; id <= 4; ++id) bench.push(id);
  bench.hand_over();
  bench.push(5, options_of(Class::motion, bench.now + 5ms));
  auto guarded = guarded_by(std::make_shared<AxisGate>());
  guarded.guard.not_after = bench.now + 3ms;
  bench.push(6, guarded);
  EXPECT_EQ(bench.queue.next_event(), bench.now + 3ms + 1ns);
  bench.queue.reap(bench.now + 3ms);
  EXPECT_EQ(bench.queue.queued(), 2U);
  bench.queue.reap(bench.queue.next_event());
  EXPECT_EQ(bench.queue.next_event(), bench.now + 5ms + 1ns);
  bench.queue.reap(bench.queue.next_event());
  EXPECT_EQ(bench.ended(), (Texts{"6:expired", "5:expired"}));
}

TEST(TxQueue, IsBoundedAndKeepsRoomForStops) {
  Bench bench;
  for (std::uint32_t id = 1; id <= 9; ++id) bench.push(id);
  EXPECT_EQ(bench.ended(), (Texts{"9:queue_full"}));
  for (std::uint32_t id = 10; id <= 18; ++id) bench.push(id, options_of(Class::stop));
  EXPECT_EQ(bench.ended(), (Texts{"9:queue_full", "18:queue_full"}));
  EXPECT_EQ(bench.queue.queued(), 16U);
}

TEST(TxQueue, TakesNoFrameThatIsNone) {
  Bench bench;
  bench.queue.push({.id = 0x800}, {}, bench.endings.of(1));
  EXPECT_EQ(bench.ended(), (Texts{"1:invalid"}));
}

TEST(TxQueue, StallsWhenNothingIsConfirmedForTheTimeout) {
  Bench bench;
  bench.push(1);
  bench.hand_over();
  bench.now += 60ms;
  bench.push(2);
  bench.hand_over();
  bench.queue.echo(frame_of(1), bench.now, bench.now);  // the second waits since then
  EXPECT_FALSE(bench.queue.stalled(bench.now + 100ms - 1ns));
  EXPECT_EQ(bench.queue.next_event(), bench.now + 100ms);
  EXPECT_TRUE(bench.queue.stalled(bench.now + 100ms));
  bench.queue.end_all();
  EXPECT_FALSE(bench.queue.stalled(bench.now + 1h));
  EXPECT_EQ(bench.queue.next_event(), TimePoint::max());
  EXPECT_EQ(bench.ended(), (Texts{"1:sent", "2:unknown"}));
}

/// Its echo was lost with what the daemon read too late, or the controller lost the frame.
TEST(TxQueue, WhatDoesNotComeBackIsGivenUpOnceTheKernelHoldsNothing) {
  Bench bench;
  bench.push(1);
  bench.hand_over();
  const auto begin = bench.now;
  for (; bench.now < begin + 100ms; bench.now += 10ms) {  // others come back all the time
    EXPECT_FALSE(bench.queue.overdue(bench.now));
    bench.push(2);
    EXPECT_EQ(bench.hand_over(), Ids{2});
    bench.queue.echo(frame_of(2), bench.now, bench.now);
  }
  EXPECT_TRUE(bench.queue.overdue(bench.now));
  EXPECT_FALSE(bench.queue.stalled(bench.now));
  bench.push(3);
  bench.push(4, options_of(Class::stop));
  EXPECT_EQ(bench.hand_over(), Ids{4}) << "nothing but stops, so that the kernel is seen empty";
  bench.queue.give_up_overdue(bench.now);
  EXPECT_FALSE(bench.queue.overdue(bench.now));
  EXPECT_EQ(bench.hand_over(), Ids{3});
  EXPECT_EQ(bench.ended().back(), "1:unknown");
  EXPECT_EQ(bench.queue.unconfirmed(), 2U) << "the stop and the frame behind it";
}

/// It would be sent whenever the controller likes: the link has to go down.
TEST(TxQueue, StallsWhereTheKernelKeepsAFrameThatOthersOvertake) {
  Bench bench;
  bench.push(1);
  bench.hand_over();
  const auto begin = bench.now;
  for (; bench.now < begin + 200ms; bench.now += 10ms) {
    EXPECT_FALSE(bench.queue.stalled(bench.now));
    EXPECT_LE(bench.queue.next_event(), begin + 200ms);
    bench.push(2, options_of(Class::stop));
    EXPECT_EQ(bench.hand_over(), Ids{2});
    bench.queue.echo(frame_of(2), bench.now, bench.now);
  }
  EXPECT_TRUE(bench.queue.stalled(bench.now));
}

TEST(TxQueue, SilenceBeforeTheFirstFrameIsNoStall) {
  Bench bench;
  bench.push(1);
  bench.hand_over();
  bench.queue.echo(frame_of(1), bench.now, bench.now);
  bench.now += 10s;
  bench.push(2);
  bench.hand_over();
  EXPECT_FALSE(bench.queue.stalled(bench.now));
}

TEST(TxQueue, BacksOffWhenTheKernelIsFullAndChoosesAgainAfterwards) {
  Bench bench;
  const auto gate = std::make_shared<AxisGate>();
  bench.push(1, guarded_by(gate));
  ASSERT_NE(bench.queue.next(bench.now), nullptr);
  bench.queue.no_buffer(bench.now);
  EXPECT_EQ(bench.queue.next(bench.now), nullptr);
  EXPECT_EQ(bench.queue.next_event(), bench.now + 1ms);
  bench.now += 1ms;
  ASSERT_NE(bench.queue.next(bench.now), nullptr);
  bench.queue.no_buffer(bench.now);
  EXPECT_EQ(bench.queue.next_event(), bench.now + 2ms);
  gate->raise();
  bench.push(2, options_of(Class::stop));  // does not wait for the back-off
  EXPECT_EQ(bench.hand_over(), (Ids{2}));
  EXPECT_EQ(bench.ended(), (Texts{"1:superseded"}));
}

TEST(TxQueue, StallsWhenTheKernelStaysFull) {
  Bench bench;
  bench.push(1);
  const auto begin = bench.now;
  while (!bench.queue.stalled(bench.now) && bench.now < begin + 1s) {
    if (bench.queue.next(bench.now) != nullptr) bench.queue.no_buffer(bench.now);
    bench.now = bench.queue.next_event();
  }
  EXPECT_EQ(bench.now, begin + 100ms);
  bench.queue.end_all();
  EXPECT_EQ(bench.ended(), (Texts{"1:port_down"}));
}

TEST(TxQueue, AFullKernelIsForgottenWhenNobodyWaitsForRoom) {
  Bench bench;
  bench.push(1, options_of(Class::motion, bench.now + 1ms));
  bench.queue.next(bench.now);
  bench.queue.no_buffer(bench.now);
  bench.now += 10ms;
  EXPECT_EQ(bench.queue.next(bench.now), nullptr);
  EXPECT_FALSE(bench.queue.stalled(bench.now + 1h));
}

TEST(TxQueue, AnEchoWithoutProofWaitsForTheKernelToDrain) {
  Bench bench;
  bench.push(1);
  bench.push(2);
  bench.hand_over();
  EXPECT_TRUE(bench.queue.echo(frame_of(1), bench.now, bench.now, false));
  EXPECT_TRUE(bench.queue.awaits_drain());
  EXPECT_EQ(bench.queue.unconfirmed(), 2U);
  EXPECT_EQ(bench.queue.next_event(), bench.now + 1ms);
  bench.queue.drained(bench.now + 1ms);
  EXPECT_FALSE(bench.queue.awaits_drain());
  EXPECT_EQ(bench.ended(), (Texts{"1:sent"}));
  EXPECT_EQ(bench.endings.results().at(0).sent_at, bench.now + 1ms);
  EXPECT_TRUE(bench.queue.echo(frame_of(2), bench.now + 2ms, bench.now + 2ms, false));
  EXPECT_TRUE(bench.queue.stalled(bench.now + 101ms));  // never drained
  bench.queue.end_all();
  EXPECT_EQ(bench.ended(), (Texts{"1:sent", "2:unknown"}));
}

// Whatever happens in whatever order: one end each, and never a frame handed over after its end.
TEST(TxQueue, EveryFrameEndsOnce) {
  std::mt19937 random(20240611);
  for (int round = 0; round < 200; ++round) {
    Bench bench;
    const auto gate = std::make_shared<AxisGate>();
    std::uint32_t id = 0;
    std::deque<Frame> wire;
    for (int step = 0; step < 200; ++step) {
      bench.now += Duration(random() % 3'000'000);
      switch (random() % 8) {
        case 0:
        case 1:
          bench.push(++id, guarded_by(gate));
          break;
        case 2:
          bench.push(
              ++id, options_of(static_cast<Class>(random() % 6), bench.now + Duration(random() % 9'000'000)));
          break;
        case 3:
          if (random() % 8 == 0) gate->raise();
          break;
        case 4:
          if (const auto* frame = bench.queue.next(bench.now)) {
            wire.push_back(*frame);
            bench.queue.handed_over(bench.now);
          }
          break;
        case 5:
          if (bench.queue.next(bench.now) != nullptr) bench.queue.no_buffer(bench.now);
          break;
        case 6:
          if (wire.empty()) break;
          bench.queue.echo(wire.front(), bench.now, bench.now);
          wire.pop_front();
          break;
        default:
          if (random() % 16 == 0) bench.queue.end_all();
          bench.queue.reap(bench.now);
      }
      ASSERT_LE(bench.queue.unconfirmed(), 4U);
    }
    bench.queue.end_all();
    std::vector<int> ends(id + 1, 0);
    for (const auto& text : bench.ended()) ++ends.at(std::stoul(text));
    for (std::uint32_t each = 1; each <= id; ++each) ASSERT_EQ(ends[each], 1) << each;
  }
}

}  // namespace
}  // namespace axisd::can
