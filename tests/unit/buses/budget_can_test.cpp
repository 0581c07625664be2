// The response times of CAN against the paper's example, and the bounds of a network against what happens on
// it.
#include "buses/budget_can.hpp"

#include <gtest/gtest.h>

#include <memory>
#include <random>
#include <set>
#include <vector>

#include "buses/can/network.hpp"
#include "buses/can/response_time.hpp"
#include "buses/canopen/cob.hpp"
#include "tests/support/virtual_world.hpp"

namespace axisd::canopen {
namespace {

using namespace std::chrono_literals;
using axisd::test::VirtualWorld;

NetworkDemand demand_of(int axes, std::uint32_t bitrate, Duration sync_period) {
  NetworkDemand demand{.network = {.name = "can0", .interface = "sim", .bitrate = bitrate}, .axes = {}};
  demand.network.sync_period = sync_period;
  for (int i = 0; i < axes; ++i)
    demand.axes.push_back({.name = "axis" + std::to_string(i + 1),
                           .node = static_cast<std::uint8_t>(i + 1),
                           .set = {.state_pdos = {8, 7},
                                   .pdo_inhibit = 10ms,
                                   .pdo_event = 20ms,
                                   .state_transfers = 8,
                                   .continuity_transfers = 5,
                                   .drift_transfers = 30,
                                   .stop_transfers = 4},
                           .poll_moving = 20ms,
                           .poll_idle = 200ms,
                           .continuity_period = 800ms,
                           .drift_check = 10s});
  return demand;
}

/// A network under the whole load of its demand. What can come at once does every 100 ms: half a period
/// behind a SYNC the TPDOs that it asked for, the EMCY of all nodes, and the replies to SDO requests, which
/// nodes hold back until then. The next TPDOs come with the next SYNC.
class Loaded {
 public:
  Loaded(const NetworkDemand& demand, unsigned seed)
      : demand_(demand),
        engine_(seed),
        network_(world_.clock(), demand.network.bitrate),
        port_(world_.clock(), {.bus = "can0", .interface = "sim", .window = demand.window}, network_) {
    for (const auto& axis : demand.axes)
      ids_.push_back(network_.join([this, &axis](const can::Frame& frame, TimePoint, bool own) {
        if (!own) on_frame(axis, frame);
      }));
    port_.start({.on_frame = [this](const can::ReceivedFrame& one) { on_reply(one.frame); },
                 .on_state = [](const can::PortState&) {}});
    every(demand.network.sync_period, {}, [this] {
      ++syncs_;
      send(sync_id, 0, TransactionClass::motion);
    });
    every(burst_period, demand.network.sync_period / 2, [this] {
      ++bursts_;
      for (const auto& axis : demand_.axes) {
        transmit(axis.node, emergency_id(axis.node), 8);
        answer(axis);
      }
    });
    for (const auto& axis : demand.axes) {
      every(250ms, random(0, 250) * 1ms, [this, node = axis.node] { transmit(node, heartbeat_id(node), 1); });
      request(axis.node);
    }
    world_.run_for(100ms);
  }

  int random(int least, int most) { return std::uniform_int_distribution(least, most)(engine_); }
  void run_for(Duration time) { world_.run_for(time); }
  void wait_for_burst() {
    EXPECT_TRUE(world_.run_until([this, before = bursts_] { return bursts_ != before; }, 1s));
  }

  /// How long the last of so many stop frames took, all asked for now.
  Duration stop(int axes) {
    const auto asked = world_.now();
    for (std::size_t i = 0; i < demand_.window; ++i)  // timed out, and asked again
      request(demand_.axes[i % demand_.axes.size()].node);
    int left = axes;
    Duration longest{};
    for (int i = 0; i < axes; ++i)
      port_.send(frame_of(rpdo_id(1, demand_.axes[static_cast<std::size_t>(i)].node), 2),
                 {.transaction_class = TransactionClass::stop}, [&](const can::SendResult& result) {
                   EXPECT_EQ(result.status, can::SendStatus::sent);
                   longest = std::max(longest, result.sent_at - asked);
                   --left;
                 });
    EXPECT_TRUE(world_.run_until([&] { return left == 0; }, 10s));
    return longest;
  }

 private:
  static constexpr Duration burst_period = 100ms;
  static can::Frame frame_of(std::uint32_t id, int bytes) {
    return can::make_frame(id, std::vector<std::uint8_t>(static_cast<std::size_t>(bytes)));
  }
  void every(Duration period, Duration phase, std::function<void()> action) {
    const auto index = timers_.size();
    timers_.emplace_back();
    arm(index, world_.now() + phase, period, std::move(action));
  }
  void arm(std::size_t index, TimePoint when, Duration period, std::function<void()> action) {
    timers_[index] = world_.clock().call_at(when, [this, index, when, period, action = std::move(action)] {
      action();
      const auto kept = std::move(timers_[index]);  // as long as this runs
      arm(index, when + period, period, action);
    });
  }
  void transmit(std::uint8_t node, std::uint32_t id, int bytes) {
    network_.transmit(ids_.at(node - 1U), frame_of(id, bytes));
  }
  void send(std::uint32_t id, int bytes, TransactionClass transaction_class) {
    port_.send(frame_of(id, bytes), {.transaction_class = transaction_class}, [](const can::SendResult&) {});
  }
  void request(std::uint8_t node) { send(sdo_request_id(node), 8, TransactionClass::idle_state); }

