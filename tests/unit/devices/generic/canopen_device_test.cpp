#include "devices/generic/canopen_device.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>

#include "tests/support/object_node.hpp"
#include "tests/support/virtual_world.hpp"

namespace axisd {
namespace {

using namespace std::chrono_literals;
using testing::HasSubstr;

/// A device with four objects, and settings for five, on a network of its own.
class CanopenDeviceTest : public testing::Test {
 protected:
  CanopenDeviceTest() {
    const canopen::NetworkSettings network{.name = "can0", .interface = "sim"};
    auto port = std::make_unique<can::NetworkPort>(
        world_.clock(), can::PortSettings{.bus = "can0", .interface = "sim"}, network_);
    port_ = port.get();
    bus_ = std::make_unique<canopen::CanopenBus>(world_.executor(), world_.clock(), network, std::move(port));
    settings_ = {.name = "valves",
                 .bus = "can0",
                 .kind = BusKind::canopen,
                 .node = 9,
                 .poll = 100ms,
                 .values = {{.name = "open", .address = 0x620001, .type = ValueType::u8, .writable = true},
                            {.name = "offset", .address = 0x640101, .type = ValueType::i8},
                            {.name = "pressure",
                             .address = 0x640102,
                             .type = ValueType::i16,
                             .scale = 0.5,
                             .unit = "bar",
                             .writable = true},
                            {.name = "count", .address = 0x640103, .type = ValueType::u32}}};
  }
  ~CanopenDeviceTest() override {
    if (!device_) return;
    device_->close();
    bus_->close();
    EXPECT_TRUE(world_.run_until([this] { return device_->closed(); }, 10s));
    world_.run_for(100ms);
  }
  void start(Duration first = 1s) {
    device_ = std::make_unique<CanopenDevice>(world_.executor(), world_.clock(), *bus_, settings_);
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
    auto run = [](Device& device, std::string key, double to, auto& out) -> Task<> {
      out = co_await device.write(std::move(key), to);
    };
    spawn(world_.executor(), run(*device_, std::move(name), wanted, written), "write");
    EXPECT_TRUE(world_.run_until([&] { return written.has_value(); }, 10s));
    return *written;
  }

  test::VirtualWorld world_;
  can::Network network_{world_.clock(), 1'000'000};
  test::ObjectNode node_{world_.clock(),
                         network_,
                         9,
                         {{0x620001, {.value = 3, .size = 1, .writable = true}},
                          {0x640101, {.value = 0xFE, .size = 1}},
                          {0x640102, {.value = 0xFFFD, .size = 2, .writable = true}},
                          {0x640103, {.value = 0xFFFFFFFE}}}};
  can::NetworkPort* port_ = nullptr;
  std::unique_ptr<canopen::CanopenBus> bus_;
  DeviceSettings settings_;
  std::unique_ptr<CanopenDevice> device_;
};

TEST_F(CanopenDeviceTest, PollsItsObjectsAtItsRate) {
  start(0ms);
  EXPECT_EQ(device_->snapshot()->link, LinkState::offline);
  EXPECT_FALSE(value("count"));
  world_.run_for(1s);
  EXPECT_EQ(device_->snapshot()->link, LinkState::online);
  EXPECT_FALSE(device_->snapshot()->error);
  EXPECT_EQ(value("open"), 3);
  EXPECT_EQ(value("offset"), -2);
  EXPECT_EQ(value("pressure"), -1.5);
  EXPECT_EQ(value("count"), 4294967294.0);
  EXPECT_GE(node_.reads, 36);  // four objects, ten times
  EXPECT_LE(node_.reads, 44);
  EXPECT_EQ(node_.writes, 0);
  const auto before = device_->snapshot()->measured_at;
  node_.objects.at(0x640102).value = 7;
  world_.run_for(110ms);
  EXPECT_EQ(value("pressure"), 3.5);
  EXPECT_GT(device_->snapshot()->measured_at, before);
}

TEST_F(CanopenDeviceTest, AnObjectThatIsMissingOrOfAnotherSizeIsNamedAndTheOthersAreReadOn) {
  settings_.values[0].type = ValueType::u16;
  settings_.values[1].address = 0x123401;
  start();
  const auto snapshot = device_->snapshot();
  EXPECT_EQ(snapshot->link, LinkState::online);
  ASSERT_TRUE(snapshot->error);
  EXPECT_EQ(snapshot->error->reason, Reason::misconfigured) << "the first of both";
  EXPECT_EQ(snapshot->error->where.object, 0x620001U);
  EXPECT_THAT(snapshot->error->message, HasSubstr("valves: 1 bytes came, not 2"));
  EXPECT_FALSE(value("open"));
  EXPECT_FALSE(value("offset"));
  EXPECT_EQ(value("pressure"), -1.5);
  node_.objects.at(0x620001).size = 2;
  world_.run_for(200ms);
  EXPECT_EQ(device_->snapshot()->error->where.object, 0x123401U);
  EXPECT_EQ(value("open"), 3);
}

TEST_F(CanopenDeviceTest, WithoutASizeTheLowestBytesCount) {
  node_.size_indicated = false;
  node_.objects.at(0x640102).value = 0xABCDFFFD;
  start();
  EXPECT_EQ(value("pressure"), -1.5);
  EXPECT_EQ(value("count"), 4294967294.0);
}

TEST_F(CanopenDeviceTest, WritesHaveTheObjectsSizeAndAreReadBack) {
  start();
  EXPECT_EQ(write("pressure", 20.3).value(), 20.5);
  EXPECT_EQ(node_.objects.at(0x640102).value, 41U);
  EXPECT_EQ(write("open", 255).value(), 255);
  EXPECT_EQ(value("open"), 255);
  const int writes = node_.writes;
  EXPECT_EQ(write("open", 256).error().reason, Reason::out_of_range);
  EXPECT_THAT(write("valve", 1).error().message, HasSubstr("has no object 'valve'"));
  EXPECT_EQ(write("count", 1).error().reason, Reason::invalid_argument);
  EXPECT_EQ(node_.writes, writes) << "refused before the wire";
  node_.objects.at(0x640102).writable = false;
  const auto refused = write("pressure", 1);
  EXPECT_EQ(refused.error().outcome, Outcome::refused);
  EXPECT_EQ(refused.error().where.native_code, 0x06010002U);
  EXPECT_EQ(device_->snapshot()->link, LinkState::online);
}

TEST_F(CanopenDeviceTest, ASilentDeviceGoesOfflineAndALostLinkIsSaid) {
  start();
  node_.silent = true;
  const auto lost = write("pressure", 1);
  EXPECT_EQ(lost.error().reason, Reason::no_reply);
  EXPECT_EQ(lost.error().outcome, Outcome::unknown);
  world_.run_for(2s);
  ASSERT_EQ(device_->snapshot()->link, LinkState::offline);
  EXPECT_EQ(device_->snapshot()->error->reason, Reason::no_reply);
  EXPECT_EQ(value("count"), 4294967294.0) << "the last value, with its time";
  node_.silent = false;
  world_.run_for(5s);
  EXPECT_EQ(device_->snapshot()->link, LinkState::online);
  port_->set_up(false);
  world_.run_for(1s);
  ASSERT_EQ(device_->snapshot()->link, LinkState::offline);
  EXPECT_EQ(device_->snapshot()->error->reason, Reason::bus_down);
  port_->set_up(true);
  world_.run_for(3s);
  EXPECT_EQ(device_->snapshot()->link, LinkState::online);
}

}  // namespace
}  // namespace axisd
