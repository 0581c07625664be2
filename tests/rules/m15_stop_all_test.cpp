// StopAll on the wire (M14, M15): what moves first, what does not answer last, and that one again and again.
#include <gtest/gtest.h>

#include <algorithm>
#include <map>
#include <set>
#include <string>
#include <tuple>
#include <vector>

#include "buses/can/network.hpp"
#include "devices/simulation/can_nodes.hpp"
#include "tests/rules/shared_line.hpp"
#include "tests/support/rig.hpp"

namespace axisd::test {
namespace {

using namespace std::chrono_literals;

constexpr std::uint16_t stop_register = 0x0028;

/// The nodes in the order in which each got its first stop.
std::vector<int> order_of_stops(const std::vector<WireEntry>& wire) {
  std::vector<int> order;
  for (const auto& entry : wire)
    if (entry.is_write() && entry.address() == stop_register &&
        std::ranges::find(order, entry.node()) == order.end())
      order.push_back(entry.node());
  return order;
}

bool online(const AxisSnapshot& axis) { return axis.link == LinkState::online; }

TEST(M15, StopAllServesWhatMovesFirstAndWhatIsSilentLast) {
  constexpr int count = 12;
  SharedLine line(count, 115200);
  ASSERT_TRUE(line.world.run_until([&] { return line.all(online); }, 20s));
  const std::set<int> moving{3, 7, 8, 12}, silent{1, 5};
  for (const int axis : moving) {
    const auto enabled = line.submit(axis, EnableRequest{});
    ASSERT_TRUE(line.world.run_until([&] { return enabled->has_ended(); }, 5s));
    line.submit(axis, MoveVelocityRequest{.velocity = 20});
  }
  for (const int axis : silent) line.line->network().node(static_cast<std::uint8_t>(axis))->set_power(false);
  line.world.run_for(5s);
  line.line->forget_wire();
  const auto stops = line.machine().stop_all("test");
  line.world.run_for(3s);
  const auto order = order_of_stops(line.line->wire());
  ASSERT_EQ(order.size(), static_cast<std::size_t>(count));
  EXPECT_EQ(std::set<int>(order.begin(), order.begin() + 4), moving);
  EXPECT_EQ(std::set<int>(order.end() - 2, order.end()), silent);
  for (int axis = 1; axis <= count; ++axis) {
    const auto& stop = *stops.at(static_cast<std::size_t>(axis - 1));
    EXPECT_EQ(stop->value().state, silent.contains(axis) ? CommandState::unknown : CommandState::done)
        << axis << ' ' << describe(stop->value());
  }
}

/// A cabinet has lost its supply: what its drives cost is in the published bounds, and nobody else waits for
/// those of whom it is known (M33).
class StopAllWithSilentDrives : public testing::TestWithParam<std::tuple<int, int, bool>> {};

TEST_P(StopAllWithSilentDrives, KeepsWhatIsPublished) {
  const auto [baud, silent, just_now] = GetParam();
  constexpr int count = 16, moving = 4;
  SharedLine line(count, baud, [](AxisSettings& axis) { axis.poll_idle = 1ms; });  // a full queue
  ASSERT_TRUE(line.world.run_until([&] { return line.all(online); }, 60s));
  for (int axis = 1; axis <= moving; ++axis) {
    const auto enabled = line.submit(axis, EnableRequest{});
    ASSERT_TRUE(line.world.run_until([&] { return enabled->has_ended(); }, 10s));
    line.submit(axis, MoveVelocityRequest{.velocity = 20});
  }
  line.world.run_for(3s);
  // Every other one first, then the rest: moving ones among them.
  std::vector<int> order;
  for (const int first : {2, 1})
    for (int axis = first; axis <= count; axis += 2) order.push_back(axis);
  const std::set<int> dead(order.begin(), order.begin() + silent);
  for (const int axis : dead) line.line->network().node(static_cast<std::uint8_t>(axis))->set_power(false);
  line.world.run_for(just_now ? Duration(7ms) : 20s);
  line.line->forget_wire();
  const auto asked = line.world.now();
  const auto stops = line.machine().stop_all("test", asked);
  line.world.run_for(20s);
  const auto host = modbus_rtu::LineSettings{}.budget.host_allowance;
  const auto published = line.machine().budgets().at(0).axes;
  const auto got = order_of_stops(line.line->wire());
  ASSERT_EQ(got.size(), static_cast<std::size_t>(count));
  std::map<int, Duration> sent;
  for (const auto& entry : line.line->wire())
    if (entry.is_write() && entry.address() == stop_register)
      sent.emplace(entry.node(),
                   entry.begin + modbus_rtu::wire_time(entry.serial, entry.request.size()) - asked);
  for (int axis = 1; axis <= count; ++axis) {
    const auto& [predicted, deceleration, unit, way_alone, way_all, seen] =
        published.at(static_cast<std::size_t>(axis - 1));
    EXPECT_LE(sent.at(axis) + host, predicted.all.last_frame) << axis;
    if (dead.contains(axis)) continue;
    const auto& stop = *stops.at(static_cast<std::size_t>(axis - 1));
    EXPECT_EQ(stop->value().state, CommandState::done) << axis << ' ' << describe(stop->value());
    EXPECT_EQ(seen.stop_frame_all, sent.at(axis)) << axis;
    EXPECT_LE(seen.standstill_all + host, predicted.all.standstill + deceleration) << axis;
  }
  if (!just_now) {
    // Who answers does not wait for who is known not to: its answers alone, some ms each, and what was under
    // way.
    const auto answering = static_cast<std::size_t>(count - silent);
    EXPECT_EQ(std::set<int>(got.end() - silent, got.end()), dead);
    const auto one = modbus_rtu::wire_time(modbus_rtu::SerialSettings{.baud = baud}, 16) + 12ms;
    EXPECT_LE(sent.at(got.at(answering - 1)), 60ms + static_cast<int>(answering) * one);
  }
}

INSTANTIATE_TEST_SUITE_P(M15, StopAllWithSilentDrives,
                         testing::Combine(testing::Values(115200, 9600), testing::Values(1, 4, 15),
                                          testing::Bool()),
                         [](const auto& info) {
                           return std::to_string(std::get<1>(info.param)) + "At" +
                                  std::to_string(std::get<0>(info.param)) +
                                  (std::get<2>(info.param) ? "JustNow" : "");
                         });

/// It ends as unknown for whoever asked, but the drive gets it as its first frame when it is back.
TEST(M15, StopAllKeepsTryingNodesThatAreSilent) {
  SharedLine line(3, 115200);
  ASSERT_TRUE(line.world.run_until([&] { return line.all(online); }, 20s));
  const auto enabled = line.submit(2, EnableRequest{});
  ASSERT_TRUE(line.world.run_until([&] { return enabled->has_ended(); }, 5s));
  line.submit(2, MoveVelocityRequest{.velocity = 20});
  line.world.run_for(1s);
  auto& network = line.line->network();
  network.faults().add({.kind = simulation::FaultKind::drop_request, .node = 2, .count = -1});
  line.machine().stop_all("test");
  line.world.run_for(30s);
  EXPECT_TRUE(network.node(2)->shaft_moving());
  line.line->forget_wire();
  line.world.run_for(10s);
  const auto tried = std::ranges::count_if(line.line->wire(), [](const WireEntry& entry) {
    return entry.node() == 2 && entry.address() == stop_register;
  });
  EXPECT_GE(tried, 5);
  for (const auto& entry : line.line->wire())
    if (entry.node() == 2) EXPECT_EQ(entry.address(), stop_register) << "nothing else before it";
  network.faults().clear();
  EXPECT_TRUE(line.world.run_until([&] { return !network.node(2)->shaft_moving(); }, 3s));
  ASSERT_NE(line.machine().inhibited_by(), nullptr) << "and nothing starts anew";
  EXPECT_FALSE(line.machine().submit("a2", MoveVelocityRequest{.velocity = 20}, {}));
}

/// Six YSS-C on one CAN network.
class StopAllOnCan : public testing::Test {
 protected:
  static constexpr int count = 6;

