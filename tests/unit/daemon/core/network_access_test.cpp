// Other devices on a CAN network, single transfers, and the search for nodes, in virtual time.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <memory>
#include <optional>

#include "daemon/core/bus_access_service.hpp"
#include "daemon/core/drive_access_service.hpp"
#include "daemon/core/machine_core.hpp"
#include "devices/simulation/can_nodes.hpp"
#include "devices/simulation/simulator.hpp"
#include "tests/support/object_node.hpp"
#include "tests/support/virtual_world.hpp"

namespace axisd::core {
namespace {

using namespace std::chrono_literals;
using axisd::test::ObjectNode;
using testing::ElementsAre;
using testing::HasSubstr;
using Bytes = std::vector<std::uint8_t>;

/// Axis a1 (YSS-C, node 40) and device io (node 9, one object) on can0, and whatever else a test puts there.
class NetworkAccess : public testing::Test {
 protected:
  NetworkAccess() {
    config::Configuration configuration{.machine = "m"};
    configuration.networks.push_back({.name = "can0", .interface = "sim", .sync_period = 10ms});
    AxisSettings axis{.name = "a1", .bus = "can0", .node = 40, .model = "yss-c"};
    axis.scale = {.pulses_per_revolution = 4000, .travel_numerator = 10, .unit = "mm"};
    axis.limits.velocity = 100;
    configuration.axes.push_back({.axis = axis});
    configuration.devices.push_back({.name = "io",
                                     .bus = "can0",
                                     .kind = BusKind::canopen,
                                     .node = 9,
                                     .poll = 500ms,
                                     .values = {{.name = "level", .address = 0x640101, .writable = true}}});
    machine_ = std::make_unique<MachineCore>(
        MachineParts{.executor = world_.executor(),
                     .clock = &world_.clock(),
                     .instance_id = "t",
                     .make_port =
                         [this](const canopen::NetworkSettings& settings) {
                           auto port = std::make_unique<can::NetworkPort>(
                               world_.clock(),
                               can::PortSettings{.bus = settings.name, .interface = settings.interface},
                               network_);
                           port_ = port.get();
                           return port;
                         }},
        configuration);
    drive_access_ = std::make_unique<DriveAccessService>(world_.executor(), world_.clock(), *machine_);
    access_ = std::make_unique<BusAccessService>(world_.executor(), world_.clock(), *machine_);
    io_ = &add(9, {{0x100000, {.value = 0x00000191}},
                   {0x640101, {.value = 77, .size = 2, .writable = true}},
                   {0x620001, {.value = 5, .size = 1, .writable = true}}});
    drives_.set_bitrate(network_.bitrate());
    wire_ = network_.join([this](const can::Frame& frame, TimePoint at, bool own) {
      if (!own) drives_.on_frame(frame, at);
    });
    drives_.add(*simulation::make_can_node("yss-c", {.address = 40}));
    drives_.advance();
    machine_->start();
    world_.run_for(1s);
  }
  ~NetworkAccess() override {
    machine_->close();
    EXPECT_TRUE(world_.run_until([this] { return machine_->closed(); }, 60s));
    world_.run_for(100ms);
  }

  ObjectNode& add(std::uint8_t node, std::map<std::uint32_t, ObjectNode::Entry> objects) {
    nodes_.push_back(std::make_unique<ObjectNode>(world_.clock(), network_, node, std::move(objects)));
    return *nodes_.back();
  }
  Result<Bytes> transact(ObjectRequest request) {
    std::optional<Result<Bytes>> answer;
    access_->transact_object(std::move(request), [&](auto result) {
      EXPECT_FALSE(answer);
      answer = std::move(result);
    });
    EXPECT_TRUE(world_.run_until([&] { return answer.has_value(); }, 10s));
    return *answer;
  }
  struct ScanLog {
    std::vector<FoundNode> found;
    std::vector<ScanProgress> reports;
    std::optional<Error> error;
    [[nodiscard]] bool over() const { return error || (!reports.empty() && reports.back().finished); }
  };
  ScanLog scan(ScanRequest request) {
    request.bus = "can0";
    ScanLog log;
    const auto token = access_->scan(std::move(request), [&log](Result<ScanProgress> progress) {
      EXPECT_FALSE(log.over()) << "called after the end";
      if (!progress) {
        log.error = progress.error();
        return;
      }
      log.found.insert(log.found.end(), progress->found.begin(), progress->found.end());
      log.reports.push_back(std::move(*progress));
    });
    EXPECT_TRUE(world_.run_until([&] { return log.over(); }, 120s));
    return log;
  }

