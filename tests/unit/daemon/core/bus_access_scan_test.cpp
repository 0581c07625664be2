#include <algorithm>
#include <set>

#include "bus_access_rig.hpp"

namespace axisd::core {
namespace {

using namespace std::chrono_literals;
using modbus_rtu::Format;
using modbus_rtu::Parity;

class BusScanTest : public test::BusAccessRig {
 protected:
  /// Frames in other settings than the line's.
  [[nodiscard]] std::ptrdiff_t foreign_frames() const {
    return std::ranges::count_if(
        line_->wire(), [](const auto& entry) { return entry.serial != modbus_rtu::SerialSettings{}; });
  }
};

TEST_F(BusScanTest, FindsAndNamesWhatAnswersAtTheBusesOwnSettings) {
  add_drive("ssd2608pr", {.address = 30});
  add_drive("ess42-r", {.address = 31});
  add(40, {{7, 7}});  // refuses the read
  start();
  const auto log = scan({});
  ASSERT_FALSE(log.error) << to_string(*log.error);
  std::vector<int> nodes;
  nodes.reserve(log.found.size());
  for (const auto& found : log.found) nodes.push_back(found.node);
  EXPECT_EQ(nodes, (std::vector{1, 2, 9, 30, 31, 40}));
  const auto& axis = *log.node(1);
  EXPECT_EQ(axis.model, "ykd2405pr");
  EXPECT_EQ(axis.model_code, 0x0301);
  EXPECT_EQ(axis.pulses_per_revolution, 1000);
  EXPECT_EQ(axis.configured_as, "a1");
  EXPECT_EQ(axis.baud, 115200);
  EXPECT_EQ(axis.format, Format{});
  EXPECT_EQ(axis.note, "");
  EXPECT_EQ(axis.version.front(), 'V');
  EXPECT_EQ(log.node(30)->model, "ssd2608pr");
  EXPECT_EQ(log.node(31)->model, "ess42-r");
  EXPECT_EQ(log.node(30)->configured_as, "");
  EXPECT_GT(log.node(30)->pulses_per_revolution, 0);
  EXPECT_EQ(log.node(9)->configured_as, "io");
  EXPECT_EQ(log.node(9)->model, "");
  EXPECT_EQ(log.node(9)->model_code, 0x4242);
  EXPECT_EQ(log.node(9)->version, "");
  EXPECT_EQ(log.node(40)->model, "");
  EXPECT_EQ(foreign_frames(), 0);
  for (const auto& entry : line_->wire()) EXPECT_FALSE(entry.is_write()) << "a scan reads only";
}

TEST_F(BusScanTest, ReportsAtLeastEverySixteenProbesAndEndsWithFinished) {
  start();
  const auto log = scan({.first_node = 1, .last_node = 60});
  int probed = 0;
  for (const auto& report : log.reports) {
    EXPECT_EQ(report.total, 60);
    EXPECT_LE(report.probed - probed, 16);
    EXPECT_GT(report.probed, probed);
    EXPECT_EQ(report.finished, report.probed == 60);
    probed = report.probed;
  }
  EXPECT_EQ(probed, 60);
}

TEST_F(BusScanTest, TakesABoundedTimeAgainAndAgain) {
  start();
  for (int round = 0; round < 2; ++round) {
    line_->forget_wire();
    const auto began = world_.now();
    ASSERT_FALSE(scan({.first_node = 50, .last_node = 99, .reply_timeout = 20ms}).error);
    Duration others{};
    for (const auto& entry : line_->wire())
      if (entry.node() < 50) others += entry.end - entry.begin + 2ms;
    const auto each = 20ms + 10ms + 4ms;  // timeout, the bus's margin, the frames and silences
    EXPECT_LE(world_.now() - began - others, 50 * each) << round;
  }
}

TEST_F(BusScanTest, FindsNodesAtOtherRatesAndFormatsWithoutDisturbingTheAxes) {
  add_drive("ykd2405pr", {.address = 17, .dip_baud = 9600});
  add_drive("ess42-r", {.address = 18, .dip_baud = 38400});
  add(19, {{0, 1}, {1, 2}}, simulation::Serial{.baud = 19200, .format = {.parity = Parity::even}});
  start();
  const auto log = scan({.first_node = 1,
                         .last_node = 20,
                         .bauds = {9600, 19200, 38400, 115200},
                         .formats = {Format{}, Format{.parity = Parity::even}}});
  ASSERT_FALSE(log.error) << to_string(*log.error);
  EXPECT_EQ(log.reports.back().total, 20 * 4 * 2);
  ASSERT_EQ(log.found.size(), 6U);
  EXPECT_EQ(log.node(17)->baud, 9600);
  EXPECT_EQ(log.node(17)->model, "ykd2405pr");
  EXPECT_EQ(log.node(18)->baud, 38400);
  EXPECT_EQ(log.node(18)->model, "ess42-r");
  EXPECT_EQ(log.node(19)->baud, 19200);
  EXPECT_EQ(log.node(19)->format, Format{.parity = Parity::even});
  EXPECT_EQ(log.node(1)->baud, 115200);
  EXPECT_GE(foreign_frames(), 20 * 7);
  for (const char* axis : {"a1", "a2"}) EXPECT_EQ(machine_->find(axis)->snapshot()->link, LinkState::online);
  EXPECT_EQ(machine_->find("a1")->snapshot()->reboots, 0);
}

TEST_F(BusScanTest, OtherSettingsAreRefusedWhileAnAxisIsEnabled) {
  start();
  submit("a2", EnableRequest{});
  line_->forget_wire();
  const auto log = scan({.bauds = {115200, 9600}});
  ASSERT_TRUE(log.error);
  EXPECT_EQ(log.error->reason, Reason::fault);
  EXPECT_NE(log.error->message.find("'a2'"), std::string::npos);
  EXPECT_NE(log.error->remedy.find("disable"), std::string::npos);
  EXPECT_TRUE(log.reports.empty()) << "refused before anything was sent";
  EXPECT_EQ(foreign_frames(), 0);
  EXPECT_FALSE(scan({.last_node = 10}).error) << "its own settings disturb nobody";
}

TEST_F(BusScanTest, OtherSettingsAreRefusedWhileAnAxisMoves) {
  start();
  submit("a1", EnableRequest{});
  submit("a1", MoveVelocityRequest{.velocity = 50});
  const auto log = scan({.bauds = {9600}});
  ASSERT_TRUE(log.error);
  EXPECT_EQ(log.error->reason, Reason::moving);
  EXPECT_EQ(foreign_frames(), 0);
}

TEST_F(BusScanTest, EndsWhenAnAxisComesToLife) {
  start();
  ScanLog log;
  const auto token = begin_scan({.bauds = {9600}}, log);
  world_.run_for(1s);
  EXPECT_FALSE(log.over());
  EXPECT_GT(foreign_frames(), 10);
  submit("a1", EnableRequest{});
  ASSERT_TRUE(log.error);
  EXPECT_EQ(log.error->reason, Reason::fault);
  EXPECT_TRUE(machine_->find("a1")->snapshot()->enabled);
  line_->forget_wire();
  world_.run_for(1s);
  EXPECT_EQ(foreign_frames(), 0);
}

TEST_F(BusScanTest, OfflineAxesDoNotForbidOtherSettings) {
  start();
  line_->network().node(2)->set_power(false);
  ASSERT_TRUE(
      world_.run_until([this] { return machine_->find("a2")->snapshot()->link == LinkState::offline; }, 5s));
  EXPECT_FALSE(scan({.last_node = 5, .bauds = {9600}}).error);
}

TEST_F(BusScanTest, GarbledRepliesAreNoted) {
  for (const std::uint16_t content : {0x00FF, 0xFF00}) add(33, {{0, content}, {1, content}});
  start();
  const auto log = scan({.first_node = 30, .last_node = 35});
  ASSERT_EQ(log.found.size(), 1U);
  EXPECT_EQ(log.found[0].node, 33);
  EXPECT_NE(log.found[0].note.find("two nodes on one address"), std::string::npos);
  EXPECT_EQ(log.found[0].model, "");
}

TEST_F(BusScanTest, ADroppedTokenEndsIt) {
  start();
  ScanLog log;
  auto token = begin_scan({}, log);
  world_.run_for(300ms);
  const auto reports = log.reports.size();
  token.reset();
  world_.run_for(100ms);
  line_->forget_wire();
  world_.run_for(2s);
  EXPECT_EQ(log.reports.size(), reports);
  std::set<int> nodes;
  for (const auto& entry : line_->wire()) nodes.insert(entry.node());
  EXPECT_EQ(nodes, (std::set{1, 2, 9}));
  EXPECT_FALSE(scan({.last_node = 3}).error) << "the next one may begin";
}

TEST_F(BusScanTest, OneAtATimeAndOnlyWhatMakesSense) {
  start();
  ScanLog log;
  const auto token = begin_scan({}, log);
  EXPECT_EQ(scan({}).error->reason, Reason::busy);
  ASSERT_TRUE(world_.run_until([&] { return log.over(); }, 60s));
  EXPECT_FALSE(log.error);
  const ScanRequest wrong[] = {
      {.first_node = 0},  {.last_node = 248},     {.first_node = 5, .last_node = 4}, {.bauds = {0}},
      {.bauds = {-9600}}, {.bauds = {2'000'000}}, {.reply_timeout = -1ms},           {.reply_timeout = 2s}};
  line_->forget_wire();
  for (const auto& request : wrong) {
    const auto refused = scan(request);
    ASSERT_TRUE(refused.error);
    EXPECT_EQ(refused.error->reason, Reason::invalid_argument);
  }
  std::optional<Result<ScanProgress>> unknown;
  const auto other = access_->scan({.bus = "line-b"}, [&](auto progress) { unknown = std::move(progress); });
  ASSERT_TRUE(world_.run_until([&] { return unknown.has_value(); }, 1s));
  EXPECT_EQ(unknown->error().reason, Reason::invalid_argument);
}

TEST_F(BusScanTest, EndsWithTheBusAndWithRatesThatThePortCannotDo) {
  start();
  ScanLog log;
  const auto token = begin_scan({}, log);
  world_.run_for(200ms);
  line_->set_open(false);
  world_.run_for(500ms);
  ASSERT_TRUE(log.error);
  EXPECT_EQ(log.error->reason, Reason::bus_down);
  line_->set_open(true);
  world_.run_for(3s);
  line_->set_can_do([](const auto& serial) { return serial.baud != 9600; });
  EXPECT_EQ(scan({.bauds = {9600}}).error->reason, Reason::not_supported);
}

}  // namespace
}  // namespace axisd::core