  StopAllOnCan() : network_(world_.clock(), 1'000'000), drives_(world_.clock(), network_) {
    config::Configuration configuration;
    configuration.machine = "test";
    configuration.networks.push_back({.name = "can0", .interface = "sim"});
    for (int node = 1; node <= count; ++node) {
      auto made = simulation::make_can_node("yss-c", {.address = static_cast<std::uint8_t>(node)});
      EXPECT_TRUE(made);
      drives_.nodes().add(std::move(*made));
      AxisSettings axis{.name = "a" + std::to_string(node),
                        .bus = "can0",
                        .node = static_cast<std::uint8_t>(node),
                        .model = "yss-c"};
      axis.scale = {.pulses_per_revolution = 1000, .travel_numerator = 10, .unit = "mm"};
      axis.limits.velocity = 100;
      configuration.axes.push_back({.axis = std::move(axis)});
    }
    drives_.nodes().set_observer(
        [this](TimePoint, bool, const can::Frame& frame) { frames_.push_back(frame); });
    world_.run_for(1s);
    machine_ = std::make_unique<core::MachineCore>(
        core::MachineParts{.executor = world_.executor(),
                           .clock = &world_.clock(),
                           .instance_id = "t",
                           .make_port =
                               [this](const canopen::NetworkSettings& settings) {
                                 return std::make_unique<can::NetworkPort>(
                                     world_.clock(),
                                     can::PortSettings{.bus = settings.name, .interface = settings.interface},
                                     network_);
                               }},
        configuration);
    machine_->start();
  }
  ~StopAllOnCan() override {
    machine_->close();
    EXPECT_TRUE(world_.run_until([this] { return machine_->closed(); }, 60s));
  }

