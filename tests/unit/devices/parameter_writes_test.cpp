// Parameters that a client writes, and what counts from the next power-up only.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/unit/devices/configuration_bench.hpp"

namespace axisd {
namespace {

using testing::ElementsAre;

using ParameterWrites = DriveConfigurationSteps;

TEST_F(ParameterWrites, WritesParametersThatDifferAndReadsAllBack) {
  memory_->values[saving_switch] = 0;
  const auto present = run(configuration_->write_parameters({{.address = microstep, .value = 3},
                                                             {.address = overtravel, .value = 0},
                                                             {.address = x0, .value = 1}}));
  ASSERT_TRUE(present);
  EXPECT_EQ(present->at(0).value, 3);
  EXPECT_EQ(memory_->log(), "numbers 11 17 41; 11=3; 41=1; numbers 11 17 41");
  EXPECT_THAT(memory_->asked, ElementsAre(2, 1, 1)) << "all of them first";
  EXPECT_EQ(memory_->counted, 2U);
}

TEST_F(ParameterWrites, WritesNoParameterIfNotAllMayBeSaved) {
  memory_->budget = 1;
  EXPECT_EQ(
      run(configuration_->write_parameters({{.address = microstep, .value = 3}, {.address = x0, .value = 1}}))
          .error()
          .reason,
      Reason::eeprom_budget);
  EXPECT_EQ(memory_->log(), "numbers 11 41");
}

TEST_F(ParameterWrites, ANumberMayComeWithoutItsSign) {
  auto words = traits();
  words.value_mask = 0xFFFF;
  let(words);
  memory_->values[microstep] = -1;
  EXPECT_TRUE(run(configuration_->write_parameters({{.address = microstep, .value = 0xFFFF}})));
  EXPECT_EQ(memory_->log(), "numbers 11; numbers 11");
  EXPECT_TRUE(run(configuration_->write_parameters({{.address = microstep, .value = -2}})));
  EXPECT_EQ(memory_->log(), "numbers 11; 11=65534; numbers 11");
}

TEST_F(ParameterWrites, AParameterThatDoesNotHoldIsNamed) {
  memory_->deaf = {microstep};
  const auto refused = run(configuration_->write_parameters({{.address = microstep, .value = 3}}));
  ASSERT_FALSE(refused);
  EXPECT_EQ(refused.error().reason, Reason::misconfigured);
  EXPECT_EQ(refused.error().where.object, microstep);
  EXPECT_EQ(refused.error().message, "reads 8 after 3 was written");
}

TEST_F(ParameterWrites, SavesWhatCountsFromTheNextPowerUp) {
  EXPECT_TRUE(run(configuration_->save_writes(false)));
  (void)memory_->log();
  EXPECT_TRUE(run(configuration_->write_saved({{.address = microstep, .value = 3}})));
  EXPECT_EQ(memory_->log(), "saves; numbers 11; 11=3; numbers 11; saves not");
  EXPECT_THAT(memory_->asked, ElementsAre(3, 1, 1, 1)) << "the switch twice and the value, then each";
  memory_->budget = 2;
  EXPECT_EQ(run(configuration_->write_saved({{.address = microstep, .value = 4}})).error().reason,
            Reason::eeprom_budget);
  EXPECT_EQ(memory_->log(), "");
  memory_->budget = 3;
  memory_->write_ends = {fail(refused())};
  EXPECT_EQ(run(configuration_->write_saved({{.address = microstep, .value = 4}})).error().reason,
            Reason::refused);
  EXPECT_EQ(memory_->log(), "saves; numbers 11; 11=4; saves not") << "it is left as it was";
}

}  // namespace
}  // namespace axisd
