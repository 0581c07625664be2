#include "buses/canopen/sdo_client.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "network.hpp"

namespace axisd::canopen {
namespace {

using namespace test;
using testing::ElementsAre;
using testing::HasSubstr;

constexpr Object control{0x6040, 0}, status{0x6041, 0}, name{0x1008, 0}, device_type{0x1000, 0};

TEST(SdoClient, ReadsAndWrites) {
  Network net;
  net.servers[1].objects = {{status, {0x0237, 2}}, {control, {0, 2}}};
  net.upload("read", 1, status);
  net.download("write", 1, control, {0x0F, 0});
  net.world.run_for(10ms);
  EXPECT_THAT(net.port->log, ElementsAre("601#4041600000000000", "601#2B4060000F000000"));
  EXPECT_THAT(net.results.at("read")->bytes, ElementsAre(0x37, 0x02));
  EXPECT_TRUE(net.results.at("write"));
  EXPECT_EQ(net.servers[1].objects[control].value, 0x0FU);
}

TEST(SdoClient, ManyNodesInParallelOneTransferEach) {
  Network net;
  net.turnaround = 5ms;
  for (std::uint8_t node = 1; node <= 32; ++node) {
    net.servers[node].objects[status] = {node, 2};
    for (int i = 0; i < 2; ++i) net.upload(std::to_string(node) + "." + std::to_string(i), node, status);
  }
  net.world.run_for(3ms);
  EXPECT_EQ(net.port->log.size(), 32U);
  net.world.run_for(10ms);
  EXPECT_EQ(net.results.size(), 64U);
  EXPECT_EQ(net.results.at("32.1")->bytes.at(0), 32);
}

TEST(SdoClient, AnAbortNamesItsPlaceAndItsCause) {
  Network net;
  net.servers[7];
  net.upload("read", 7, status);
  net.world.run_for(10ms);
  const auto& error = net.results.at("read").error();
  EXPECT_EQ(error.outcome, Outcome::refused);
  EXPECT_EQ(error.where.bus, "can0");
  EXPECT_EQ(error.where.node, 7);
  EXPECT_EQ(error.where.object, 0x604100U);
  EXPECT_EQ(error.where.native_code, 0x06020000U);
  EXPECT_EQ(net.master->sdo().counters().aborted_by_node, 1U);
}

TEST(SdoClient, CountsHowTransfersEndByClass) {
  Network net;
  net.servers[1].objects = {{status, {0x0237, 2}}};
  net.upload("read", 1, status);
  net.upload("unknown object", 1, name);
  net.upload("silent", 2, status, {.attempts = 1});
  net.world.run_for(1s);
  const auto counted = net.master->sdo().classes().at(std::to_underlying(TransactionClass::parameters));
  EXPECT_EQ(counted.ends.answered, 1U);
  EXPECT_EQ(counted.ends.refused, 1U);
  EXPECT_EQ(counted.ends.no_reply, 1U);
  EXPECT_EQ(counted.ends.damaged + counted.ends.failed, 0U);
  EXPECT_EQ(counted.sent, 3U);
}

TEST(SdoClient, ATimeoutIsFollowedByAnAbortAndADownloadIsNotRepeated) {
  Network net;
  net.download("write", 1, control, {0x1F, 0});
  net.world.run_for(1s);
  EXPECT_THAT(net.port->log, ElementsAre("601#2B4060001F000000", "601#8040600000000405"));
  EXPECT_EQ(net.results.at("write").error().reason, Reason::no_reply);
  EXPECT_EQ(net.results.at("write").error().outcome, Outcome::unknown);
  EXPECT_EQ(net.port->times[1] - net.port->times[0], 100ms + net.port->frame_time);
}

TEST(SdoClient, ADownloadThatMayHappenTwiceStaysUnknownWhenARepetitionIsNotSent) {
  Network net;
  net.download("write", 1, control, {0x06, 0}, {.attempts = 2});
  net.world.run_for(1s);
  // The repetition is preceded by a read, which is not answered either.
  EXPECT_EQ(net.port->log.at(2), "601#4000100000000000");
  EXPECT_EQ(net.port->log.size(), 4U);
  EXPECT_EQ(net.results.at("write").error().outcome, Outcome::unknown);
}

TEST(SdoClient, AnUploadIsRepeatedAfterTheNodeIsInStepAgain) {
  Network net;
  auto& server = net.servers[1];
  server.objects = {{status, {0x0237, 2}}, {device_type, {402, 4}}};
  server.answers = false;
  net.upload("read", 1, status);
  net.world.run_for(50ms);
  server.answers = true;
  net.world.run_for(200ms);
  EXPECT_THAT(net.port->log, ElementsAre("601#4041600000000000", "601#8041600000000405",
                                         "601#4000100000000000", "601#4041600000000000"));
  EXPECT_THAT(net.results.at("read")->bytes, ElementsAre(0x37, 0x02));
}

/// Whenever the late reply comes, the second read gives the second value.
TEST(SdoClient, ALateReplyNeverAnswersAnotherRequest) {
  for (const bool same : {true, false}) {
    for (int delay = 90; delay < 140; ++delay) {
      Network net({.upload_attempts = 1});
      const Object second = same ? status : control;
      int asked = 0;
      net.port->on_sent = [&](const can::Frame& frame) {
        if (frame.data[0] != 0x40) return;
        ++asked;
        // Answers in order: nothing overtakes the late one.
        const auto late = std::chrono::milliseconds(asked == 1 ? delay : std::max(delay - 101, 1) + asked);
        net.reply_after(
            late, 1, {0x4B, frame.data[1], frame.data[2], frame.data[3], static_cast<std::uint8_t>(asked)});
      };
      net.upload("first", 1, status);
      net.upload("second", 1, second);
      net.world.run_for(1s);
      ASSERT_EQ(net.results.size(), 2U);
      ASSERT_TRUE(net.results.at("second")) << delay;
      EXPECT_EQ(net.results.at("second")->bytes.at(0), asked) << delay << same;
      if (net.results.at("first")) EXPECT_EQ(net.results.at("first")->bytes.at(0), 1);
    }
  }
}

TEST(SdoClient, AStopIsNotHeldBackButSaysThatItsAnswerIsAmbiguous) {
  Network net;
  net.servers[1].objects = {{control, {0, 2}}};
  net.servers[1].answers = false;
  net.download("first", 1, control, {0x1F, 0});
  net.world.run_for(150ms);
  net.servers[1].answers = true;
  net.download("stop", 1, control, {0x0F, 1}, {.transaction_class = TransactionClass::stop});
  net.world.run_for(50ms);
  EXPECT_EQ(net.port->log.back(), "601#2B4060000F010000");
  EXPECT_TRUE(net.results.at("stop")->ambiguous);
}

TEST(SdoClient, AStopCutsWhatIsUnderWayAfterTheTurnaround) {
  Network net;
  net.servers[1].objects = {{control, {0, 2}}};
  net.port->on_sent = [&](const can::Frame& frame) {
    if (frame.data[0] != 0x40) net.serve(frame);  // reads are never answered
  };
  net.upload("read", 1, status);
  net.world.run_for(2ms);
  net.download("stop", 1, control, {0x0F, 1}, {.transaction_class = TransactionClass::stop});
  net.world.run_for(50ms);
  // Nothing is open in a server that has not answered: no abort, which might cost it the stop.
  EXPECT_THAT(net.port->log, ElementsAre("601#4041600000000000", "601#2B4060000F010000"));
  EXPECT_EQ(net.port->times[1] - net.port->times[0], 10ms + net.port->frame_time);
  EXPECT_TRUE(net.results.at("stop"));
  EXPECT_FALSE(net.results.at("stop")->ambiguous);
  EXPECT_EQ(net.results.at("read").error().reason, Reason::superseded);
}

/// Both nodes have answered; then node 2 does not for a while, and after 25 ms node 1 is asked.
struct Overdue {
  Network net;