  void on_frame(const AxisDemand& axis, const can::Frame& frame) {
    if (frame.id == sdo_request_id(axis.node)) asked_.insert(axis.node);
    const bool before_burst = syncs_ % (burst_period / demand_.network.sync_period) == 1;
    if (frame.id == sync_id && !before_burst) answer(axis);
  }
  void answer(const AxisDemand& axis) {
    for (unsigned i = 0; i < 2; ++i)
      transmit(axis.node, tpdo_id(i + 1, axis.node), axis.set.state_pdos.at(i));
    if (asked_.erase(axis.node) > 0) transmit(axis.node, sdo_reply_id(axis.node), 8);
  }
  void on_reply(const can::Frame& frame) {
    const auto cob = classify(frame.id);
    if (cob.service == Service::sdo_reply) request(cob.node);
  }

  const NetworkDemand& demand_;
  std::mt19937 engine_;
  VirtualWorld world_;
  can::Network network_;
  can::NetworkPort port_;
  std::vector<can::Network::Id> ids_;
  std::vector<Clock::Timer> timers_;
  std::set<std::uint8_t> asked_;  ///< by SDO, and not answered yet
  int bursts_ = 0;
  std::int64_t syncs_ = 0;
};

// The paper's example: 125 kbit/s, 125 bits each; the third message's second instance is the
// later one, which the analysis before it did not see.
TEST(CanResponseTime, TheExampleThatTheEarlierAnalysisGotWrong) {
  const std::vector<can::Stream> messages = {{.id = 1, .transmission = 1ms, .period = 2500us},
                                             {.id = 2, .transmission = 1ms, .period = 3500us},
                                             {.id = 3, .transmission = 1ms, .period = 3500us}};
  EXPECT_EQ(can::response_time(messages, 0, 125'000, 1s), 2ms);
  EXPECT_EQ(can::response_time(messages, 1, 125'000, 1s), 3ms);
  EXPECT_EQ(can::response_time(messages, 2, 125'000, 1s), 3500us);
}

TEST(CanResponseTime, AnOverloadedNetworkHasNoBound) {
  const std::vector<can::Stream> messages = {{.id = 1, .transmission = 1ms, .period = 1500us},
                                             {.id = 2, .transmission = 1ms, .period = 2ms}};
  EXPECT_EQ(can::response_time(messages, 1, 125'000, 1s), std::nullopt);
  EXPECT_EQ(can::response_time(messages, 0, 125'000, 1s), 2ms);
}

TEST(CanResponseTime, AFrameIsAsLongAsItsStuffBitsAllow) {
  EXPECT_EQ(can::frame_time(8, 1'000'000), 135us);
  EXPECT_EQ(can::frame_time(0, 500'000), 110us);
}

TEST(CanBudget, StopsComeAsSoonAsPredictedAndNotMuchSooner) {
  struct Case {
    int axes;
    std::uint32_t bitrate;
    Duration sync_period;
  };
  for (const auto& [axes, bitrate, sync_period] : {Case{1, 1'000'000, 10ms}, Case{16, 1'000'000, 10ms},
                                                   Case{32, 500'000, 50ms}, Case{4, 125'000, 50ms}}) {
    const auto demand = demand_of(axes, bitrate, sync_period);
    const auto budget = budget_of(demand);
    Duration one{}, all{};
    for (unsigned seed = 1; seed <= 2; ++seed) {
      Loaded network(demand, seed);
      for (int stop = 0; stop < 24; ++stop) {
        if (stop % 3 != 0) network.wait_for_burst();
        network.run_for(network.random(0, stop % 3 == 0 ? 30'000 : 100) * 1us);
        if (stop % 2 == 0)
          one = std::max(one, network.stop(1));
        else
          all = std::max(all, network.stop(axes));
      }
    }
    EXPECT_LE(one + BudgetPolicy{}.host_allowance, budget.stops.front().last_frame)
        << axes << " at " << bitrate;
    EXPECT_LE(all + BudgetPolicy{}.host_allowance, budget.stops.back().last_frame)
        << axes << " at " << bitrate;
    if (axes == 1) continue;  // its request and its reply never wait at once
    EXPECT_GE(2 * one, budget.stops.front().last_frame - BudgetPolicy{}.host_allowance)
        << axes << " at " << bitrate;
    EXPECT_GE(2 * all, budget.stops.back().last_frame - BudgetPolicy{}.host_allowance)
        << axes << " at " << bitrate;
  }
}

TEST(CanBudget, WithoutPdosEverythingTakesLonger) {
  auto demand = demand_of(8, 1'000'000, 10ms);
  const auto by_pdo = budget_of(demand);
  ASSERT_EQ(by_pdo.notes.size(), 1U);
  EXPECT_NE(by_pdo.notes.front().find("refuse their PDOs"), std::string::npos);
  demand.by_sdo = true;
  const auto by_sdo = budget_of(demand);
  EXPECT_GT(by_sdo.stops.back().last_frame, by_pdo.stops.back().last_frame);
  EXPECT_GT(by_sdo.load.back().refresh_moving, by_pdo.load.back().refresh_moving);
  EXPECT_GT(by_sdo.load.back().utilisation, by_sdo.load.front().utilisation)
      << "moving axes are polled faster";
}

TEST(CanBudget, MoreThanTheNetworkCarriesHasNoBound) {
  const auto budget = budget_of(demand_of(32, 125'000, 10ms));
  EXPECT_GT(budget.load.front().utilisation, 1);
  EXPECT_EQ(budget.stops.back().last_frame, Duration::max());
}

}  // namespace
}  // namespace axisd::canopen
