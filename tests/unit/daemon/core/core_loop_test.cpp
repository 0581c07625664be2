#include "daemon/core/core_loop.hpp"

#include <gtest/gtest.h>

#include <functional>
#include <string>
#include <thread>
#include <vector>

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
  AxisGate gate;
  Texts order;
  Clock::Timer timer;
  post(loop.executor(), [&] {
    timer = loop.clock().call_at(loop.clock().now(), [&] {
      order.emplace_back("cycle");
      loop.stop();
    });
    loop.lane().request(gate, [&] { order.emplace_back("stop"); });
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
  AxisGate gate;
  Texts order;
  post(loop.executor(), [&] {
    post(loop.executor(), [&] {
      order.emplace_back("first");
      std::thread([&] { loop.lane().request(gate, [&] { order.emplace_back("stop"); }); }).join();
    });
    post(loop.executor(), [&] { order.emplace_back("second"); });
    post(loop.executor(), [&] { loop.stop(); });
  });
  loop.run();
  EXPECT_EQ(order, (Texts{"first", "stop", "second"}));
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
