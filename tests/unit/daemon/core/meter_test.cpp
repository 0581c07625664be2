#include "daemon/core/meter.hpp"

#include "tests/unit/daemon/core/machine_rig.hpp"

namespace axisd::core {
namespace {

using namespace std::chrono_literals;

class Metered : public MachineOnALine {
 protected:
  Metered() : MachineOnALine("metered", {1, 2, 3}) {}
  MachineCore& started() {
    start_with({1, 2, 3}, 3);
    return *machine_;
  }

  Duration longest_ = 0ms;  ///< of the core's handlers since it was last asked
  Meter meter_{world_.clock(), started(), [this] { return std::exchange(longest_, 0ms); }};
};

TEST_F(Metered, ReadsOnceASecondWhoeverLooks) {
  EXPECT_EQ(meter_.latest(), nullptr);
  meter_.start();
  const auto first = meter_.latest();
  world_.run_for(Meter::period / 2);
  EXPECT_EQ(meter_.latest(), first);
  world_.run_for(Meter::period);
  EXPECT_NE(meter_.latest(), first);
  meter_.close();
  const auto last = meter_.latest();
  world_.run_for(3 * Meter::period);
  EXPECT_EQ(meter_.latest(), last);
}

TEST_F(Metered, SaysWhatTheBusDid) {
  world_.run_for(10s);
  meter_.start();
  const auto reading = meter_.latest();
  ASSERT_EQ(reading->buses.size(), 1U);
  const auto& bus = reading->buses[0];
  EXPECT_EQ(bus.status.name, "line-a");
  EXPECT_TRUE(bus.status.open);
  EXPECT_GT(bus.load, 0);
  EXPECT_LT(bus.load, 1);
  EXPECT_EQ(bus.quarantined, 1U) << "a3 has no power";
  const auto& idle = bus.classes.at(std::to_underlying(TransactionClass::idle_state));
  EXPECT_GT(idle.ends.answered, 10U);
  EXPECT_EQ(reading->tallies.of("a3").link_losses, 0U) << "it never answered";
}

TEST_F(Metered, StopsAreCountedAtTheirBus) {
  const auto stop = [this](const std::string& axis) {
    const auto command = machine_->submit(axis, StopRequest{}, {.client = "t", .arrived = world_.now()});
    ASSERT_TRUE(command);
    EXPECT_TRUE(world_.run_until([&] { return (*command)->has_ended(); }, 60s));
  };
  stop("a1");
  stop("a2");
  meter_.start();
  const auto reading = meter_.latest();
  const auto& stops = reading->buses.at(0).stops;
  EXPECT_GT(stops.some.frame.longest(), 0ms);
  EXPECT_GT(stops.some.standstill.longest(), stops.some.frame.longest());
  EXPECT_EQ(stops.all.frame.longest(), 0ms);
  EXPECT_EQ(reading->tallies.commands(CommandKind::stop, CommandState::done), 2U);
}

TEST_F(Metered, ALongHandlerIsSeenForAMinute) {
  longest_ = 7ms;
  meter_.start();
  world_.run_for(30s);
  EXPECT_EQ(meter_.latest()->longest_handler, 7ms);
  world_.run_for(31s);
  EXPECT_EQ(meter_.latest()->longest_handler, 0ms);
}

}  // namespace
}  // namespace axisd::core
