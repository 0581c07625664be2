// Configuration, parameters, memory and address of a simulated YSS-C.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "devices/drive_access.hpp"
#include "devices/yss_c/objects.hpp"
#include "tests/unit/devices/cia402/drive_bench.hpp"

namespace axisd::cia402 {
namespace {

namespace object = yss_c::object;
using ::testing::HasSubstr;

constexpr std::uint32_t lock_current = 0x204400, speed_smoothing = 0x204800;

DriveSetup with_jog() {
  auto setup = DriveBench::plain_setup();
  setup.inputs = {{.terminal = "X0", .function = "positive_limit"},
                  {.terminal = "X3", .function = "jog_positive"}};
  return setup;
}

TEST(Cia402Parameters, ConfiguresWithoutWearingTheEeprom) {
  DriveBench bench({}, with_jog());
  const auto before = bench.simulated().eeprom_writes();
  bench.bring_up();
  EXPECT_EQ(bench.simulated().peek(object::microstep.key()), 10U);
  EXPECT_EQ(bench.simulated().peek(object::first_input_function.key()), 2U);
  EXPECT_EQ(bench.simulated().peek(0x203005), 12U);
  EXPECT_EQ(bench.simulated().peek(object::overtravel_stop.key()), 1U);
  EXPECT_EQ(bench.simulated().peek(object::eeprom_update.key()), 1U) << "told not to save";
  EXPECT_LE(bench.simulated().eeprom_writes() - before, 1U) << "the switch itself, at most";
  bench.cycle_power();
  EXPECT_EQ(bench.simulated().peek(object::microstep.key()), 8U);
}

TEST(Cia402Parameters, SavesTheConfigurationOnceWithPersist) {
  auto setup = with_jog();
  setup.persist = PersistSettings::all();
  DriveBench bench({}, setup);
  const auto before = bench.simulated().eeprom_writes();
  const auto identity = bench.run(bench.drive().identify(TransactionClass::parameters));
  ASSERT_TRUE(identity);
  ASSERT_TRUE(bench.run(bench.drive().configure()));
  const auto written = bench.simulated().eeprom_writes() - before;
  EXPECT_GE(bench.drive().take_eeprom_writes().registers, written) << "counted, rather too many than too few";
  EXPECT_GE(written, 4U);
  bench.cycle_power();
  EXPECT_EQ(bench.simulated().peek(object::microstep.key()), 10U) << "kept";
  const auto again = bench.simulated().eeprom_writes();
  (void)bench.run(bench.drive().identify(TransactionClass::parameters));
  (void)bench.run(bench.drive().configure());  // may say first that the drive was switched off
  ASSERT_TRUE(bench.run(bench.drive().configure()));
  EXPECT_LE(bench.simulated().eeprom_writes() - again, 2U) << "compared before it is written";
}

/// Whatever would be saved is asked for, and not sent where it is not permitted.
TEST(Cia402Parameters, SavesNothingThatIsNotPermitted) {
  auto setup = with_jog();
  setup.persist = PersistSettings::all();
  DriveBench bench({}, setup);
  std::uint64_t permitted = 0, asked = 0;
  bench.drive().ask_before_saving([&](std::uint64_t saves) -> Result<void> {
    asked += saves;
    if (saves > permitted) return fail(Reason::eeprom_budget, "used up", "wait");
    return {};
  });
  const auto reason = [](const auto& result) { return result ? Reason::internal : result.error().reason; };
  ASSERT_TRUE(bench.run(bench.drive().identify(TransactionClass::parameters)));
  const auto before = bench.simulated().eeprom_writes();
  const auto counted = [&] { return bench.drive().take_eeprom_writes().saves; };
  for (int attempt = 0; attempt < 3; ++attempt)
    EXPECT_EQ(reason(bench.run(bench.drive().configure())), Reason::eeprom_budget);
  EXPECT_EQ(bench.simulated().eeprom_writes(), before);
  EXPECT_EQ(counted(), 0U);
  permitted = 20;  // at a time
  const auto configured = bench.run(bench.drive().configure());
  ASSERT_TRUE(configured) << to_string(configured.error());
  const auto after = bench.simulated().eeprom_writes();
  EXPECT_GT(after, before);
  EXPECT_GT(counted(), 0U);
  permitted = 0;
  asked = 0;
  EXPECT_EQ(reason(bench.run(bench.drive().facets().memory->save_parameters())), Reason::eeprom_budget);
  EXPECT_EQ(reason(bench.run(bench.drive().facets().memory->restore_factory({}))), Reason::eeprom_budget);
  EXPECT_EQ(reason(bench.run(bench.drive().facets().serial->change_serial({.node = 40}))),
            Reason::eeprom_budget);
  EXPECT_GT(asked, 1U + 1U + 3U) << "a new node-ID and the switch twice; and the configuration once more";
  EXPECT_TRUE(bench.run(bench.drive().configure())) << "nothing is to be saved";
  EXPECT_EQ(bench.simulated().eeprom_writes(), after);
  EXPECT_EQ(counted(), 0U);
}

/// M3: the function goes in only while its input is inactive.
TEST(Cia402Parameters, HoldsBackAnInputThatCouldStartAtOnce) {
  DriveBench bench({}, with_jog());
  bench.simulated().set_input("X3", true);
  bench.nodes().advance();
  bench.world().run_for(std::chrono::milliseconds(50));
  ASSERT_TRUE(bench.run(bench.drive().identify(TransactionClass::parameters)));
  const auto configured = bench.run(bench.drive().configure());
  ASSERT_FALSE(configured);
  EXPECT_EQ(configured.error().reason, Reason::misconfigured);
  EXPECT_THAT(configured.error().message, HasSubstr("inputs.X3"));
  EXPECT_EQ(bench.simulated().peek(0x203005), 0U);
  EXPECT_EQ(bench.simulated().peek(object::first_input_function.key()), 2U) << "limits come first";
  bench.simulated().set_input("X3", false);
  bench.nodes().advance();
  bench.world().run_for(std::chrono::milliseconds(50));
  const auto later = bench.run(bench.drive().configure());
  ASSERT_TRUE(later) << to_string(later.error());
  EXPECT_EQ(bench.simulated().peek(0x203005), 12U);
  EXPECT_EQ(bench.simulated().starts(), 0);
}

TEST(Cia402Parameters, ReportsDriftOfTerminalsAndScale) {
  DriveBench bench({}, with_jog());
  bench.bring_up();
  const auto none = bench.run(bench.drive().check_drift({}));
  ASSERT_TRUE(none);
  EXPECT_EQ(none->text, "");
  bench.simulated().poke(object::first_input_function.key(), 0);
  bench.simulated().poke(object::microstep.key(), 3);
  const auto drift = bench.run(bench.drive().check_drift({}));
  ASSERT_TRUE(drift);
  EXPECT_TRUE(drift->scale_changed);
  EXPECT_TRUE(drift->limits_changed);
  EXPECT_THAT(drift->text, HasSubstr("inputs.X0 (object 2030h:02) reads 0 instead of 2"));
}

TEST(Cia402Parameters, AComparisonEndsWithItsGate) {
  DriveBench bench({}, with_jog());
  bench.bring_up();
  const auto gate = std::make_shared<AxisGate>();
  const TransactionOptions options{.guard = {.gate = gate, .epoch = gate->epoch()}};
  EXPECT_TRUE(bench.run(bench.drive().check_drift(options)));
  gate->raise();
  const auto drift = bench.run(bench.drive().check_drift(options));
  ASSERT_FALSE(drift);
  EXPECT_EQ(drift.error().reason, Reason::superseded) << to_string(drift.error());
}

TEST(Cia402Parameters, NamesTheOwnerOfEachObject) {
  auto setup = with_jog();
  setup.homing = HomingProfile{.velocity_rpm = 100, .search_velocity_rpm = 20};
  DriveBench bench({}, setup);
  const auto owner = [&](canopen::Object object) {
    return bench.drive().facets().parameters->configured_by(object.key());
  };
  EXPECT_EQ(owner(object::first_input_function), "inputs.X0");
  EXPECT_EQ(owner(object::microstep), "scale.microstep");
  EXPECT_EQ(owner(object::loop_mode), "drive.loop_mode");
  EXPECT_EQ(owner(object::homing_speed), "homing.velocity");
  EXPECT_EQ(owner(object::homing_method), "homing.method");
  EXPECT_EQ(owner(object::control_word), "AxisService.Enable");
  EXPECT_EQ(owner(object::halt_option), "AxisService.Stop");
  EXPECT_EQ(owner(object::position), "AxisService.SetPosition");
  EXPECT_EQ(owner(object::target_speed), "each motion command");
  EXPECT_EQ(owner(object::mode), "each motion command");
  EXPECT_EQ(owner(object::maximum_speed), "limits.velocity");
  EXPECT_EQ(owner(object::acceleration_time), "limits.acceleration_time");
  EXPECT_EQ(owner(object::start_speed), "limits.start_speed");
  EXPECT_EQ(owner(object::eeprom_update), "persist");
  EXPECT_EQ(owner(object::custom_node), "DriveService.Readdress");
  EXPECT_EQ(owner(object::custom_baud), "DriveService.SetSerial");
  EXPECT_EQ(owner({0x1017, 0}), "the CANopen master");
  EXPECT_EQ(owner({0x1A00, 1}), "the CANopen master");
  EXPECT_EQ(owner({0x1018, 1}), "") << "read-only";
  EXPECT_EQ(owner({0x2044, 0}), "") << "free";
}

TEST(Cia402Parameters, ReadsTheWholeDictionary) {
  DriveBench bench;
  bench.bring_up();
  std::vector<std::uint32_t> readable;
  for (const auto& one : yss_c::model().descriptor->parameters)
    if (one.access != Access::wo) readable.push_back(one.address);
  const auto values = bench.run(bench.drive().facets().parameters->read_parameters(readable));
  ASSERT_TRUE(values) << to_string(values.error());
  EXPECT_GE(values->size() + 4, readable.size()) << "four are implied only";
  for (const auto& value : *values) {
    const auto* spec = find_parameter(yss_c::model().descriptor->parameters, value.address);
    ASSERT_NE(spec, nullptr);
    const auto bits = bench.simulated().peek(value.address);
    const auto mask = size_of(spec->type) == 4 ? 0xFFFFFFFFU : (1U << (8 * size_of(spec->type))) - 1;
    EXPECT_EQ(static_cast<std::uint32_t>(value.value) & mask, bits & mask) << spec->name;
  }
}

TEST(Cia402Parameters, ReadsNegativeNumbersAsSuch) {
  DriveBench bench;
  bench.bring_up();
  const auto written =
      bench.run(bench.drive().facets().parameters->write_parameters({{object::homing_offset.key(), -300}}));
  ASSERT_TRUE(written) << to_string(written.error());
  EXPECT_EQ(written->front().value, -300);
  EXPECT_EQ(static_cast<std::int32_t>(bench.simulated().peek(object::homing_offset.key())), -300);
}

TEST(Cia402Parameters, WritesWhatDiffersAndReadsItBack) {
  DriveBench bench;
  bench.bring_up();
  const auto before = bench.simulated().eeprom_writes();
  const auto written = bench.run(
      bench.drive().facets().parameters->write_parameters({{lock_current, 30}, {speed_smoothing, 5}}));
  ASSERT_TRUE(written) << to_string(written.error());
  EXPECT_EQ(*written, (std::vector<ParameterValue>{{lock_current, 30}, {speed_smoothing, 5}}));
  EXPECT_EQ(bench.simulated().peek(lock_current), 30U);
  EXPECT_EQ(bench.simulated().eeprom_writes(), before) << "without persist";
}

TEST(Cia402Parameters, RefusalsNameObjectAndAbortCode) {
  DriveBench bench;
  bench.bring_up();
  const auto missing = bench.run(bench.drive().facets().parameters->read_parameters({0x209900}));
  ASSERT_FALSE(missing);
  EXPECT_EQ(missing.error().where.object, 0x209900U);
  EXPECT_EQ(missing.error().where.native_code, 0x06020000U);
  EXPECT_EQ(to_string(missing.error()).find("2099h:00"), to_string(missing.error()).rfind("2099h:00"));
  EXPECT_THAT(to_string(missing.error()), HasSubstr("object 2099h:00: "));
  const auto value = bench.run(bench.drive().facets().parameters->write_parameters({{lock_current, 101}}));
  ASSERT_FALSE(value);
  EXPECT_EQ(value.error().where.object, lock_current);
  EXPECT_EQ(value.error().where.native_code.value_or(0) & 0xFFFFFFF0U, 0x06090030U);
}

TEST(Cia402Parameters, SavesNothingThatMovesAfterAPowerUp) {
  DriveBench bench;
  bench.bring_up();
  bench.simulated().poke(object::target_speed.key(), 500);
  ASSERT_TRUE(bench.run(bench.drive().facets().parameters->write_parameters({{lock_current, 30}})));
  const auto saved = bench.run(bench.drive().facets().memory->save_parameters());
  ASSERT_TRUE(saved) << to_string(saved.error());
  EXPECT_GT(bench.drive().take_eeprom_writes().registers, 100U) << "all RW objects";
  EXPECT_TRUE(bench.run(bench.drive().check_continuity(TransactionClass::parameters))) << "another canary";
  bench.cycle_power();
  EXPECT_EQ(bench.simulated().peek(lock_current), 30U);
  EXPECT_EQ(bench.simulated().peek(object::target_speed.key()), 0U);
  EXPECT_EQ(bench.simulated().peek(object::target_pulses.key()), 0U);
  const auto identified = bench.run(bench.drive().identify(TransactionClass::parameters));
  const auto found = bench.run(bench.drive().check_continuity(TransactionClass::parameters));
  EXPECT_TRUE(!identified || !found) << "the saved block is no proof";
}

TEST(Cia402Parameters, RestoresTheFactorySettingsAndSaysWhereItWillBe) {
  DriveBench bench;
  bench.bring_up();
  const auto restored = bench.run(bench.drive().facets().memory->restore_factory({1, 2}));
  ASSERT_TRUE(restored) << to_string(restored.error());
  EXPECT_THAT(*restored, HasSubstr("node-ID 5 by its switches"));
  EXPECT_THAT(*restored, HasSubstr("1 Mbit/s with SW2 off"));
  EXPECT_EQ(bench.simulated().peek(object::microstep.key()), 8U);
  const auto again = bench.run(bench.drive().configure());
  ASSERT_TRUE(again) << to_string(again.error());
  EXPECT_EQ(bench.simulated().peek(object::microstep.key()), 10U);
}

TEST(Cia402Parameters, ADriveByItsOwnNodeIdIsUndefinedAfterRestoring) {
  DriveBench bench({.address = 33});
  bench.bring_up();
  const auto restored = bench.run(bench.drive().facets().memory->restore_factory({}));
  ASSERT_TRUE(restored) << to_string(restored.error());
  EXPECT_THAT(*restored, HasSubstr("undefined (set the address switches first)"));
}

TEST(Cia402Parameters, SavesAnotherNodeIdAndBitRateEvenWithoutPersist) {
  DriveBench bench;
  bench.bring_up();
  const auto changed = bench.run(bench.drive().facets().serial->change_serial({.node = 40, .baud = 250'000}));
  ASSERT_TRUE(changed) << to_string(changed.error());
  EXPECT_THAT(*changed, HasSubstr("all address switches off"));
  EXPECT_THAT(*changed, HasSubstr("SW2 on"));
  EXPECT_EQ(bench.simulated().peek(object::custom_node.key()), 40U);
  EXPECT_EQ(bench.simulated().peek(object::custom_baud.key()), 1U);
  EXPECT_EQ(bench.simulated().peek(object::eeprom_update.key()), 1U) << "as before";
  bench.cycle_power();
  EXPECT_EQ(bench.simulated().peek(object::custom_node.key()), 40U);
}

TEST(Cia402Parameters, RefusesAddressesThatNoObjectCanHold) {
  DriveBench bench;
  bench.bring_up();
  const auto reason = [&](SerialChange change) {
    const auto changed = bench.run(bench.drive().facets().serial->change_serial(change));
    return changed ? Reason::internal : changed.error().reason;
  };
  EXPECT_EQ(reason({.node = 15}), Reason::out_of_range) << "by the switches only (4.4)";
  EXPECT_EQ(reason({.baud = 1'000'000}), Reason::out_of_range) << "SW2 off";
  EXPECT_EQ(reason({.format = modbus_rtu::Format{}}), Reason::not_supported);
  EXPECT_EQ(reason({}), Reason::invalid_argument);
  EXPECT_EQ(bench.simulated().peek(object::custom_node.key()), 0U);
}

TEST(Cia402Parameters, HasNoSegments) {
  DriveBench bench;
  bench.bring_up();
  EXPECT_EQ(bench.drive().facets().segments, nullptr);
}

}  // namespace
}  // namespace axisd::cia402
