#include "devices/cia402_eds/eds_drive.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <fstream>
#include <set>
#include <sstream>
#include <utility>

#include "devices/axis/planner.hpp"
#include "devices/cia402/encoding.hpp"
#include "devices/cia402/objects.hpp"
#include "devices/cia402_eds/eds_checks.hpp"
#include "devices/cia402_eds/simulator_dictionary.hpp"
#include "tests/support/source_tree.hpp"

namespace axisd::cia402_eds {
namespace {

using namespace std::chrono_literals;
using ::testing::ElementsAre;
using ::testing::HasSubstr;

const std::string path = test::in_source_tree("config/examples/standard-drive.eds");

std::string example() {
  std::ifstream file(path);
  std::ostringstream text;
  text << file.rdbuf();
  return text.str();
}

/// The example without an object: its section is renamed to one that is none.
std::string without(std::string text, const std::string& section) {
  const auto at = text.find("\n[" + section + "]");
  EXPECT_NE(at, std::string::npos) << section;
  text.replace(at, section.size() + 3, "\n[Unused" + section + "]");
  const auto listed = text.find("=0x" + section);
  if (listed != std::string::npos) text.replace(listed, section.size() + 3, "=0x1000");
  return text;
}

canopen::Eds parsed(const std::string& text) {
  auto eds = canopen::parse_eds(text);
  if (!eds) throw std::runtime_error(eds.error().front().message);
  return *eds;
}

const DriveDescriptor& base() { return *find_drive_model("cia402"); }

EdsDrive drive_of(const std::string& text, const Conventions& conventions = {}) {
  return EdsDrive(base(), parsed(text), conventions);
}

std::uint8_t bytes_of(canopen::DataType type) {
  return static_cast<std::uint8_t>(canopen::info(type).bits / 8);
}

TEST(StandardEds, DescribesTheSimulatedDrive) {
  simulation::CanopenDictionary dictionary;
  add_rows(dictionary);
  const auto eds = parsed(example());
  for (const auto& [object, entry] : eds.objects) {
    SCOPED_TRACE(to_string(object));
    const auto* row = dictionary.find(object.index, object.sub);
    ASSERT_NE(row, nullptr);
    if (entry.type == canopen::DataType::visible_string) {
      EXPECT_EQ(entry.text_initial, row->text);
      continue;
    }
    EXPECT_EQ(bytes_of(entry.type), row->size);
    EXPECT_EQ(canopen::info(entry.type).kind == canopen::TypeInfo::Kind::integer, row->is_signed);
    EXPECT_EQ(canopen::writable(entry.access), row->access != Access::ro);
    if (object.index >= 0x6000) EXPECT_EQ(entry.mappable, row->mappable);
    if (entry.low) EXPECT_EQ(entry.low->value, row->minimum);
    if (entry.high) EXPECT_EQ(entry.high->value, row->maximum);
    if (entry.initial && !entry.initial->plus_node_id)
      EXPECT_EQ(entry.initial->value, dictionary.get(object.index, object.sub));
  }
  std::size_t rows = 0;
  for (unsigned index = 0x1000; index < 0x7000; ++index)
    for (unsigned sub = 0; sub <= 8; ++sub)
      rows += dictionary.find(static_cast<std::uint16_t>(index), static_cast<std::uint8_t>(sub)) != nullptr
                  ? 1
                  : 0;
  EXPECT_EQ(rows, eds.objects.size());
}

TEST(EdsDrive, HasTheParametersOfItsEds) {
  const auto drive = drive_of(example());
  const auto* velocity = find_parameter(drive.parameters, 0x608100);
  ASSERT_NE(velocity, nullptr);
  EXPECT_EQ(velocity->name, "profile_velocity");
  EXPECT_EQ(velocity->access, Access::rw);
  EXPECT_EQ(velocity->maximum, 2'000'000);
  EXPECT_EQ(velocity->default_value, 10'000);
  EXPECT_EQ(velocity->type, ParameterType::u32);
  EXPECT_EQ(find_parameter(drive.parameters, 0x140001)->name, "cob_id_1400_01");
  EXPECT_FALSE(find_parameter(drive.parameters, 0x140001)->default_value) << "it depends on the node-ID";
  EXPECT_EQ(find_parameter(drive.parameters, 0x606C00)->minimum, -2147483648LL);
  EXPECT_EQ(find_parameter(drive.parameters, 0x100800), nullptr) << "a text";
  std::set<std::string_view> names;
  for (const auto& row : drive.parameters) EXPECT_TRUE(names.insert(row.name).second) << row.name;
}

TEST(EdsDrive, IsToldByItsIdentity) {
  const auto drive = drive_of(example());
  const auto& identity = drive.model().identity;
  EXPECT_EQ(identity.profile, 402);
  EXPECT_EQ(identity.vendor, 0x0A5AU);
  EXPECT_EQ(identity.product, 0x00402001U);
  EXPECT_FALSE(identity.revision) << "a later one is the same drive";
  // Without 1018h the head of the file tells, and where that is 0, too, nothing is compared.
  auto text = without(without(example(), "1018sub1"), "1018sub2");
  EXPECT_EQ(drive_of(text).model().identity.product, 0x00402001U);
  text.replace(text.find("ProductNumber=0x00402001"), 24, "ProductNumber=0");
  EXPECT_FALSE(drive_of(text).model().identity.product);
}

TEST(EdsDrive, ConvertsAsItsConventionsSay) {
  const auto by_pulses = drive_of(example());
  EXPECT_EQ(by_pulses.capabilities.maximum_pulse_rate_hz, 2'000'000);
  EXPECT_EQ(by_pulses.model().meaning.units.velocity, cia402::pulses_per_second);
  EXPECT_EQ(by_pulses.model().meaning.units.ramps, cia402::Ramps::rates);
  EXPECT_TRUE(by_pulses.capabilities.closed_loop);
  const auto by_rpm = drive_of(example(), {.units = {}, .closed_loop = false});
  EXPECT_EQ(by_rpm.capabilities.maximum_rpm, 2'000'000);
  EXPECT_EQ(by_rpm.capabilities.minimum_time_ms, 1);
  EXPECT_EQ(by_rpm.model().meaning.units.velocity, cia402::revolutions_per_minute);
  EXPECT_FALSE(by_rpm.capabilities.closed_loop);
  EXPECT_EQ(by_rpm.capabilities.position_source, PositionSource::commanded);
  const auto conventions =
      conventions_of(parsed(example()), {{"velocity_unit", "rpm"}, {"ramps", "time"}, {"loop_mode", "open"}});
  ASSERT_TRUE(conventions) << to_string(conventions.error());
  EXPECT_EQ(conventions->units.velocity, cia402::revolutions_per_minute);
  EXPECT_EQ(conventions->units.ramps, cia402::Ramps::times);
  EXPECT_FALSE(conventions->closed_loop);
}

TEST(EdsDrive, LimitsFollowTheUnitOfVelocities) {
  const auto limits = [](std::string_view unit) {
    return drive_of(example(), {.units = {.velocity = *cia402::unit_named(unit)}}).capabilities;
  };
  // 6081h and 60FFh: at most 2,000,000.
  EXPECT_EQ(limits("0.001rpm").maximum_rpm, 2000);
  EXPECT_EQ(limits("0.001rpm").minimum_rpm, 1);
  EXPECT_EQ(limits("0.1degrees_per_second").maximum_rpm, 33'333);
  EXPECT_EQ(limits("rev_per_second").maximum_rpm, 120'000'000);
  EXPECT_EQ(limits("rev_per_second").minimum_rpm, 300) << "5 counts";
  EXPECT_EQ(limits("rev_per_second").minimum_search_rpm, 300);
  EXPECT_EQ(limits("radians_per_second").minimum_homing_rpm, 48);
  EXPECT_DOUBLE_EQ(limits("rev_per_second").velocity_count.rpm, 60);
  EXPECT_FALSE(limits("rev_per_second").velocity_count.of_pulse);
  EXPECT_TRUE(limits("pulses_per_second").velocity_count.of_pulse);
}

TEST(EdsDrive, LacksWhatItsEdsLacks) {
  EXPECT_TRUE(drive_of(example()).capabilities.homing);
  EXPECT_EQ(drive_of(example()).model().homing_codes.size(), 4U);
  const auto no_homing = drive_of(without(example(), "6098"));
  EXPECT_FALSE(no_homing.capabilities.homing);
  EXPECT_TRUE(no_homing.model().homing_codes.empty());
  auto text = example();
  text.replace(text.find("DefaultValue=0x00000025"), 23, "DefaultValue=0x00000005");
  EXPECT_FALSE(drive_of(text).capabilities.homing) << "6502h";
  const auto no_inputs = drive_of(without(example(), "60FD"));
  EXPECT_TRUE(no_inputs.inputs.empty());
  EXPECT_FALSE(no_inputs.model().objects.inputs);
  EXPECT_TRUE(drive_of(example()).model().objects.save);
  const auto no_memory = drive_of(without(without(example(), "1010sub1"), "1011sub1"));
  EXPECT_FALSE(no_memory.model().objects.save || no_memory.model().objects.restore);
}

std::vector<std::string> missing_in(const std::string& text) {
  std::vector<std::string> messages;
  for (const auto& finding : check_eds(parsed(text))) messages.push_back(finding.message);
  return messages;
}

TEST(EdsDrive, BrakesAsItAcceleratesWithoutADeceleration) {
  auto read_only = example();
  read_only.replace(read_only.find("AccessType=rww", read_only.find("\n[6084]")), 14, "AccessType=ro");
  const MoveProfile profile{
      .target_pulses = 5, .velocity_rpm = 60, .acceleration_time = 100ms, .deceleration_time = 100ms};
  for (const auto& text : {without(example(), "6084"), read_only}) {
    EXPECT_THAT(missing_in(text), ElementsAre());
    const auto drive = drive_of(text);
    EXPECT_FALSE(drive.capabilities.own_deceleration);
    EXPECT_EQ(drive.can_transactions.continuity_transfers, 3);
    EXPECT_EQ(cia402::encode(drive.model(), 1000, profile), (cia402::MotionBlock{5, 1000, 10'000, 0, 0}));
    EXPECT_EQ(cia402::default_block(drive.model()), (cia402::MotionBlock{0, 10'000, 100'000, 0, 0}));
  }
  const auto both = drive_of(example());
  EXPECT_TRUE(both.capabilities.own_deceleration);
  EXPECT_EQ(cia402::encode(both.model(), 1000, profile), (cia402::MotionBlock{5, 1000, 10'000, 10'000, 0}));
}

TEST(EdsDrive, ADecelerationThatIsOnlyReadIsWhatItBrakesWith) {
  auto read_only = example();
  read_only.replace(read_only.find("AccessType=rww", read_only.find("\n[6084]")), 14, "AccessType=ro");
  EXPECT_EQ(drive_of(read_only).capabilities.fixed_deceleration, 100'000) << "its default";
  EXPECT_EQ(drive_of(without(example(), "6084")).capabilities.fixed_deceleration, 0);
  EXPECT_EQ(drive_of(example()).capabilities.fixed_deceleration, 0) << "it is written";
}

TEST(EdsDrive, RampsAreCountsOfTheirUnit) {
  const auto count = [](cia402::Units units) {
    return drive_of(example(), {.units = units}).capabilities.acceleration_count;
  };
  using cia402::Ramps;
  EXPECT_DOUBLE_EQ(count({.ramps = Ramps::rates, .acceleration = *cia402::unit_named("rev_per_second")}).rpm,
                   60);
  const auto pulses = count({.ramps = Ramps::rates, .acceleration = cia402::pulses_per_second});
  EXPECT_DOUBLE_EQ(pulses.rpm, 60);
  EXPECT_TRUE(pulses.of_pulse);
  EXPECT_DOUBLE_EQ(count({.ramps = Ramps::times}).rpm, 0);
}

/// What the planner takes for sent is what is encoded.
TEST(EdsDrive, IsPredictedByTheRampsThatAreSent) {
  const auto drive = drive_of(example(), {.units = {.velocity = *cia402::unit_named("rev_per_second"),
                                                    .ramps = cia402::Ramps::rates,
                                                    .acceleration = *cia402::unit_named("rev_per_second")}});
  AxisSettings settings;
  settings.scale = {.pulses_per_revolution = 1000, .unit = "rev"};
  settings.limits.velocity = 20;
  settings.limits.start_speed_rpm = 0;
  const Scale scale(settings.scale);
  const Planner planner(settings, drive, scale);
  for (const int rpm : {300, 333, 600, 1199})
    for (const auto time : {1ms, 7ms, 99ms, 667ms, 1000ms, 30'000ms}) {
      const auto plan = planner.profile(rpm / 60.0, {.acceleration_time = time}).value();
      const auto block = cia402::encode(drive.model(), 1000,
                                        MoveProfile{.velocity_rpm = plan.velocity_rpm,
                                                    .acceleration_time = plan.acceleration_time,
                                                    .deceleration_time = plan.deceleration_time});
      const auto speed = static_cast<double>(block[cia402::speed]);
      const auto takes = [speed](std::int32_t counts) { return std::max(1.0, 1000 * speed / counts); };
      const auto in_ms = [](Duration granted) { return static_cast<double>(granted / 1ms); };
      EXPECT_NEAR(in_ms(*plan.granted.acceleration_time), takes(block[cia402::acceleration]), 0.51) << rpm;
      EXPECT_NEAR(in_ms(*plan.granted.deceleration_time), takes(block[cia402::deceleration]), 0.51) << rpm;
    }
}

TEST(EdsDrive, NeedsWhatTheDriverUses) {
  EXPECT_TRUE(missing_in(example()).empty());
  auto text = without(without(example(), "6040"), "607A");
  EXPECT_THAT(missing_in(text), ElementsAre("object 6040h:00 (control word) is missing",
                                            "object 607Ah:00 (target position) is missing"));
  text = example();
  text.replace(text.find("DefaultValue=0x00000025"), 23, "DefaultValue=0x00000024");
  EXPECT_THAT(missing_in(text), ElementsAre("by object 6502h:00 the drive has no profile position mode"));
  text = example();
  const auto at = text.find("[6081]");
  text.replace(text.find("AccessType=rww", at), 14, "AccessType=ro");
  text.replace(text.find("DataType=0x0004", text.find("[6064]")), 15, "DataType=0x0015");
  EXPECT_THAT(missing_in(text),
              ElementsAre("object 6064h:00 (position actual value) is no whole number of 8, 16 or 32 bits",
                          "object 6081h:00 (profile velocity) cannot be written"));
}

std::vector<int> homing_numbers(const canopen::Eds& eds) {
  const EdsDrive drive(base(), eds, {});
  std::vector<int> numbers;
  for (const auto& one : drive.capabilities.homing_numbers) numbers.push_back(one.number);
  return numbers;
}

TEST(EdsDrive, HomesByNumbersThatItsEdsPermits) {
  using canopen::EdsNumber;
  auto eds = parsed(example());
  EXPECT_EQ(homing_numbers(eds).size(), 128U + 37U);
  eds.objects.at({0x6098, 0}).low = EdsNumber{.value = -2};
  eds.objects.at({0x6098, 0}).high = EdsNumber{.value = 3};
  EXPECT_THAT(homing_numbers(eds), ElementsAre(-2, -1, 1, 2, 3));
  const auto list = [&eds](std::uint8_t sub, std::optional<std::int64_t> value) {
    const canopen::Object object{0x60E3, sub};
    canopen::EdsObject entry{.object = object, .name = "Supported homing methods"};
    if (value) entry.initial = EdsNumber{.value = *value};
    eds.objects.insert_or_assign(object, std::move(entry));
  };
  list(0, 4);
  for (const auto& [sub, value] : {std::pair(1, 37), std::pair(2, 0xFF), std::pair(3, 17)})
    list(static_cast<std::uint8_t>(sub), value);
  list(4, std::nullopt);
  EXPECT_EQ(homing_numbers(eds).size(), 5U) << "it does not say all of them";
  list(4, 18);
  EXPECT_THAT(homing_numbers(eds), ElementsAre(-1, 17, 18, 37));
  const EdsDrive drive(base(), eds, {});
  std::vector<int> mirrors;
  for (const auto& one : drive.capabilities.homing_numbers) mirrors.push_back(one.mirror);
  EXPECT_THAT(mirrors, ElementsAre(0, 18, 17, 37));
  EXPECT_TRUE(drive_of(without(example(), "6098")).capabilities.homing_numbers.empty());
}

TEST(EdsDrive, PositionsWithoutVelocityMode) {
  auto no_bit = example(), read_only = example();
  no_bit.replace(no_bit.find("DefaultValue=0x00000025"), 23, "DefaultValue=0x00000021");
  read_only.replace(read_only.find("AccessType=rww", read_only.find("[60FF]")), 14, "AccessType=ro");
  const std::pair<std::string, std::string_view> lacking[] = {
      {without(example(), "60FF"), "object 60FFh:00 (target velocity) is missing"},
      {no_bit, "by object 6502h:00 the drive has no profile velocity mode"},
      {read_only, "object 60FFh:00 (target velocity) cannot be written"}};
  for (const auto& [text, why] : lacking) {
    EXPECT_THAT(missing_in(text), ElementsAre());
    const auto drive = drive_of(text);
    EXPECT_FALSE(drive.capabilities.velocity_mode);
    EXPECT_EQ(drive.capabilities.velocity_mode_lack, why);
    EXPECT_EQ(drive.capabilities.maximum_pulse_rate_hz, 2'000'000) << "6081h";
    EXPECT_EQ(drive.model().neutral_mode, cia402::OperationMode::homing);
  }
  const auto positions_alone = drive_of(without(without(example(), "60FF"), "6098"));
  EXPECT_EQ(positions_alone.model().neutral_mode, cia402::OperationMode::none);
  EXPECT_TRUE(positions_alone.capabilities.passes_no_mode);
  const auto homes_by_itself = drive_of(without(without(example(), "60FF"), "6099sub1"));
  EXPECT_FALSE(homes_by_itself.capabilities.homing) << "no speeds";
  EXPECT_EQ(homes_by_itself.model().neutral_mode, cia402::OperationMode::homing) << "the mode is there";
  EXPECT_FALSE(homes_by_itself.capabilities.passes_no_mode);
  const auto both = drive_of(example());
  EXPECT_TRUE(both.capabilities.velocity_mode);
  EXPECT_EQ(both.model().neutral_mode, cia402::OperationMode::profile_velocity);
}

TEST(EdsDrive, IsMadeFromItsFile) {
  const auto made = base().specialise(base(), {{"eds", path}, {"velocity_unit", "pulses_per_second"}});
  ASSERT_TRUE(made) << to_string(made.error());
  EXPECT_EQ((*made)->model, "cia402");
  EXPECT_EQ((*made)->specialise, nullptr);
  EXPECT_FALSE((*made)->parameters.empty());
  const auto none = base().specialise(base(), {});
  ASSERT_FALSE(none);
  EXPECT_THAT(none.error().remedy, HasSubstr("eds"));
  const auto missing = base().specialise(base(), {{"eds", "/no/such.eds"}});
  ASSERT_FALSE(missing);
  EXPECT_EQ(missing.error().message, "/no/such.eds: cannot be read");
  EXPECT_THROW((void)base().make({}), std::invalid_argument);
}

TEST(EdsDrive, KnowsEveryAlarm) {
  EXPECT_EQ(find_alarm(base(), 0x8611)->name, "following_error");
  EXPECT_EQ(find_alarm(base(), 0xFF17)->reset, AlarmReset::by_command);
  EXPECT_EQ(find_alarm(base(), 0xFF17)->name, "specific_to_the_drive");
  EXPECT_EQ(find_alarm(base(), 0x2341)->name, "short_circuit_u_v");
  EXPECT_EQ(find_alarm(base(), 0x7308)->name, "sensor") << "by its class";
  EXPECT_EQ(find_alarm(base(), 0x2119)->name, "short_circuit_input") << "the nearest class, listed or not";
  EXPECT_EQ(find_alarm(base(), 0x2139)->name, "phase_short_circuit_input");
  EXPECT_EQ(find_alarm(base(), 0x8A17)->name, "control");
  EXPECT_EQ(find_alarm(base(), 0x90FF)->name, "external_error");
  EXPECT_EQ(find_alarm(base(), 0xB123)->name, "specific_to_the_drive");
  EXPECT_EQ(find_alarm(*find_drive_model("ykd2405pr"), 77), nullptr);
  EXPECT_TRUE(std::ranges::is_sorted(base().alarms, {}, &AlarmSpec::code));
}

}  // namespace
}  // namespace axisd::cia402_eds
