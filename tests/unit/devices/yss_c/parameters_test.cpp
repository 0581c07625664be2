// The catalogue against the independent transcription of the manual (tests/conformance/manual), row by row.
#include "devices/yss_c/parameters.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <fstream>
#include <map>
#include <set>
#include <sstream>
#include <string>
#include <vector>

#include "devices/yss_c/objects.hpp"
#include "tests/support/source_tree.hpp"

namespace axisd::yss_c {
namespace {

/// A line of yss-c.csv, whose fields contain neither commas nor quotes.
struct Printed {
  std::uint32_t address = 0;
  std::string type, access;
  std::int64_t minimum = 0, maximum = 0;
  std::optional<std::int64_t> default_value;
  std::string unit, note;
};

std::vector<Printed> transcription() {
  std::ifstream file(test::in_source_tree("tests/conformance/manual/yss-c.csv"));
  std::vector<Printed> rows;
  std::string line;
  std::getline(file, line);
  while (std::getline(file, line)) {
    std::vector<std::string> fields;
    std::istringstream text(line);
    for (std::string field; std::getline(text, field, ',');) fields.push_back(field);
    fields.resize(12);
    rows.push_back({.address = static_cast<std::uint32_t>(std::stoul(fields[0], nullptr, 16) << 8U |
                                                          std::stoul(fields[1])),
                    .type = fields[2],
                    .access = fields[3],
                    .minimum = std::stoll(fields[4]),
                    .maximum = std::stoll(fields[5]),
                    .default_value = fields[6].empty() ? std::nullopt : std::optional(std::stoll(fields[6])),
                    .unit = fields[7],
                    .note = fields[11]});
  }
  return rows;
}

std::string name_of(ParameterType type) {
  return (is_signed(type) ? "I" : "U") + std::to_string(8 * size_of(type));
}
std::string name_of(Access access) {
  static const std::map<Access, std::string> names{
      {Access::ro, "RO"}, {Access::rw, "RW"}, {Access::rw_saved, "RW/S"}, {Access::wo, "WO"}};
  return names.at(access);
}

const ParameterSpec* find(std::uint32_t address) { return find_parameter(parameters(), address); }
const ParameterSpec* find(canopen::Object object) { return find(object.key()); }

TEST(YssCParameters, AreTheObjectsOfTheManual) {
  std::vector<std::uint32_t> printed, ours;
  for (const auto& row : transcription()) printed.push_back(row.address);
  for (const auto& one : parameters()) ours.push_back(one.address);
  EXPECT_EQ(196U, ours.size());
  std::ranges::sort(printed);
  EXPECT_EQ(printed, ours) << "in order of address, for find_parameter()";
}

TEST(YssCParameters, AgreeWithTheIndependentTranscription) {
  for (const auto& row : transcription()) {
    const auto* one = find(row.address);
    ASSERT_NE(nullptr, one) << std::hex << row.address;
    SCOPED_TRACE(std::string(one->name));
    EXPECT_EQ(row.type, name_of(one->type));
    EXPECT_EQ(row.access, name_of(one->access));
    EXPECT_EQ(row.default_value, one->default_value);
    EXPECT_EQ(row.unit, one->unit);
    if (row.note.starts_with("no range printed")) {  // then the row has what the type can hold
      EXPECT_GE(one->minimum, row.minimum);
      EXPECT_LE(one->maximum, row.maximum);
    } else {
      EXPECT_EQ(row.minimum, one->minimum);
      EXPECT_EQ(row.maximum, one->maximum);
    }
  }
}

TEST(YssCParameters, HaveUniqueNamesAndADescription) {
  std::set<std::string> names;
  for (const auto& one : parameters()) {
    EXPECT_TRUE(names.insert(std::string(one.name)).second) << one.name;
    EXPECT_EQ(std::string::npos, one.name.find_first_not_of("abcdefghijklmnopqrstuvwxyz0123456789_"))
        << one.name;
    EXPECT_FALSE(one.description.empty()) << one.name;
    EXPECT_LT(one.minimum, one.maximum) << one.name;
  }
}

TEST(YssCParameters, HaveRangesAndDefaultsThatTheirTypesHold) {
  for (const auto& one : parameters()) {
    const auto bits = 8 * size_of(one.type);
    const std::int64_t most = (std::int64_t{1} << (is_signed(one.type) ? bits - 1 : bits)) - 1;
    const std::int64_t least = is_signed(one.type) ? -most - 1 : 0;
    EXPECT_GE(one.minimum, least) << one.name;
    EXPECT_LE(one.maximum, most) << one.name;
    if (!one.default_value) continue;
    EXPECT_GE(*one.default_value, one.minimum) << one.name;
    EXPECT_LE(*one.default_value, one.maximum) << one.name;
  }
}

/// 7: 200Fh to 2012h are write-only; nothing is triggered by writing a parameter.
TEST(YssCParameters, PointFromEveryTriggerToTheRpcThatDoesIt) {
  std::set<std::uint32_t> triggers;
  for (const auto& one : parameters()) {
    if (one.access == Access::wo) triggers.insert(one.address);
    EXPECT_EQ(one.access == Access::wo, one.instead.find("Service.") != std::string_view::npos) << one.name;
  }
  EXPECT_EQ((std::set<std::uint32_t>{0x200F00, 0x201000, 0x201100, 0x201200}), triggers);
}

TEST(YssCParameters, NameThePdosOneByOne) {
  EXPECT_EQ("rpdo0_cob_id", find(0x140001)->name);
  EXPECT_EQ(0x200, find(0x140001)->default_value);
  EXPECT_EQ("rpdo3_event_timer", find(0x140305)->name) << "not printed, but counted";
  EXPECT_EQ("rpdo0_mapping_1", find(0x160001)->name);
  EXPECT_EQ(0x60400010, find(0x160001)->default_value);
  EXPECT_EQ("tpdo3_cob_id", find(0x180301)->name);
  EXPECT_EQ(0x480, find(0x180301)->default_value);
  EXPECT_EQ("tpdo3_mapping_4", find(0x1A0304)->name);
}

TEST(YssCParameters, CallObjectsByTheNamesOfTheHeader) {
  const std::pair<canopen::Object, std::string_view> named[] = {
      {object::moving, "moving"},
      {object::microstep, "microstep"},
      {object::custom_node, "custom_node"},
      {object::custom_baud, "custom_baud"},
      {object::overtravel_stop, "overtravel_stop"},
      {object::eeprom_update, "eeprom_update"},
      {object::start_speed, "start_speed"},
      {object::input_levels, "input_levels"},
      {object::first_input_function, "input_function_x0"},
      {object::output_levels, "output_levels"},
      {object::first_output_function, "output_function_y0"},
      {object::closed_loop_current, "closed_loop_current_percent"},
      {object::last_gain, "holding_speed_proportional"},
      {object::first_filter, "input_filter_x0_x1"},
      {object::last_filter, "input_filter_x6"},
      {object::status_word, "status_word"},
      {object::target_pulses, "target_pulses"},
      {object::homing_search_speed, "homing_search_speed"},
      {object::target_speed, "target_speed"}};
  for (const auto& [object, name] : named) {
    ASSERT_NE(nullptr, find(object)) << name;
    EXPECT_EQ(name, find(object)->name);
  }
}

/// 6.2.4, 6.2.5: their ranges are negative, too, although chapter 7 prints U32.
TEST(YssCParameters, CountTargetsWithASign) {
  EXPECT_EQ(ParameterType::i32, find(object::target_pulses)->type);
  EXPECT_EQ(ParameterType::i32, find(object::target_speed)->type);
  EXPECT_EQ(-1'000'000, find(object::target_pulses)->minimum);
  EXPECT_EQ(-3000, find(object::target_speed)->minimum);
}

}  // namespace
}  // namespace axisd::yss_c
