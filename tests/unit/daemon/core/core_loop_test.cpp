#include "daemon/core/core_loop.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <functional>
#include <memory>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#include "buses/signal.hpp"

namespace axisd::core {
namespace {

using namespace std::chrono_literals;
using Texts = std::vector<std::string>;

TEST(CoreLoop, WhatIsDueComesBeforeHandlersThatWait) {
  CoreLoop loop;
  Texts order;
  Clock::Timer timer;
  post(loop.executor(), [&] {
    order.emplace_back("frames");
    timer = loop.clock().call_at(loop.clock().now(), [&] { order.emplace_back("cycle"); });
  });
  post(loop.executor(), [&] { order.emplace_back("more frames"); });
  post(loop.executor(), [&] { loop.stop(); });
  loop.run();
  EXPECT_EQ(order, (Texts{"frames", "cycle", "more frames"}));
}

TEST(CoreLoop, AStopComesBeforeWhatIsDue) {
  CoreLoop loop;
  const auto gate = std::make_shared<AxisGate>();
  Texts order;
  Clock::Timer timer;
  post(loop.executor(), [&] {
    timer = loop.clock().call_at(loop.clock().now(), [&] {
      order.emplace_back("cycle");
      loop.stop();
    });
    loop.lane().request({gate}, [&] { order.emplace_back("stop"); });
  });
  loop.run();
  EXPECT_EQ(order, (Texts{"stop", "cycle"}));
}

TEST(CoreLoop, SleepsUntilSomethingIsDue) {
  CoreLoop loop;
  const auto begun = monotonic_now();
  int cycles = 0;
  Clock::Timer timer;
  std::function<void()> cycle = [&] {
    if (++cycles == 3) return loop.stop();
    timer = loop.clock().call_at(loop.clock().now() + 1ms, cycle);
  };
  cycle();
  loop.run();
  EXPECT_EQ(cycles, 3);
  EXPECT_GE(loop.last_progress(), begun);
}

/// Timers that are always due again leave handlers their turn.
TEST(CoreLoop, WhatIsDueAgainAndAgainStarvesNoHandler) {
  CoreLoop loop;
  Clock::Timer timer;
  std::function<void()> again = [&] { timer = loop.clock().call_at(loop.clock().now(), again); };
  again();
  post(loop.executor(), [&] { loop.stop(); });
  loop.run();
}

/// Handlers that ask for more leave what comes from outside its turn.
TEST(CoreLoop, HandlersThatAskForMoreStarveNoInput) {
  CoreLoop loop;
  std::function<void()> again = [&] { post(loop.executor(), again); };
  bool begun = false;
  post(loop.executor(), [&] {
    begun = true;
    again();
  });
  std::thread outside([&] { post(loop.executor(), [&] { loop.stop(); }); });
  loop.run();
  outside.join();
  EXPECT_TRUE(begun);
}

TEST(CoreLoop, AStopGoesBetweenTwoHandlersThatAreReady) {
  CoreLoop loop;
  const auto gate = std::make_shared<AxisGate>();
  Texts order;
  post(loop.executor(), [&] {
    post(loop.executor(), [&] {
      order.emplace_back("first");
      std::thread([&] { loop.lane().request({gate}, [&] { order.emplace_back("stop"); }); }).join();
    });
    post(loop.executor(), [&] { order.emplace_back("second"); });
    post(loop.executor(), [&] { loop.stop(); });
  });
  loop.run();
  EXPECT_EQ(order, (Texts{"first", "stop", "second"}));
}

/// The frames of a stop are not put off by handlers that came before it.
TEST(CoreLoop, AStopIsServedToItsFirstWaitBeforeHandlersThatAreReady) {
  CoreLoop loop;
  Texts order;
  const auto sequence = [&]() -> Task<> {
    order.emplace_back("stop frame");
    co_return;
  };
  post(loop.executor(), [&] {
    post(loop.executor(), [&] { order.emplace_back("ready"); });
    loop.lane().request({std::make_shared<AxisGate>()}, [&] { spawn(loop.executor(), sequence(), "stop"); });
    post(loop.executor(), [&] { loop.stop(); });
  });
  loop.run();
  EXPECT_EQ(order, (Texts{"stop frame", "ready"}));
}

/// The worker of a line waits for what is announced, and not longer than until it was served.
TEST(CoreLoop, AStopIsAnnouncedToTheBusesOfItsAxesUntilItWasServed) {
  CoreLoop loop;
  const auto first = std::make_shared<StopNotice>();
  const auto second = std::make_shared<StopNotice>();
  const auto announced = [&] { return std::pair(first->pending(), second->pending()); };
  std::vector<std::pair<bool, bool>> seen{announced()};
  loop.lane().request({std::make_shared<AxisGate>(first), std::make_shared<AxisGate>(first),
                       std::make_shared<AxisGate>(second), std::make_shared<AxisGate>()},
                      [&] { seen.push_back(announced()); });
  seen.push_back(announced());
  post(loop.executor(), [&] { loop.stop(); });
  loop.run();
  seen.push_back(announced());
  EXPECT_EQ(seen,
            (std::vector<std::pair<bool, bool>>{{false, false}, {true, true}, {true, true}, {false, false}}));
}

/// A second stop is sent by the sequence of the first.
TEST(CoreLoop, AStopIsAnnouncedUntilTheSequenceThatWaitedForItHasGoneOn) {
  CoreLoop loop;
  const auto notice = std::make_shared<StopNotice>();
  Signal asked(loop.executor(), loop.clock());
  std::vector<bool> seen;
  const auto sequence = [&]() -> Task<> {
    co_await asked.wait();
    seen.push_back(notice->pending());
  };
  spawn(loop.executor(), sequence(), "stop");
  post(loop.executor(), [&] {
    post(loop.executor(), [] {});
    loop.lane().request({std::make_shared<AxisGate>(notice)}, [&] { asked.notify_all(); });
    post(loop.executor(),
         [&] { post(loop.executor(), [&] { post(loop.executor(), [&] { loop.stop(); }); }); });
  });
  loop.run();
  seen.push_back(notice->pending());
  EXPECT_EQ(seen, (std::vector<bool>{true, false}));
}

/// Each of the stops of a crowd is served, and none of them keeps another client's waiting.
TEST(CoreLoop, ACrowdOfStopsKeepsNoOtherClientsWaiting) {
  CoreLoop loop;
  Texts order;
  const auto ask = [&](const std::string& client, std::size_t axes) {
    std::vector<std::shared_ptr<AxisGate>> gates(axes);
    for (auto& gate : gates) gate = std::make_shared<AxisGate>();
    loop.lane().request(std::move(gates), [&, client] { order.push_back(client); }, client);
  };
  const auto at = [&](const std::string& what) {
    return static_cast<std::size_t>(std::ranges::find(order, what) - order.begin());
  };
  std::size_t crowd = 0;
  post(loop.executor(), [&] {
    for (; crowd < 200; ++crowd) ask("crowd", 1);
    for (; crowd < 220; ++crowd) ask("crowd", 400);
    for (int i = 0; i < 8; ++i) ask("operator", 1);
    ask("panel", 1);
    post(loop.executor(), [&] { order.emplace_back("reply of a drive"); });
  });
  const std::function<void()> end_with_it = [&] {
    if (std::ranges::count(order, std::string("crowd")) == static_cast<std::ptrdiff_t>(crowd) && crowd > 0)
      return loop.stop();
    post(loop.executor(), end_with_it);
  };
  end_with_it();
  loop.run();
  EXPECT_EQ(order.at(0), "crowd");
  EXPECT_EQ(order.at(1), "operator");
  EXPECT_EQ(order.at(2), "panel") << "one of each client, in turn";
  EXPECT_EQ(std::ranges::count(order.begin(), order.begin() + 17, std::string("operator")), 8);
  EXPECT_EQ(at("reply of a drive"), StopLane::share + 9) << "as soon as the crowd has had its share";
  EXPECT_EQ(order.size(), crowd + 8 + 1 + 1);
}

/// In the middle of another's crowd, from another thread.
TEST(CoreLoop, AStopThatComesLaterOvertakesACrowd) {
  CoreLoop loop;
  Texts order;
  const auto gate = std::make_shared<AxisGate>();
  post(loop.executor(), [&] {
    for (int i = 0; i < 500; ++i)
      loop.lane().request(
          {gate},
          [&, i] {
            order.emplace_back("crowd");
            if (i == 100) loop.lane().request({gate}, [&] { order.emplace_back("operator"); }, "operator");
            if (i == 499) loop.stop();
          },
          "crowd");
  });
  loop.run();
  ASSERT_EQ(order.size(), 501U);
  EXPECT_EQ(order.at(101), "operator");
}

/// On one computer all may be one client: a crowd of its stops keeps no StopAll waiting, whoever asks for it.
TEST(CoreLoop, AStopOfTheWholeMachineGoesBeforeACrowdOfTheSameClient) {
  CoreLoop loop;
  Texts order;
  const auto gate = std::make_shared<AxisGate>();
  const auto ask = [&](const std::string& client, StopReach reach, std::function<void()> then = {}) {
    loop.lane().request(
        {gate},
        [&, client, reach, then = std::move(then)] {
          order.push_back(client + (reach == StopReach::machine ? " all" : ""));
          if (then) then();
        },
        client, reach);
  };
  post(loop.executor(), [&] {
    for (int i = 0; i < 10; ++i) ask("crowd", StopReach::named);
    ask("crowd", StopReach::named, [&] {
      ask("crowd", StopReach::machine);
      ask("panel", StopReach::machine);
    });
    for (int i = 0; i < 500; ++i) ask("crowd", StopReach::named);
    ask("panel", StopReach::named);
    ask("operator", StopReach::machine);
    ask("crowd", StopReach::named, [&] { loop.stop(); });
  });
  loop.run();
  ASSERT_EQ(order.size(), 10U + 1 + 2 + 500 + 3);
  EXPECT_EQ(order.at(0), "operator all");
  const auto at = [&](const std::string& what) { return std::ranges::find(order, what) - order.begin(); };
  EXPECT_LE(at("panel"), 2) << "in turn";
  EXPECT_LE(at("panel all"), 14) << "behind what was served when it came";
  EXPECT_LE(at("crowd all"), 14);
}

TEST(CoreLoop, StopsThatWaitAreCountedForEachClientUntilTheyAreServed) {
  CoreLoop loop;
  const auto gate = std::make_shared<AxisGate>();
  auto& lane = loop.lane();
  std::vector<std::size_t> seen;
  lane.request({gate, gate, gate}, [&] { seen.push_back(lane.waiting("crowd")); }, "crowd");
  lane.request({gate}, [] {}, "crowd", StopReach::machine);
  lane.request({}, [] {}, "panel");
  EXPECT_EQ(lane.waiting("crowd"), 4U);
  EXPECT_EQ(lane.waiting("panel"), 1U);
  EXPECT_EQ(lane.waiting("nobody"), 0U);
  post(loop.executor(), [&] { loop.stop(); });
  loop.run();
  EXPECT_EQ(seen, std::vector<std::size_t>{3}) << "that of the whole machine has been served";
  EXPECT_EQ(lane.waiting("crowd") + lane.waiting("panel"), 0U);
}

/// A delegate does not have more of them waiting by naming more people.
TEST(CoreLoop, StopsThatWaitCountForWhoMakesTheConnection) {
  CoreLoop loop;
  auto& lane = loop.lane();
  lane.request({}, [] {}, "anna via web");
  lane.request({}, [] {}, "bert via web");
  lane.request({}, [] {}, "web");
  EXPECT_EQ(lane.waiting("web"), 3U);
  EXPECT_EQ(lane.waiting("anna via web"), 0U);
  post(loop.executor(), [&] { loop.stop(); });
  loop.run();
  EXPECT_EQ(lane.waiting("web"), 0U);
}

/// What waits is served as fast as ever, and so are the replies of the drives.
TEST(CoreLoop, ACrowdOfStopsOfTheWholeMachineHasItsShareOnly) {
  CoreLoop loop;
  Texts order;
  int left = 100;
  post(loop.executor(), [&] {
    for (int i = 0; i < 100; ++i) {
      std::vector<std::shared_ptr<AxisGate>> gates(8);
      for (auto& gate : gates) gate = std::make_shared<AxisGate>();
      loop.lane().request(
          std::move(gates),
          [&] {
            order.emplace_back("all");
            if (--left == 0) loop.stop();
          },
          "crowd", StopReach::machine);
    }
    loop.lane().request({std::make_shared<AxisGate>()}, [&] { order.emplace_back("operator"); }, "operator");
    post(loop.executor(), [&] { order.emplace_back("reply of a drive"); });
  });
  loop.run();
  const auto at = [&](const std::string& what) {
    return static_cast<std::size_t>(std::ranges::find(order, what) - order.begin());
  };
  EXPECT_EQ(at("operator"), StopLane::share / 8);
  EXPECT_EQ(at("reply of a drive"), StopLane::share / 8 + 1);
  EXPECT_EQ(order.size(), 102U);
}

TEST(CoreLoop, AHandlerIsNeverRunWithinAnother) {
  CoreLoop loop;
  Texts order;
  post(loop.executor(), [&] {
    post(loop.executor(), [&] { order.emplace_back("asked for"); });
    order.emplace_back("asking");
  });
  post(loop.executor(), [&] { loop.stop(); });
  loop.run();
  EXPECT_EQ(order.front(), "asking");
}

}  // namespace
}  // namespace axisd::core