  axisd::test::VirtualWorld world_;
  can::Network network_{world_.clock(), 1'000'000};
  can::Network::Id wire_ = 0;
  simulation::CanNodes drives_{world_.clock(),
                               [this](const can::Frame& frame) { network_.transmit(wire_, frame); }};
  can::NetworkPort* port_ = nullptr;
  std::vector<std::unique_ptr<ObjectNode>> nodes_;
  std::unique_ptr<MachineCore> machine_;
  std::unique_ptr<BusAccessService> access_;
  std::unique_ptr<DriveAccessService> drive_access_;
  ObjectNode* io_ = nullptr;
};

TEST_F(NetworkAccess, DevicesArePolledAndWritten) {
  ASSERT_EQ(access_->devices().size(), 1U);
  EXPECT_EQ(access_->devices()[0]->link, LinkState::online);
  EXPECT_EQ(access_->devices()[0]->values.at(0).value, 77);
  std::optional<Result<double>> written;
  access_->write_device("io", "level", 5, [&](auto result) { written = result; });
  ASSERT_TRUE(world_.run_until([&] { return written.has_value(); }, 1s));
  EXPECT_EQ(written->value(), 5);
  EXPECT_EQ(io_->objects.at(0x640101).value, 5U);
}

TEST_F(NetworkAccess, TransactReadsAndWritesObjects) {
  EXPECT_THAT(*transact({.bus = "can0", .node = 9, .object = 0x640101}), ElementsAre(77, 0));
  EXPECT_THAT(*transact({.bus = "can0", .node = 9, .object = 0x620001, .bytes = {8}}), ElementsAre());
  EXPECT_EQ(io_->objects.at(0x620001).value, 8U);
  const auto missing = transact({.bus = "can0", .node = 9, .object = 0x123402, .bytes = {1}});
  EXPECT_EQ(missing.error().outcome, Outcome::refused);
  EXPECT_EQ(missing.error().where.object, 0x123402U);
  EXPECT_EQ(missing.error().where.native_code, 0x06020000U);
  const auto silent = transact({.bus = "can0", .node = 60, .object = 0x620001, .bytes = {8}});
  EXPECT_EQ(silent.error().reason, Reason::no_reply);
  EXPECT_EQ(silent.error().outcome, Outcome::unknown);
  EXPECT_THAT(silent.error().remedy, HasSubstr("read the object back"));
}

TEST_F(NetworkAccess, TransactReadsADriveButWritesToNoneThatAnAxisOwns) {
  EXPECT_THAT(*transact({.bus = "can0", .node = 40, .object = 0x101801}), ElementsAre(0, 1, 0, 0));
  const auto owned = transact({.bus = "can0", .node = 40, .object = 0x604000, .bytes = {0x0F, 0}});
  EXPECT_EQ(owned.error().reason, Reason::invalid_argument);
  EXPECT_EQ(owned.error().outcome, Outcome::not_sent);
  EXPECT_THAT(owned.error().message, HasSubstr("'a1'"));
  EXPECT_THAT(owned.error().remedy, HasSubstr("DriveService.WriteParameters"));
}

TEST_F(NetworkAccess, TransactWantsTheRightKindOfBus) {
  EXPECT_THAT(transact({.bus = "can1", .node = 9, .object = 1}).error().remedy, HasSubstr("can0"));
  std::optional<Result<std::vector<std::uint16_t>>> answer;
  access_->transact({.bus = "can0", .node = 9}, [&](auto result) { answer = std::move(result); });
  ASSERT_TRUE(world_.run_until([&] { return answer.has_value(); }, 1s));
  EXPECT_EQ(answer->error().reason, Reason::invalid_argument);
  EXPECT_THAT(answer->error().message, HasSubstr("CAN network"));
}

TEST_F(NetworkAccess, ADriveWithANewNodeIdIsLookedForThere) {
  world_.run_for(5s);
  ASSERT_EQ(machine_->find("a1")->snapshot()->link, LinkState::online);
  std::vector<SerialProgress::Phase> phases;
  std::optional<Error> error;
  const auto token = drive_access_->change_serial("a1", {.node = 41, .baud = {}, .format = {}, .verify = 60s},
                                                  {.client = "t"}, [&](Result<SerialProgress> progress) {
                                                    if (progress)
                                                      phases.push_back(progress->phase);
                                                    else
                                                      error = progress.error();
                                                  });
  using enum SerialProgress::Phase;
  ASSERT_TRUE(world_.run_until([&] { return phases.size() == 2 || error; }, 30s));
  ASSERT_FALSE(error) << to_string(*error);
  auto& drive = *drives_.node(40);
  drive.set_power(false);
  drives_.advance();
  world_.run_for(2s);
  EXPECT_EQ(phases.size(), 2U) << "it is looked for";
  drive.set_power(true);
  drives_.advance();
  ASSERT_TRUE(world_.run_until([&] { return phases.size() == 3 || error; }, 30s));
  ASSERT_FALSE(error) << to_string(*error);
  EXPECT_THAT(phases, ElementsAre(written, waiting, verified));
  EXPECT_EQ(drive.address(), 41);
}

TEST_F(NetworkAccess, WhatACanNetworkCannotDoIsRefusedBeforeAnythingIsWritten) {
  world_.run_for(5s);
  const auto refused = [this](SerialChange change) {
    std::optional<Result<SerialProgress>> answer;
    const auto token =
        drive_access_->change_serial("a1", change, {.client = "t"}, [&](auto result) { answer = result; });
    EXPECT_TRUE(world_.run_until([&] { return answer.has_value(); }, 10s));
    return answer->error();
  };
  const auto before = drives_.node(40)->eeprom_writes();
  const auto format = refused({.node = {}, .baud = {}, .format = modbus_rtu::Format{}, .verify = {}});
  EXPECT_EQ(format.reason, Reason::not_supported);
  const auto rate = refused({.node = {}, .baud = 500'000, .format = {}, .verify = 10s});
  EXPECT_EQ(rate.reason, Reason::not_supported);
  EXPECT_THAT(rate.message, HasSubstr("cannot be looked for at 500000 bit/s"));
  EXPECT_EQ(refused({.node = 9, .baud = {}, .format = {}, .verify = {}}).reason, Reason::invalid_argument)
      << "another node's";
  EXPECT_EQ(drives_.node(40)->eeprom_writes(), before);
}

TEST_F(NetworkAccess, AScanAsksManyAtOnceAndNamesWhatItFinds) {
  add(20, {{0x100000, {.value = 0x00040192}},
           {0x101800, {.value = 4, .size = 1}},
           {0x101801, {.value = 0x1234}},
           {0x101802, {.value = 0x5678}},
           {0x101803, {.value = 0x00010002}},
           {0x101804, {.value = 99}}});
  add(21, {{0x101801, {.value = 1}}});
  auto& foreign = add(22, {});
  foreign.silent = true;
  foreign.send(0x700 + 22, {4});
  world_.run_for(10ms);
  const auto before = world_.now();
  const auto log = scan({});
  ASSERT_FALSE(log.error) << to_string(*log.error);
  EXPECT_LT(world_.now() - before, 1s) << "127 time-outs of 100 ms, 16 at once";
  EXPECT_EQ(log.reports.back().probed, 127);
  EXPECT_EQ(log.reports.back().total, 127);
  EXPECT_EQ(log.reports.front().probed, 16) << "progress";
  ASSERT_EQ(log.found.size(), 5U);
  EXPECT_EQ(log.found[0].node, 9);
  EXPECT_EQ(log.found[0].configured_as, "io");
  EXPECT_TRUE(log.found[0].on_network);
  EXPECT_EQ(log.found[0].baud, 1'000'000);
  EXPECT_EQ(log.found[0].identity->profile(), 401);
  EXPECT_FALSE(log.found[0].identity->vendor);
  EXPECT_EQ(log.found[0].model, "");
  EXPECT_EQ(log.found[1].node, 20);
  EXPECT_EQ(log.found[1].configured_as, "");
  EXPECT_EQ(log.found[1].identity->vendor, 0x1234U);
  EXPECT_EQ(log.found[1].identity->product, 0x5678U);
  EXPECT_EQ(log.found[1].identity->revision, 0x00010002U);
  EXPECT_EQ(log.found[1].identity->serial, 99U);
  EXPECT_EQ(log.found[1].model, "cia402") << "by its profile: a data sheet describes it";
  EXPECT_EQ(log.found[1].pulses_per_revolution, 0);
  EXPECT_EQ(log.found[2].node, 21);
  EXPECT_THAT(log.found[2].note, HasSubstr("no device type"));
  EXPECT_EQ(log.found[3].node, 22);
  EXPECT_THAT(log.found[3].note, HasSubstr("answers no SDO"));
  EXPECT_EQ(log.found[4].node, 40);
  EXPECT_EQ(log.found[4].model, "yss-c");
  EXPECT_EQ(log.found[4].configured_as, "a1");
  EXPECT_EQ(log.found[4].pulses_per_revolution, 4000);
  for (const auto& node : nodes_) EXPECT_EQ(node->writes, 0);
}

TEST_F(NetworkAccess, AScanTriesNoOtherBitRateAndNothingOfSerialLines) {
  const auto rates = scan({.bauds = {1'000'000, 500'000}});
  ASSERT_TRUE(rates.error);
  EXPECT_EQ(rates.error->reason, Reason::not_supported);
  EXPECT_THAT(rates.error->message, HasSubstr("axisd does not change the bit rate"));
  EXPECT_EQ(scan({.formats = {{}}}).error->reason, Reason::invalid_argument);
  EXPECT_EQ(scan({.first_node = 1, .last_node = 128}).error->reason, Reason::invalid_argument);
  const auto own = scan({.first_node = 9, .last_node = 9, .bauds = {1'000'000}});
  EXPECT_FALSE(own.error);
  EXPECT_EQ(own.found.size(), 1U);
}

TEST_F(NetworkAccess, AScanEndsWithTheLink) {
  port_->set_up(false);
  world_.run_for(100ms);
  const auto log = scan({});
  ASSERT_TRUE(log.error);
  EXPECT_EQ(log.error->reason, Reason::bus_down);
}

TEST_F(NetworkAccess, TheStatusSaysWhatIsOnTheNetwork) {
  auto& foreign = add(22, {});
  foreign.send(0x700 + 22, {4});
  foreign.send(0x80 + 22, {0, 0, 0, 0, 0, 0, 0, 0});
  (void)transact({.bus = "can0", .node = 60, .object = 0x620001});
  const auto status = machine_->bus_status();
  ASSERT_EQ(status.size(), 1U);
  EXPECT_EQ(status[0].kind, BusKind::canopen);
  EXPECT_EQ(status[0].port, "sim");
  EXPECT_EQ(status[0].baud, 1'000'000);
  EXPECT_TRUE(status[0].open);
  EXPECT_TRUE(status[0].simulated);
  ASSERT_TRUE(status[0].network);
  const auto& network = *status[0].network;
  EXPECT_EQ(network.link, can::InterfaceState::up);
  EXPECT_THAT(network.foreign_nodes, ElementsAre(22));
  EXPECT_EQ(network.others.foreign_node, 2U);
  EXPECT_GE(network.sdo.timeouts, 1U);
  EXPECT_GT(network.sdo.transfers, 0U);
  EXPECT_GT(network.frames.sent, 0U);
  EXPECT_GT(network.frames.received, 0U);
  EXPECT_EQ(network.sync_period, 10ms);
  port_->report(can::Controller::bus_off);
  EXPECT_EQ(machine_->bus_status()[0].network->link, can::InterfaceState::bus_off);
  world_.run_for(50ms);
  EXPECT_EQ(machine_->bus_status()[0].network->link,
            can::InterfaceState::up);  // a simulated one needs nobody
  EXPECT_TRUE(machine_->bus_status()[0].open);
  port_->set_up(false);
  world_.run_for(50ms);
  EXPECT_EQ(machine_->bus_status()[0].network->link, can::InterfaceState::down);
  EXPECT_FALSE(machine_->bus_status()[0].open);
  EXPECT_TRUE(machine_->bus_status()[0].error);
}

}  // namespace
}  // namespace axisd::core
