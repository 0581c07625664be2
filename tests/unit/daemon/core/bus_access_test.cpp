// Other devices on the line, and single exchanges (M28).
#include <algorithm>

#include "bus_access_rig.hpp"

namespace axisd::core {
namespace {

using namespace std::chrono_literals;

class BusAccessTest : public test::BusAccessRig {};

TEST_F(BusAccessTest, DevicesArePolledBesideTheAxesAndWritten) {
  EXPECT_EQ(access_->devices().at(0)->link, LinkState::offline) << "known before the first poll";
  start();
  const auto devices = access_->devices();
  ASSERT_EQ(devices.size(), 1U);
  EXPECT_EQ(devices[0]->name, "io");
  EXPECT_EQ(devices[0]->link, LinkState::online);
  EXPECT_EQ(devices[0]->values.at(0).value, 77);
  std::optional<Result<double>> written;
  access_->write_device("io", "level", 5, [&](auto result) { written = result; });
  ASSERT_TRUE(world_.run_until([&] { return written.has_value(); }, 1s));
  EXPECT_EQ(written->value(), 5);
  EXPECT_EQ(io_->registers[1], 5);
  EXPECT_EQ(access_->devices().at(0)->values.at(0).value, 5);
  written.reset();
  access_->write_device("a1", "level", 5, [&](auto result) { written = result; });
  ASSERT_TRUE(world_.run_until([&] { return written.has_value(); }, 1s));
  EXPECT_EQ(written->error().reason, Reason::invalid_argument);
}

TEST_F(BusAccessTest, ASilentDeviceDoesNotDisturbTheAxes) {
  io_->silent = true;
  start();
  world_.run_for(5s);
  EXPECT_EQ(access_->devices().at(0)->link, LinkState::offline);
  EXPECT_EQ(machine_->find("a1")->snapshot()->link, LinkState::online);
}

TEST_F(BusAccessTest, TransactReadsAnyNodeAndWritesThoseThatNoAxisOwns) {
  start();
  EXPECT_EQ(transact({.bus = "line-a", .node = 1, .address = 0, .count = 1})->at(0), 0x0301);
  EXPECT_EQ(*transact({.bus = "line-a", .node = 9, .address = 0, .count = 2}),
            (std::vector<std::uint16_t>{0x4242, 77}));
  line_->forget_wire();
  ASSERT_TRUE(transact({.bus = "line-a", .node = 9, .address = 1, .values = {8}}));
  ASSERT_TRUE(transact({.bus = "line-a", .node = 9, .address = 0, .values = {6, 7}}));
  EXPECT_EQ(io_->registers[0], 6);
  EXPECT_EQ(io_->registers[1], 7);
  std::vector<int> functions;
  for (const auto& entry : line_->wire())
    if (entry.is_write()) functions.push_back(entry.function());
  EXPECT_EQ(functions, (std::vector{0x06, 0x10}));
}

TEST_F(BusAccessTest, TransactRefusesWithoutSending) {
  start();
  line_->forget_wire();
  const auto owned = transact({.bus = "line-a", .node = 2, .address = 0x0027, .values = {1}});
  EXPECT_EQ(owned.error().reason, Reason::invalid_argument);
  EXPECT_NE(owned.error().message.find("'a2'"), std::string::npos);
  EXPECT_NE(owned.error().remedy.find("DriveService.WriteParameters"), std::string::npos);
  EXPECT_EQ(owned.error().outcome, Outcome::not_sent);
  EXPECT_EQ(transact({.bus = "line-a", .node = 0, .address = 1, .values = {1}}).error().reason,
            Reason::invalid_argument);
  EXPECT_EQ(transact({.bus = "line-a", .node = 9, .address = 1, .count = 126}).error().reason,
            Reason::invalid_argument);
  const auto unknown = transact({.bus = "line-b", .node = 9});
  EXPECT_EQ(unknown.error().reason, Reason::invalid_argument);
  EXPECT_NE(unknown.error().remedy.find("line-a"), std::string::npos);
  for (const auto node : {0, 2, 9}) EXPECT_FALSE(was_written(static_cast<std::uint8_t>(node)));
}

TEST_F(BusAccessTest, TransactSaysWhatIsKnown) {
  start();
  const auto refused = transact({.bus = "line-a", .node = 9, .address = 500, .values = {1}});
  EXPECT_EQ(refused.error().reason, Reason::refused);
  EXPECT_EQ(refused.error().where.native_code, 2U);
  line_->network().faults().add({.kind = simulation::FaultKind::drop_reply, .node = 9, .function = 6});
  const auto lost = transact({.bus = "line-a", .node = 9, .address = 1, .values = {3}});
  EXPECT_EQ(lost.error().reason, Reason::no_reply);
  EXPECT_EQ(lost.error().outcome, Outcome::unknown);
  EXPECT_NE(lost.error().message.find("unknown"), std::string::npos);
  line_->set_open(false);
  world_.run_for(100ms);
  EXPECT_EQ(transact({.bus = "line-a", .node = 9}).error().reason, Reason::bus_down);
}

TEST_F(BusAccessTest, TwoDrivesOnOneAddressAreReportedAsSuch) {
  add_drive("ess42-r", {.address = 2});
  machine_->start();
  const auto reported = [this] {
    const auto state = machine_->find("a2")->snapshot();
    return state->link_error &&
           state->link_error->message.find("two nodes on one address") != std::string::npos;
  };
  ASSERT_TRUE(world_.run_until(reported, 10s));
  const auto state = machine_->find("a2")->snapshot();
  EXPECT_EQ(state->link, LinkState::offline);
  EXPECT_EQ(state->link_error->reason, Reason::no_reply);
  EXPECT_EQ(state->link_error->where.bus, "line-a");
  EXPECT_EQ(state->link_error->where.node, 2);
  EXPECT_FALSE(was_written(2));
  EXPECT_EQ(machine_->find("a1")->snapshot()->link, LinkState::online);
}

TEST_F(BusAccessTest, ClosingEndsWhatIsUnderWay) {
  start();
  std::optional<Result<std::vector<std::uint16_t>>> answer;
  access_->transact({.bus = "line-a", .node = 60}, [&](auto result) { answer = std::move(result); });
  ScanLog log;
  const auto token = begin_scan({}, log);
  world_.run_for(5ms);
  machine_->close();
  EXPECT_TRUE(world_.run_until([this] { return machine_->closed(); }, 10s));
  ASSERT_TRUE(answer);
  EXPECT_FALSE(*answer);
  ASSERT_TRUE(log.error);
  EXPECT_EQ(log.error->reason, Reason::cancelled);
}

}  // namespace
}  // namespace axisd::core