  bool all_online() {
    return world_.run_until(
        [this] {
          return std::ranges::all_of(machine_->axes(),
                                     [](const auto& axis) { return online(*axis->snapshot()); });
        },
        20s);
  }
  CommandPtr submit(int axis, const Action& action) {
    auto command = machine_->submit("a" + std::to_string(axis), action, {});
    EXPECT_TRUE(command) << (command ? "" : to_string(command.error()));
    return command.value_or(nullptr);
  }
  void run_at(int axis, double velocity) {
    const auto enabled = submit(axis, EnableRequest{});
    ASSERT_TRUE(world_.run_until([&] { return enabled->has_ended(); }, 5s));
    submit(axis, MoveVelocityRequest{.velocity = velocity});
  }
  /// The nodes in the order in which each got its first halt: bit 8 of the control word, by RPDO or SDO.
  [[nodiscard]] std::vector<int> order_of_halts() const {
    std::vector<int> order;
    for (const auto& frame : frames_) {
      const bool by_pdo = (frame.id & 0x780U) == 0x200U && (frame.data[1] & 1U) != 0;
      const bool control_word = frame.data[1] == 0x40 && frame.data[2] == 0x60 && frame.data[3] == 0;
      const bool by_sdo = (frame.id & 0x780U) == 0x600U && (frame.data[0] & 0xE0U) == 0x20U && control_word &&
                          (frame.data[5] & 1U) != 0;
      const int node = static_cast<int>(frame.id & 0x7FU);
      if ((by_pdo || by_sdo) && std::ranges::find(order, node) == order.end()) order.push_back(node);
    }
    return order;
  }
  simulation::SimulatedCanNode& drive(int node) {
    drives_.nodes().advance();
    return *drives_.nodes().node(static_cast<std::uint8_t>(node));
  }

  VirtualWorld world_;
  can::Network network_;
  simulation::NetworkNodes drives_;
  std::unique_ptr<core::MachineCore> machine_;
  std::vector<can::Frame> frames_;  ///< that passed the wire
};

TEST_F(StopAllOnCan, ServesWhatMovesFirst) {
  ASSERT_TRUE(all_online());
  for (const int axis : {2, 5}) run_at(axis, 20);
  world_.run_for(1s);
  frames_.clear();
  const auto stops = machine_->stop_all("test");
  world_.run_for(3s);
  const auto order = order_of_halts();
  ASSERT_EQ(order.size(), static_cast<std::size_t>(count));
  EXPECT_EQ(std::set<int>(order.begin(), order.begin() + 2), (std::set<int>{2, 5}));
  for (const auto& stop : stops) EXPECT_EQ((*stop)->value().state, CommandState::done);
  for (int node = 1; node <= count; ++node) EXPECT_FALSE(drive(node).shaft_moving()) << node;
}

/// A cut cable: the drive goes on, and is stopped when it is heard again.
TEST_F(StopAllOnCan, KeepsTryingNodesThatAreSilent) {
  ASSERT_TRUE(all_online());
  for (const int axis : {2, 5}) run_at(axis, 20);
  world_.run_for(1s);
  drives_.nodes().add_fault({.kind = simulation::FaultKind::silence, .node = 5, .delay = 20s});
  const auto stops = machine_->stop_all("test");
  world_.run_for(10s);
  EXPECT_FALSE(drive(2).shaft_moving());
  EXPECT_TRUE(drive(5).shaft_moving());
  EXPECT_EQ((*stops.at(1))->value().state, CommandState::done);
  EXPECT_EQ((*stops.at(4))->value().state, CommandState::unknown) << describe((*stops.at(4))->value());
  world_.run_for(10s);
  EXPECT_TRUE(world_.run_until([&] { return !drive(5).shaft_moving(); }, 3s));
}

}  // namespace
}  // namespace axisd::test
