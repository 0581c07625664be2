#include "config/fields.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>

#include "tests/support/temporary_directory.hpp"
#include "tests/unit/config/support.hpp"

namespace axisd::config {
namespace {

using testing::ElementsAre;
using testing::IsEmpty;
using Kind = ConfigurationChangeKind;

constexpr auto one_axis = R"(
machine: press
state_directory: /tmp/press
buses:
  line-a: { modbus_rtu: { port: /dev/ttyUSB0 } }
axes:
  feeder:
    bus: line-a
    node: 1
    model: ykd2405pr
    unit: mm
    scale: { microstep: 10000 pulses/rev, travel: 5 mm/rev }
    limits: { velocity: 60 mm/s }
    inputs: { X0: home }
)";

Configuration read(const std::string& text) {
  const auto result = load_text(text, "press.yaml");
  EXPECT_TRUE(result.configuration) << findings(result);
  return result.configuration.value_or(Configuration{});
}

std::string with(std::string text, const std::string& what, const std::string& instead) {
  const auto at = text.find(what);
  EXPECT_NE(at, std::string::npos) << what;
  return text.replace(at, what.size(), instead);
}

std::vector<std::string> changes(const std::string& before, const std::string& after) {
  std::vector<std::string> texts;
  for (const auto& change : differences(read(before), read(after))) texts.push_back(to_string(change));
  return texts;
}

TEST(Differences, CommentsOrderAndSpellingAreNone) {
  const auto spelt = with(with(with(one_axis, "60 mm/s", "60.0 mm/s"), "mm\n", "'mm'  # as before\n"),
                          "inputs: { X0: home }", "inputs: { X0: { active: high, function: home } }");
  EXPECT_THAT(changes(one_axis, spelt), IsEmpty());
  const auto moved = with(with(one_axis, "machine: press\n", ""), "axes:", "machine: press\naxes:");
  EXPECT_THAT(changes(one_axis, moved), IsEmpty());
  EXPECT_THAT(changes(one_axis, std::string(one_axis) + "    require_trust: true\n"), IsEmpty())
      << "the default";
}

TEST(Differences, NameTheKeysOfWhatChanged) {
  const auto after = with(with(with(one_axis, "60 mm/s", "50 mm/s"), "{ X0: home }", "{ X1: home }"),
                          "machine: press", "machine: saw");
  EXPECT_THAT(changes(one_axis, after),
              ElementsAre("machine changed", "axes.feeder changed (inputs.X0, inputs.X1, limits.velocity)"));
  EXPECT_THAT(changes(one_axis, std::string(one_axis) + "    homing: { method: home_positive, velocity: "
                                                        "20 mm/s, search_velocity: 2 mm/s }\n"),
              ElementsAre(testing::StartsWith("axes.feeder changed (homing.acceleration_time, ")));
}

TEST(Differences, AddedAndRemoved) {
  const auto after = std::string(one_axis) + R"(  lifter:
    bus: line-a
    node: 2
    model: ykd2405pr
    unit: rev
    scale: { microstep: 1000 pulses/rev }
    limits: { velocity: 1 rev/s }
groups: { both: { axes: [feeder, lifter] } }
control: leased
leases: { default_ttl: 3 s }
)";
  EXPECT_THAT(changes(one_axis, after), ElementsAre("control changed", "leases changed (default_ttl)",
                                                    "axes.lifter added", "groups.both added"));
  EXPECT_THAT(changes(after, one_axis), ElementsAre("control changed", "leases changed (default_ttl)",
                                                    "axes.lifter removed", "groups.both removed"));
  // Another name is another axis, whatever it says.
  EXPECT_THAT(changes(one_axis, with(one_axis, "feeder", "pusher")),
              ElementsAre("axes.feeder removed", "axes.pusher added"));
}

TEST(Differences, AFileThatDescribesADriveBelongsToIt) {
  const test::TemporaryDirectory directory;
  const auto eds = directory.path() / "drive.eds";
  std::filesystem::copy_file(source_path("config/examples/standard-drive.eds"), eds);
  const auto text = R"(
machine: press
buses: { can0: { canopen: { interface: can0 } } }
axes:
  spindle:
    bus: can0
    node: 6
    model: cia402
    unit: rev
    scale: { microstep: 65536 pulses/rev }
    limits: { velocity: 10 rev/s }
    drive: { eds: )" +
                    eds.string() + ", velocity_unit: pulses_per_second }\n";
  const auto before = read(text);
  EXPECT_THAT(differences(before, read(text)), IsEmpty());
  std::ofstream(eds, std::ios::app) << "; another edition\n";
  EXPECT_THAT(differences(before, read(text)),
              ElementsAre(ConfigurationChange{
                  .section = "axes", .name = "spindle", .kind = Kind::changed, .keys = {"drive.eds"}}));
}

}  // namespace
}  // namespace axisd::config
