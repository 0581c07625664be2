#include "devices/generic/modbus_device.hpp"

#include <gtest/gtest.h>

#include "tests/support/register_node.hpp"
#include "tests/support/virtual_line.hpp"

namespace axisd {
namespace {

using namespace std::chrono_literals;
using modbus_rtu::LineSettings;

/// A device with three registers in a row, one apart and one that it lacks, on a line of its own.
class ModbusDeviceTest : public testing::Test {
 protected:
  ModbusDeviceTest() {
    auto line = std::make_unique<test::VirtualLine>(world_, settings_);
    line_ = line.get();
    auto node = std::make_unique<test::RegisterNode>(
        9, std::map<std::uint16_t, std::uint16_t>{{1, 0xFFFF}, {2, 0x0001}, {3, 0x0002}, {20, 215}});
    node_ = node.get();
    line_->network().add(std::move(node));
    bus_ =
        std::make_unique<modbus_rtu::RtuBus>(world_.executor(), world_.clock(), settings_, std::move(line));
    device_settings_ = {
        .name = "io",
        .bus = "a",
        .node = 9,
        .poll = 100ms,
        .values = {{.name = "offset", .address = 1, .type = ValueType::i16},
                   {.name = "count", .address = 2, .type = ValueType::u32, .writable = true},
                   {.name = "temperature", .address = 20, .scale = 0.5, .unit = "degC", .writable = true}}};
  }
  ~ModbusDeviceTest() override {
    if (!device_) return;
    device_->close();
    bus_->close();
    EXPECT_TRUE(world_.run_until([this] { return device_->closed() && bus_->idle(); }, 10s));
    world_.run_for(100ms);
  }
  void start(Duration first = 1s) {
    device_ = std::make_unique<ModbusDevice>(world_.executor(), world_.clock(), *bus_, device_settings_);
    bus_->start();
    device_->start();
    world_.run_for(first);
  }
  std::optional<double> value(std::string_view name) {
    const auto snapshot = device_->snapshot();
    const auto found = std::ranges::find(snapshot->values, name, &DeviceValue::name);
    return found == snapshot->values.end() ? std::nullopt : found->value;
  }
  Result<double> write(std::string name, double wanted) {
    std::optional<Result<double>> written;
    auto run = [](ModbusDevice& device, std::string key, double to, auto& out) -> Task<> {
      out = co_await device.write(std::move(key), to);
    };
    spawn(world_.executor(), run(*device_, std::move(name), wanted, written), "write");
    EXPECT_TRUE(world_.run_until([&] { return written.has_value(); }, 10s));
    return *written;
  }