  explicit Overdue(Duration usual = 1ms) {
    net.servers[1].objects = {{status, {0, 2}}, {control, {0, 2}}};
    net.servers[2].objects = {{status, {0, 2}}};
    net.upload("first", 1, status);
    net.turnaround = usual;
    net.upload("second", 2, status);
    net.world.run_for(1ms + usual);
    net.servers[2].answers = false;
    net.upload("overdue", 2, status);
    net.world.run_for(25ms);
    net.turnaround = 1ms;
    net.port->log.clear();
  }
  void ask(TransactionClass transaction_class) {
    net.upload("asked", 1, status, {.transaction_class = transaction_class});
  }
  [[nodiscard]] bool sent() const { return !net.port->log.empty(); }
};

TEST(SdoClient, YieldsToTheOverdueReplyOfAnotherNode) {
  for (const auto own_class : {TransactionClass::motion, TransactionClass::parameters}) {
    Overdue rig;
    rig.ask(own_class);
    rig.net.world.run_for(5ms);
    EXPECT_FALSE(rig.sent());
    rig.net.reply_after({}, 2, {0x4B, 0x41, 0x60, 0, 0, 0, 0, 0});
    rig.net.world.run_for(1ms);
    EXPECT_TRUE(rig.net.results.contains("overdue"));
    EXPECT_TRUE(rig.sent());
  }
}

TEST(SdoClient, YieldsNoLongerThan20Milliseconds) {
  Overdue rig;
  rig.ask(TransactionClass::parameters);
  rig.net.world.run_for(14ms);
  EXPECT_FALSE(rig.sent());
  rig.net.world.run_for(2ms);
  EXPECT_TRUE(rig.sent());
}

TEST(SdoClient, WhatStopsYieldsToNobody) {
  for (const auto own_class : {TransactionClass::stop, TransactionClass::moving_state}) {
    Overdue rig;
    rig.ask(own_class);
    rig.net.world.run_for(1ms);
    EXPECT_TRUE(rig.sent());
  }
}

/// Nor is a node overdue that takes its time as a rule, or that has ceased to answer.
TEST(SdoClient, ASlowNodeDelaysNobody) {
  Overdue slow(30ms);
  slow.ask(TransactionClass::parameters);
  slow.net.world.run_for(1ms);
  EXPECT_TRUE(slow.sent());

  Overdue silent;
  silent.net.world.run_for(200ms);  // two attempts
  silent.net.upload("again", 2, name);
  silent.net.world.run_for(25ms);
  silent.net.port->log.clear();
  silent.ask(TransactionClass::parameters);
  silent.net.world.run_for(1ms);
  EXPECT_TRUE(silent.sent());
}

TEST(SdoClient, ClassesGoInOrderAndNoneStarves) {
  Network net;
  net.servers[1].objects = {{status, {0, 2}}, {control, {0, 2}}, {name, {0, 4}}};
  net.upload("begun", 1, status);
  for (int i = 0; i < 12; ++i)
    net.upload("state" + std::to_string(i), 1, status, {.transaction_class = TransactionClass::moving_state});
  net.upload("parameter", 1, name);
  net.download("stop", 1, control, {0, 0}, {.transaction_class = TransactionClass::stop});
  net.world.run_for(100ms);
  ASSERT_EQ(net.port->log.size(), 15U);
  EXPECT_EQ(net.port->log[1], "601#2B40600000000000");
  const auto parameter = std::ranges::find(net.port->log, "601#4008100000000000");
  EXPECT_EQ(parameter - net.port->log.begin(), 2 + 7);
}

TEST(SdoClient, ARaisedGateIsNeverSent) {
  Network net;
  const auto gate = std::make_shared<AxisGate>();
  const MotionGuard guard{.gate = gate, .epoch = gate->epoch()};
  net.servers[1].objects = {{status, {0, 2}}, {control, {0, 2}}};
  net.upload("read", 1, status);
  net.download("queued", 1, control, {0x1F, 0},
               {.transaction_class = TransactionClass::motion, .guard = guard});
  net.download("bound", 2, control, {0x1F, 0},
               {.transaction_class = TransactionClass::motion, .guard = guard});
  net.world.run_for(50us);
  gate->raise();
  for (const std::uint8_t node : {1, 2}) net.master->purge_superseded(node, *gate);
  net.world.run_for(100ms);
  EXPECT_THAT(net.port->log, ElementsAre("601#4041600000000000"));
  for (const auto* which : {"queued", "bound"}) {
    EXPECT_EQ(net.results.at(which).error().reason, Reason::superseded);
    EXPECT_EQ(net.results.at(which).error().outcome, Outcome::not_sent);
  }
  EXPECT_EQ(net.port->purges, 2);
}

TEST(SdoClient, ADeadlineEndsWhatWaits) {
  Network net;
  net.upload("silent", 1, status);
  net.upload("waits", 1, control, {.deadline = net.world.now() + 20ms});
  net.world.run_for(21ms);
  EXPECT_EQ(net.results.at("waits").error().reason, Reason::expired);
  net.world.run_for(1s);
}

TEST(SdoClient, ASegmentedUploadThatNeverEndsIsBounded) {
  for (const bool empty : {true, false}) {
    Network net;
    int segments = 0;
    net.port->on_sent = [&](const can::Frame& frame) {
      if (frame.data[0] == 0x40) net.reply_after(1ms, 1, {0x40, 0x08, 0x10, 0});
      if (frame.data[0] >> 5U != 3) return;
      ++segments;
      net.reply_after(1ms, 1, {static_cast<std::uint8_t>((frame.data[0] & 0x10) | (empty ? 0x0E : 0x00))});
    };
    const auto begin = net.world.now();
    net.upload("endless", 1, name);
    net.world.run_until([&] { return net.results.contains("endless"); }, 10s);
    EXPECT_LE(net.world.now() - begin, 2001ms);
    const auto& error = net.results.at("endless").error();
    EXPECT_EQ(error.reason, empty ? Reason::no_reply : Reason::out_of_range);
    EXPECT_THAT(error.message, HasSubstr(empty ? "did not end in time" : "at most 4096"));
    net.world.run_for(1ms);
    EXPECT_EQ(net.port->log.back(), empty ? "601#8008100000000405" : "601#8008100005000405");
  }
}

TEST(SdoClient, SegmentsBothWays) {
  Network net;
  net.port->on_sent = [&](const can::Frame& frame) {
    switch (frame.data[0]) {
      case 0x40:
        return net.reply_after(1ms, 1, {0x41, 0x08, 0x10, 0, 9});
      case 0x60:
        return net.reply_after(1ms, 1, {0x00, 'Y', 'S', 'S', '-', 'C', ' ', 'v'});
      case 0x70:
        return net.reply_after(1ms, 1, {0x1B, '1', '1'});
      case 0x21:
        return net.reply_after(1ms, 1, {0x60, 0x08, 0x10, 0});
      case 0x00:
        return net.reply_after(1ms, 1, {0x20});
      default:
        return net.reply_after(1ms, 1, {0x30});
    }
  };
  net.upload("up", 1, name);
  net.download("down", 1, name, {1, 2, 3, 4, 5, 6, 7, 8});
  net.world.run_for(50ms);
  const auto& bytes = net.results.at("up")->bytes;
  EXPECT_EQ(std::string(bytes.begin(), bytes.end()), "YSS-C v11");
  EXPECT_TRUE(net.results.at("down"));
  EXPECT_EQ(net.port->log.back(), "601#1D08000000000000");
}

TEST(SdoClient, ABootEndsWhatWasUnderWayButKeepsAStop) {
  Network net;
  ASSERT_TRUE(net.master->add_node(1));
  net.servers[1].objects = {{control, {0, 2}}};
  net.servers[1].answers = false;
  net.download("write", 1, control, {6, 0});
  net.upload("waits", 1, status);
  net.world.run_for(5ms);
  net.download("stop", 1, control, {0, 0}, {.transaction_class = TransactionClass::stop});
  net.world.run_for(1ms);
  net.servers[1].answers = true;
  net.port->receive(0x701, Bytes{0});
  net.world.run_for(5ms);
  EXPECT_EQ(net.results.at("write").error().reason, Reason::rebooted);
  EXPECT_EQ(net.results.at("write").error().outcome, Outcome::unknown);
  EXPECT_EQ(net.results.at("waits").error().outcome, Outcome::not_sent);
  EXPECT_FALSE(net.results.at("stop")->ambiguous);
}

TEST(SdoClient, WithoutALinkEverythingEnds) {
  Network net;
  net.download("write", 1, control, {6, 0});
  net.upload("waits", 1, status);
  net.world.run_for(5ms);
  net.port->set_link(can::InterfaceState::bus_off);
  net.upload("later", 1, status);
  net.world.run_for(5ms);
  EXPECT_EQ(net.results.at("write").error().outcome, Outcome::unknown);
  EXPECT_EQ(net.results.at("waits").error().outcome, Outcome::not_sent);
  for (const auto& [key, result] : net.results) EXPECT_EQ(result.error().reason, Reason::bus_down) << key;
  EXPECT_EQ(net.results.size(), 3U);
}

TEST(SdoClient, BoundsItsQueueAndChecksItsArguments) {
  Network net({.queue_limit = 4});
  for (int i = 0; i < 6; ++i) net.upload(std::to_string(i), 1, status);
  net.upload("node", 0, status);
  net.download("empty", 1, control, {});
  net.world.run_for(1ms);
  EXPECT_EQ(net.results.at("5").error().reason, Reason::busy);
  EXPECT_EQ(net.results.at("node").error().reason, Reason::invalid_argument);
  EXPECT_EQ(net.results.at("empty").error().reason, Reason::invalid_argument);
  EXPECT_EQ(net.port->log.size(), 1U);
}

TEST(SdoClient, ClosingEndsEverything) {
  Network net;
  net.upload("read", 1, status);
  net.upload("waits", 1, control);
  net.world.run_for(1ms);
  net.master->close();
  net.world.run_for(1ms);
  EXPECT_EQ(net.results.at("read").error().reason, Reason::cancelled);
  EXPECT_EQ(net.results.at("waits").error().reason, Reason::cancelled);
}

TEST(LateReplies, AlwaysFindAnotherObjectUntilAllAreTried) {
  LateReplies late;
  const TimePoint now{1h};
  std::set<Object> tried;
  while (const auto probe = late.probe(now)) {
    ASSERT_TRUE(tried.insert(*probe).second);
    late.expect(*probe, now);
  }
  EXPECT_EQ(tried.size(), 4U + 254U);
  EXPECT_TRUE(late.probe(now + LateReplies::latest + 1ns));
  late.forget();
  EXPECT_FALSE(late.may_come(device_type, now));
}

TEST(SdoClient, TwoNodesWithOneNodeIdAnswerEachRequestTwice) {
  Network net;
  net.servers[1].objects[status] = {0x0237, 2};
  net.servers[1].objects[device_type] = {0x00040192, 4};
  const auto read = [&](bool twice) {
    net.port->on_sent = [&net, twice](const can::Frame& frame) {
      for (int i = 0; i < (twice ? 2 : 1); ++i) net.serve(frame);
    };
    for (const auto object : {status, device_type}) {
      net.upload("read", 1, object);
      net.world.run_for(10ms);
    }
  };
  read(false);
  EXPECT_FALSE(net.master->sdo().answers_twice(1));
  read(true);
  EXPECT_FALSE(net.master->sdo().answers_twice(1)) << "twice is no habit";
  read(true);
  EXPECT_TRUE(net.master->sdo().answers_twice(1));
  EXPECT_EQ(net.master->sdo().counters().unexpected_replies, 4U);
  for (int i = 0; i < 6; ++i) read(false);
  EXPECT_FALSE(net.master->sdo().answers_twice(1)) << "one of them is gone";
}

TEST(SdoClient, ASecondNodeWithTheSameNodeIdMayBeSlowerByManyRequests) {
  Network net;
  net.servers[1].objects[status] = {0x0237, 2};
  net.servers[1].objects[device_type] = {0x00040192, 4};
  std::vector<can::Frame> asked;
  net.port->on_sent = [&](const can::Frame& frame) {
    asked.push_back(frame);
    net.serve(frame);
  };
  for (int i = 0; i < 10; ++i) {
    net.upload("read", 1, i % 2 == 0 ? status : device_type);
    net.world.run_for(10ms);
  }
  EXPECT_FALSE(net.master->sdo().answers_twice(1));
  for (const auto& frame : asked) net.serve(frame);  // the second node
  net.world.run_for(10ms);
  EXPECT_TRUE(net.master->sdo().answers_twice(1));
}

TEST(SdoClient, LateRepliesAreNoSecondNode) {
  Network net;
  net.servers[1].objects[status] = {0x0237, 2};
  net.turnaround = 150ms;  // each comes after its request was given up
  for (int i = 0; i < 6; ++i) {
    net.upload("read", 1, status, {.attempts = 1});
    net.world.run_for(400ms);
  }
  EXPECT_GE(net.master->sdo().counters().timeouts, 4U);
  EXPECT_FALSE(net.master->sdo().answers_twice(1));
}

}  // namespace
}  // namespace axisd::canopen
