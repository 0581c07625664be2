// A Modbus drive of another maker beside those that the product has: told apart, found, configured.
#include <gtest/gtest.h>

#include <algorithm>
#include <set>

#include "config/configuration.hpp"
#include "devices/rtu_identification.hpp"
#include "tests/foreign_modbus/registers.hpp"
#include "tests/unit/daemon/core/bus_access_rig.hpp"

namespace axisd {
namespace {

using namespace std::chrono_literals;

const DriveDescriptor& servo() { return *find_drive_model("acme-s1"); }

std::vector<const DriveDescriptor*> others() {
  std::vector<const DriveDescriptor*> models;
  for (const auto* model : drive_models())
    if (model->bus == BusKind::modbus_rtu && model != &servo()) models.push_back(model);
  return models;
}

TEST(ForeignModel, SharesNothingWithTheOthers) {
  std::set<std::uint32_t> registers;
  for (const auto& parameter : servo().parameters) registers.insert(parameter.address);
  ASSERT_GE(others().size(), 3U);
  for (const auto* other : others()) {
    EXPECT_NE(other->identification.read, servo().identification.read);
    EXPECT_NE(other->identification.damaged_frame, servo().identification.damaged_frame);
    for (const auto& parameter : other->parameters) EXPECT_FALSE(registers.contains(parameter.address));
    for (const auto code : servo().identification.model_codes)
      EXPECT_EQ(std::ranges::count(other->identification.model_codes, code), 0);
  }
}

/// A line of one family is asked what it always was: the read that shows most models comes first.
TEST(ForeignModel, TheOthersAreAskedFirst) {
  const auto reads = rtu_identity_reads();
  ASSERT_EQ(reads.size(), 2U);
  EXPECT_EQ(reads.front(), others().front()->identification.read);
  EXPECT_EQ(reads.back(), servo().identification.read);
}

class ForeignScan : public core::test::BusAccessRig {};

TEST_F(ForeignScan, IsFoundAmongDrivesOfAnotherMaker) {
  add_drive("ssd2608pr", {.address = 30});
  add_drive("ess42-r", {.address = 31});
  add_drive("acme-s1", {.address = 40});
  add(41, {{7, 7}});                                 // refuses all reads
  add(42, {{0x1000, 1}, {0x1001, 2}, {0x1002, 3}});  // has the registers, and another code
  start();
  const auto log = scan({});
  ASSERT_FALSE(log.error) << to_string(*log.error);
  ASSERT_NE(log.node(40), nullptr);
  EXPECT_EQ(log.node(40)->model, "acme-s1");
  EXPECT_EQ(log.node(40)->model_code, acme_s1::model_code);
  EXPECT_EQ(log.node(40)->version, "2.07");
  EXPECT_EQ(log.node(1)->model, "ykd2405pr");
  EXPECT_EQ(log.node(30)->model, "ssd2608pr");
  EXPECT_EQ(log.node(31)->model, "ess42-r");
  for (const int node : {9, 41, 42}) EXPECT_EQ(log.node(static_cast<std::uint8_t>(node))->model, "") << node;
  EXPECT_EQ(log.node(42)->version, "");
  for (const auto& entry : line_->wire()) {
    EXPECT_FALSE(entry.is_write()) << "a scan reads only";
    const bool is_yako = entry.node() == 1 || entry.node() == 2 || entry.node() == 30 || entry.node() == 31;
    if (is_yako) EXPECT_LT(entry.address(), acme_s1::reg::identity) << "they are asked nothing new";
  }
  // Who does not answer is asked once.
  EXPECT_EQ(std::ranges::count_if(line_->wire(), [](const auto& entry) { return entry.node() == 77; }), 1);
}

std::string file_with(std::string_view axis) {
  return "machine: test\n"
         "buses:\n"
         "  line-a: {modbus_rtu: {port: sim, baud: 115200}}\n"
         "axes:\n"
         "  feeder:\n"
         "    bus: line-a\n"
         "    node: 1\n"
         "    model: acme-s1\n"
         "    unit: mm\n" +
         std::string(axis);
}

TEST(ForeignModel, IsConfiguredAsAnyOther) {
  const auto loaded =
      config::load_text(file_with("    scale: {microstep: 8192 pulses/rev, travel: 81.92 mm/rev}\n"
                                  "    limits: {position: [0 mm, 400 mm], velocity: 100 mm/s}\n"
                                  "    inputs: {I2: home}\n"),
                        "foreign.yaml");
  std::string findings;
  for (const auto& one : loaded.diagnostics) findings += to_string(one) + "\n";
  ASSERT_TRUE(loaded.configuration) << findings;
  EXPECT_EQ(loaded.configuration->axes.at(0).axis.model, "acme-s1");
  EXPECT_TRUE(config::json_schema().contains("acme-s1"));
}

}  // namespace
}  // namespace axisd