  LineSettings settings_{.name = "a", .port = "sim"};
  test::VirtualWorld world_;
  test::VirtualLine* line_ = nullptr;
  test::RegisterNode* node_ = nullptr;
  std::unique_ptr<modbus_rtu::RtuBus> bus_;
  DeviceSettings device_settings_;
  std::unique_ptr<ModbusDevice> device_;
};

TEST_F(ModbusDeviceTest, PollsInBlocksAtItsRate) {
  start(0ms);
  EXPECT_EQ(device_->snapshot()->link, LinkState::offline);
  EXPECT_FALSE(value("count"));
  world_.run_for(1s);
  const auto snapshot = device_->snapshot();
  EXPECT_EQ(snapshot->link, LinkState::online);
  EXPECT_FALSE(snapshot->error);
  EXPECT_EQ(value("offset"), -1);
  EXPECT_EQ(value("count"), 65538);
  EXPECT_EQ(value("temperature"), 107.5);
  EXPECT_EQ(snapshot->values[2].unit, "degC");
  EXPECT_FALSE(snapshot->values[0].writable);
  EXPECT_EQ(node_->longest_read, 3U);
  EXPECT_GE(node_->reads, 18);  // two blocks, ten times
  EXPECT_LE(node_->reads, 20);
  node_->registers[20] = 216;
  world_.run_for(110ms);
  EXPECT_EQ(value("temperature"), 108);
  EXPECT_GT(device_->snapshot()->measured_at, snapshot->measured_at);
}

TEST_F(ModbusDeviceTest, ASilentDeviceGoesOfflineIsAskedSeldomAndComesBack) {
  start();
  node_->silent = true;
  world_.run_for(1s);
  EXPECT_EQ(device_->snapshot()->link, LinkState::offline);
  ASSERT_TRUE(device_->snapshot()->error);
  EXPECT_EQ(device_->snapshot()->error->reason, Reason::no_reply);
  EXPECT_TRUE(device_->snapshot()->error->message.starts_with("io: "));
  EXPECT_EQ(value("count"), 65538) << "the last value, with its time";
  world_.run_for(10s);
  line_->forget_wire();
  world_.run_for(100s);
  Duration busy{};
  for (const auto& entry : line_->wire()) busy += entry.end - entry.begin;
  EXPECT_LE(busy, 2s);  // 2 %
  EXPECT_GE(line_->wire().size(), 40U);
  node_->silent = false;
  world_.run_for(3s);
  EXPECT_EQ(device_->snapshot()->link, LinkState::online);
  EXPECT_FALSE(device_->snapshot()->error);
}

TEST_F(ModbusDeviceTest, OneLostReplyIsNoOutage) {
  start();
  line_->network().faults().add({.kind = simulation::FaultKind::drop_reply, .node = 9, .count = 2});
  bool stayed = true;
  world_.run_until(
      [&] {
        stayed = stayed && device_->snapshot()->link == LinkState::online;
        return false;
      },
      1s);
  EXPECT_TRUE(stayed);
  EXPECT_EQ(bus_->counters().timeouts, 2U);
}

TEST_F(ModbusDeviceTest, ARefusedRegisterIsNamedAndTheOthersAreReadOn) {
  device_settings_.values.push_back({.name = "missing", .address = 50});
  start();
  const auto snapshot = device_->snapshot();
  EXPECT_EQ(snapshot->link, LinkState::online);
  ASSERT_TRUE(snapshot->error);
  EXPECT_EQ(snapshot->error->reason, Reason::refused);
  EXPECT_EQ(snapshot->error->where.object, 50U);
  EXPECT_FALSE(value("missing"));
  EXPECT_EQ(value("temperature"), 107.5);
  node_->registers[50] = 7;
  world_.run_for(200ms);
  EXPECT_FALSE(device_->snapshot()->error);
  EXPECT_EQ(value("missing"), 7);
}

TEST_F(ModbusDeviceTest, WritesAreReadBack) {
  start();
  line_->forget_wire();
  EXPECT_EQ(write("temperature", 20.3).value(), 20.5);
  EXPECT_EQ(value("temperature"), 20.5);
  EXPECT_EQ(write("count", 70000).value(), 70000);
  EXPECT_EQ(node_->registers[2], 1);
  EXPECT_EQ(node_->registers[3], 70000 - 65536);
  std::vector<int> functions;
  for (const auto& entry : line_->wire())
    if (entry.is_write()) functions.push_back(entry.function());
  EXPECT_EQ(functions, (std::vector{0x06, 0x10}));
}

TEST_F(ModbusDeviceTest, BadWritesAreRefusedBeforeTheWire) {
  start();
  line_->forget_wire();
  const auto unknown = write("pressure", 1);
  EXPECT_EQ(unknown.error().reason, Reason::invalid_argument);
  EXPECT_NE(unknown.error().remedy.find("temperature"), std::string::npos);
  EXPECT_EQ(write("offset", 1).error().reason, Reason::invalid_argument);
  EXPECT_EQ(write("temperature", 40000).error().reason, Reason::out_of_range);
  world_.run_for(200ms);
  for (const auto& entry : line_->wire()) EXPECT_FALSE(entry.is_write());
}

TEST_F(ModbusDeviceTest, AWriteThatTheDeviceChangesOrLosesIsAnError) {
  start();
  node_->highest_value = 100;
  const auto clamped = write("temperature", 80);
  EXPECT_EQ(clamped.error().reason, Reason::misconfigured);
  EXPECT_EQ(value("temperature"), 50);
  line_->network().faults().add(
      {.kind = simulation::FaultKind::drop_reply, .node = 9, .function = 6, .count = 1});
  const auto lost = write("temperature", 10);
  EXPECT_EQ(lost.error().reason, Reason::no_reply);
  EXPECT_EQ(lost.error().outcome, Outcome::unknown);
}

TEST_F(ModbusDeviceTest, AnUnpluggedAdapterIsSaidAndItComesBack) {
  start();
  line_->set_open(false);
  world_.run_for(500ms);
  EXPECT_EQ(device_->snapshot()->link, LinkState::offline);
  EXPECT_EQ(device_->snapshot()->error->reason, Reason::bus_down);
  EXPECT_EQ(write("temperature", 10).error().reason, Reason::bus_down);
  line_->set_open(true);
  world_.run_for(3s);
  EXPECT_EQ(device_->snapshot()->link, LinkState::online);
}

/// Registers apart are read one by one: a late reply of one must never be taken for the other's value.
TEST_F(ModbusDeviceTest, ALateReplyIsNeverAnotherRegistersValue) {
  device_settings_.values = {{.name = "one", .address = 1}, {.name = "other", .address = 20}};
  node_->registers[21] = 0;
  start();
  for (int delay = 25; delay < 60; ++delay) {
    line_->network().faults().add({.kind = simulation::FaultKind::delay_reply,
                                   .node = 9,
                                   .function = 3,
                                   .count = 1,
                                   .delay = std::chrono::milliseconds(delay)});
    for (int i = 0; i < 20; ++i) {
      world_.run_for(10ms);
      EXPECT_EQ(value("one"), 0xFFFF) << delay;
      EXPECT_EQ(value("other"), 215) << delay;
    }
  }
}

}  // namespace
}  // namespace axisd
