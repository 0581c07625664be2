#include "daemon/core/observed_port.hpp"

#include <gtest/gtest.h>

#include <string>
#include <vector>

#include "buses/can/network.hpp"
#include "tests/support/virtual_world.hpp"

namespace axisd::core {
namespace {

using namespace std::chrono_literals;
using Texts = std::vector<std::string>;

TEST(ObservedPort, TellsTheObserverFirstAndThenItsOwner) {
  test::VirtualWorld world;
  can::Network network(world.clock(), 1'000'000);
  auto inner = std::make_unique<can::NetworkPort>(
      world.clock(), can::PortSettings{.bus = "cell", .interface = "can0"}, network);
  auto* const link = inner.get();
  Texts told;
  const auto note = [&told](const std::string& who, const std::string& what) { told.push_back(who + what); };
  NetworkObserver observer{
      .received = [&](const can::ReceivedFrame& received) { note("rx ", to_string(received.frame)); },
      .ended =
          [&](const can::Frame& frame, TransactionClass transaction_class, const can::SendResult& result,
              TimePoint at) {
            EXPECT_EQ(at, world.now());
            EXPECT_EQ(transaction_class, TransactionClass::motion);
            note("tx ", to_string(frame) + " " + std::string(to_string(result.status)));
          },
      .state = [&](const can::PortState& state,
                   TimePoint) { note("link ", std::string(to_string(state.link))); }};
  ObservedPort port(std::move(inner), world.clock(), observer);
  port.start(
      {.on_frame = [&](const can::ReceivedFrame& received) { note("frame ", to_string(received.frame)); },
       .on_state = [&](const can::PortState& state) { note("state ", std::string(to_string(state.link))); }});
  world.run_for(1ms);
  const auto peer = network.join([](const can::Frame&, TimePoint, bool) {});
  network.transmit(peer, can::make_frame(0x705, {}));
  world.run_for(1ms);
  const auto send = [&](std::uint32_t id) {
    port.send(can::make_frame(id, {}), {.transaction_class = TransactionClass::motion},
              [&](const can::SendResult& result) { note("ended ", std::string(to_string(result.status))); });
  };
  send(0x205);
  world.run_for(1ms);
  link->report(can::Controller::bus_off);
  send(0x206);
  world.run_for(1ms);
  EXPECT_EQ(told, (Texts{"link up", "state up", "rx 705#", "frame 705#", "tx 205# sent", "ended sent",
                         "link bus_off", "state bus_off", "tx 206# port_down", "ended port_down"}));
  EXPECT_EQ(port.counters().sent, 1U);
  EXPECT_TRUE(port.state().needs_cycle());
  port.close();
}

}  // namespace
}  // namespace axisd::core
