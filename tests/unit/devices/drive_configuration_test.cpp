// The steps of a configuration, each of them and each way to fail, without a bus.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <utility>
#include <vector>

#include "tests/unit/devices/configuration_bench.hpp"

namespace axisd {
namespace {

using testing::ElementsAre;
using testing::HasSubstr;

TEST_F(DriveConfigurationSteps, ReadsWritesWhatDiffersAndVerifiesAll) {
  EXPECT_TRUE(bring_to({microstep_of(3), input_of(x0, no_function)}));
  EXPECT_EQ(memory_->log(), "before 11 41 16; 11=3; after 11 41");
  EXPECT_EQ(memory_->counted, 0U) << "it does not save";
}

TEST_F(DriveConfigurationSteps, WritesNothingThatIsThere) {
  EXPECT_TRUE(bring_to({microstep_of(8)}));
  EXPECT_EQ(memory_->log(), "before 11 16; after 11");
}

TEST_F(DriveConfigurationSteps, LeavesBitsAloneThatItDoesNotDecide) {
  EXPECT_TRUE(bring_to({{.address = output_levels, .value = 0b010, .key = "outputs", .mask = 0b011}}));
  EXPECT_EQ(memory_->log(), "before 4b 16; 4b=6; after 4b");
}

TEST_F(DriveConfigurationSteps, WritesValuesSideBySideAtOnce) {
  EXPECT_TRUE(bring_to({levels_of(2), {.address = x0, .value = home, .key = "inputs.X0"}}));
  EXPECT_EQ(memory_->log(), "before 40 41 16; 40=2,1; after 40 41");
}

TEST_F(DriveConfigurationSteps, EndsARunAtAnotherConditionAGapAndWhatIsThere) {
  memory_->values[x1] = home;
  EXPECT_TRUE(bring_to({levels_of(2), input_of(x0, home), input_of(x1, home), microstep_of(3)}));
  EXPECT_EQ(memory_->log(), "before 40 41 42 11 16; 40=2; 41=1; 11=3; after 40 41 42 11")
      << "X0 is another input's condition, X1 is as it should be";
}

TEST_F(DriveConfigurationSteps, WritesOneByOneWhereTheBusHasNoBlocks) {
  auto single = traits();
  single.longest_run = 1;
  let(single);
  EXPECT_TRUE(bring_to({levels_of(2), {.address = x0, .value = home, .key = "inputs.X0"}}));
  EXPECT_EQ(memory_->log(), "before 40 41 16; 40=2; 41=1; after 40 41");
}

TEST_F(DriveConfigurationSteps, TakesAStartOffAnInputBeforeItsLevelTurns) {
  memory_->values[x0] = jog;
  EXPECT_TRUE(bring_to({levels_of(1), input_of(x0, jog)}));
  EXPECT_EQ(memory_->log(), "before 40 41 16; 41=0; 40=1; look; 41=12; after 40 41");
}

TEST_F(DriveConfigurationSteps, TakesAStartOffAnInputThatGetsAnotherFunction) {
  memory_->values[x0] = jog;
  EXPECT_TRUE(bring_to({levels_of(2), input_of(x0, home), input_of(x1, no_function)}));
  EXPECT_EQ(memory_->log(), "before 40 41 42 16; 41=0; 40=2; 41=1; after 40 41 42");
}

TEST_F(DriveConfigurationSteps, LeavesAStartWhereNothingOfItChanges) {
  memory_->values[x0] = jog;
  EXPECT_TRUE(bring_to({levels_of(2), input_of(x0, jog)}));
  EXPECT_EQ(memory_->log(), "before 40 41 16; 40=2; after 40 41") << "X1 turns, X0 does not";
}

TEST_F(DriveConfigurationSteps, TakesNothingElseOffAnInput) {
  memory_->values[x0] = home;
  EXPECT_TRUE(bring_to({levels_of(1), input_of(x0, home)}));
  EXPECT_EQ(memory_->log(), "before 40 41 16; 40=1; after 40 41");
  auto without = traits();
  without.input_levels.reset();
  let(without);
  memory_->values[x0] = jog;
  EXPECT_TRUE(bring_to({input_of(x0, home)}));
  EXPECT_EQ(memory_->log(), "before 41 16; 41=1; after 41") << "it has no levels that could be an edge";
}

TEST_F(DriveConfigurationSteps, WhatMayStartIsWrittenWhileReleasedAndInactiveOnly) {
  for (const auto& unfit : {DriveMemory::Activity{.enabled = true}, DriveMemory::Activity{.moving = true},
                            DriveMemory::Activity{.inputs = 0b01}}) {
    memory_->present = unfit;
    const auto done = bring_to({input_of(x0, jog)});
    ASSERT_FALSE(done);
    EXPECT_EQ(done.error().reason, Reason::misconfigured);
    EXPECT_EQ(done.error().where.object, x0);
    EXPECT_THAT(done.error().message, HasSubstr("inputs.X0 can start motion"));
    EXPECT_THAT(done.error().remedy, HasSubstr("release the drive"));
    EXPECT_EQ(memory_->log(), "before 41 16; look");
  }
  memory_->present = {.inputs = 0b10};
  EXPECT_TRUE(bring_to({input_of(x0, jog)})) << "another input may be active";
  memory_->values[x0] = 0;
  memory_->activity_fails = no_reply();
  EXPECT_EQ(bring_to({input_of(x0, jog)}).error().reason, Reason::no_reply);
}

TEST_F(DriveConfigurationSteps, LooksBeforeItTurnsTheSwitchForWhatMayStart) {
  memory_->present = {.enabled = true};
  auto jogs = input_of(x0, jog);
  jogs.saved = true;
  EXPECT_FALSE(bring_to({jogs}));
  EXPECT_EQ(memory_->log(), "before 41 16; look") << "turned in vain, it wears";
  memory_->present = {};
  EXPECT_TRUE(bring_to({jogs}));
  EXPECT_EQ(memory_->log(), "before 41 16; look; saves; look; 41=12; saves not; after 41");
}

TEST_F(DriveConfigurationSteps, SilencesWhatATerminalCouldStartHalfWritten) {
  memory_->values[row_speed] = 300;
  memory_->to_silence = {row_speed};
  const DriveSetting row{.address = row_speed, .value = 500, .key = "segments", .starts_motion = true};
  EXPECT_TRUE(bring_to({row}));
  EXPECT_EQ(memory_->log(), "before b0 16; look; b0=0; look; b0=500; after b0");
  memory_->present = {.enabled = true};
  EXPECT_FALSE(bring_to({row}));
  EXPECT_EQ(memory_->log(), "before b0 16; look");
}

TEST_F(DriveConfigurationSteps, SavesWhatIsToBeSavedAndNothingElse) {
  EXPECT_TRUE(bring_to({microstep_of(3, true), levels_of(1)}));
  EXPECT_EQ(memory_->log(), "before 11 40 16; saves; 11=3; saves not; 40=1; after 11 40");
  EXPECT_EQ(memory_->counted, 3U) << "the switch twice, the microstep";
  EXPECT_THAT(memory_->asked, ElementsAre(2, 1)) << "what is turned on for a write is permitted with it";
}

TEST_F(DriveConfigurationSteps, TurnsSavingForNothingThatIsNeverSaved) {
  memory_->values[saving_switch] = 0;
  EXPECT_TRUE(
      bring_to({{.address = overtravel, .value = 1, .key = "drive.overtravel_stop", .obeys_switch = false}}));
  EXPECT_EQ(memory_->log(), "before 17 16; 17=1; saves not; after 17");
  EXPECT_EQ(memory_->counted, 1U) << "the switch as it is left behind";
  EXPECT_TRUE(memory_->asked.empty()) << "what ends saving is not asked for";
}

TEST_F(DriveConfigurationSteps, LeavesSavingOnWhereAllIsSaved) {
  auto all = traits();
  all.saves_at_rest = true;
  let(all);
  memory_->values[saving_switch] = 0;
  EXPECT_TRUE(bring_to({microstep_of(3, true)}));
  EXPECT_EQ(memory_->log(), "before 11 16; 11=3; after 11");
  EXPECT_TRUE(configuration_->saves());
  EXPECT_TRUE(configuration_->is_saved(microstep));
  EXPECT_FALSE(configuration_->is_saved(overtravel));
}

TEST_F(DriveConfigurationSteps, ADriveWithoutASwitchSavesAsItIsMade) {
  auto without = traits();
  without.saving_switch.reset();
  let(without);
  EXPECT_TRUE(bring_to({microstep_of(3)}));
  EXPECT_EQ(memory_->log(), "before 11; 11=3; after 11");
  EXPECT_EQ(memory_->counted, 1U);
  EXPECT_TRUE(run(configuration_->save_writes(true)));
  EXPECT_EQ(memory_->log(), "");
}

TEST_F(DriveConfigurationSteps, NothingIsSentThatIsNotPermitted) {
  memory_->budget = 1;
  const auto done = bring_to({microstep_of(3, true)});
  EXPECT_EQ(done.error().reason, Reason::eeprom_budget);
  EXPECT_EQ(memory_->log(), "before 11 16");
  memory_->budget = 0;
  memory_->values[saving_switch] = 0;
  EXPECT_EQ(bring_to({microstep_of(3, true)}).error().reason, Reason::eeprom_budget);
  EXPECT_EQ(memory_->log(), "before 11 16; saves not");
  EXPECT_EQ(memory_->counted, 1U);
}

TEST_F(DriveConfigurationSteps, AWriteWithoutAReplyIsRepeatedAndEachMayHaveBeenSaved) {
  memory_->values[saving_switch] = 0;
  memory_->write_ends = {fail(no_reply()), fail(no_reply())};
  EXPECT_TRUE(bring_to({microstep_of(3, true)}));
  EXPECT_EQ(memory_->log(), "before 11 16; 11=3; 11=3; 11=3; saves not; after 11");
  EXPECT_THAT(memory_->asked, ElementsAre(1, 1, 1));
  EXPECT_EQ(memory_->counted, 4U);
  memory_->write_ends = {fail(no_reply()), fail(no_reply()), fail(no_reply())};
  EXPECT_EQ(bring_to({microstep_of(4)}).error().reason, Reason::no_reply);
  EXPECT_EQ(memory_->log(), "before 11 16; saves not; 11=4; 11=4; 11=4");
}

TEST_F(DriveConfigurationSteps, ARefusedWriteEndsItAndIsNotCounted) {
  memory_->values[saving_switch] = 0;
  memory_->write_ends = {fail(refused())};
  EXPECT_EQ(bring_to({microstep_of(3, true), levels_of(1)}).error().reason, Reason::refused);
  EXPECT_EQ(memory_->log(), "before 11 40 16; 11=3; saves not") << "what comes next must not wear the EEPROM";
  EXPECT_EQ(memory_->counted, 1U);
}

TEST_F(DriveConfigurationSteps, AReadThatFailsEndsIt) {
  memory_->read_fails_before = no_reply();
  EXPECT_EQ(bring_to({microstep_of(3)}).error().reason, Reason::no_reply);
  EXPECT_EQ(memory_->log(), "before 11 16");
  memory_->read_fails_before.reset();
  memory_->read_fails_after = no_reply();
  EXPECT_EQ(bring_to({microstep_of(3)}).error().reason, Reason::no_reply);
  EXPECT_EQ(memory_->log(), "before 11 16; 11=3; after 11");
}

TEST_F(DriveConfigurationSteps, ASwitchThatCannotBeTurnedEndsIt) {
  memory_->values[saving_switch] = 0;
  memory_->switch_fails = no_reply();
  EXPECT_EQ(bring_to({microstep_of(8)}).error().reason, Reason::no_reply);
  EXPECT_EQ(memory_->log(), "before 11 16; saves not");
  EXPECT_EQ(memory_->counted, 1U) << "it may have been turned";
  EXPECT_TRUE(configuration_->saves()) << "as far as is known";
  memory_->switch_fails = refused();
  EXPECT_EQ(bring_to({microstep_of(8)}).error().reason, Reason::refused);
  EXPECT_EQ(memory_->counted, 1U) << "it was not";
}

TEST_F(DriveConfigurationSteps, WhatDoesNotHoldIsNamedWithItsPlace) {
  memory_->deaf = {microstep};
  const auto done = bring_to({microstep_of(3)});
  ASSERT_FALSE(done);
  EXPECT_EQ(done.error().reason, Reason::misconfigured);
  EXPECT_EQ(done.error().where.object, microstep);
  EXPECT_EQ(done.error().message, "scale.microstep (place 11) reads 8 after 3 was written");
  EXPECT_THAT(done.error().remedy, HasSubstr("another master"));
  (void)memory_->log();
  EXPECT_FALSE(bring_to({microstep_of(3)}));
  EXPECT_EQ(memory_->log(), "before 11 16; 11=3; after 11") << "not saved: it may be tried again";
}

TEST_F(DriveConfigurationSteps, WhatDoesNotHoldIsNotSavedAgainInThisPowerCycle) {
  memory_->deaf = {microstep};
  EXPECT_FALSE(bring_to({microstep_of(3, true)}));
  (void)memory_->log();
  const auto again = bring_to({microstep_of(3, true)});
  EXPECT_EQ(again.error().message, "scale.microstep (place 11) reads 8 after 3 was written");
  EXPECT_EQ(memory_->log(), "before 11 16");
  configuration_->forget_power_cycle();
  memory_->deaf.clear();
  EXPECT_TRUE(bring_to({microstep_of(3, true)}));
}

TEST_F(DriveConfigurationSteps, AfterAPowerCycleSavingIsNotKnown) {
  EXPECT_TRUE(run(configuration_->save_writes(false)));
  EXPECT_FALSE(configuration_->saves());
  configuration_->forget_power_cycle();
  EXPECT_TRUE(configuration_->saves());
}

TEST_F(DriveConfigurationSteps, AppliesItsSetup) {
  let(traits(), std::vector{microstep_of(3, true), levels_of(1)});
  EXPECT_EQ(configuration_->key_of(microstep), "scale.microstep");
  EXPECT_EQ(configuration_->key_of(overtravel), "");
  EXPECT_EQ(configuration_->saves_of_setup(), 3U) << "the switch twice";
  EXPECT_TRUE(run(configuration_->apply()));
  EXPECT_EQ(memory_->values.at(microstep), 3);
  let(traits(), std::vector{levels_of(1)});
  EXPECT_EQ(configuration_->saves_of_setup(), 0U);
}

TEST_F(DriveConfigurationSteps, ASetupThatCannotBeHadIsNotApplied) {
  let(traits(), fail(Reason::misconfigured, "no such terminal"));
  EXPECT_EQ(run(configuration_->apply()).error().message, "no such terminal");
  let(traits(), std::vector{microstep_of(3)});
  configuration_->refuse({.reason = Reason::misconfigured, .message = "two nodes"});
  EXPECT_EQ(run(configuration_->apply()).error().message, "two nodes");
  EXPECT_EQ(memory_->log(), "");
}

TEST_F(DriveConfigurationSteps, FindsWhatOthersChanged) {
  auto homing = DriveSetting{.address = overtravel, .value = 9, .key = "homing.velocity", .watched = false};
  let(traits(), std::vector{levels_of(1), microstep_of(3), homing});
  EXPECT_EQ(configuration_->watched(), (std::vector<std::uint32_t>{saving_switch, levels, microstep}));
  SettingValues present{{saving_switch, 1}, {levels, 1}, {microstep, 3}};
  EXPECT_EQ(configuration_->drift_in(present).text, "");
  present[saving_switch] = 0;
  auto drift = configuration_->drift_in(present);
  EXPECT_EQ(drift.text, "persist (place 16) reads 0 instead of 1");
  EXPECT_FALSE(drift.scale_changed || drift.limits_changed);
  present[microstep] = 8;
  drift = configuration_->drift_in(present);
  EXPECT_THAT(drift.text, HasSubstr("; scale.microstep (place 11) reads 8 instead of 3"));
  EXPECT_TRUE(drift.scale_changed);
  EXPECT_FALSE(drift.limits_changed);
}

TEST_F(DriveConfigurationSteps, KnowsWhatALimitDependsOn) {
  const DriveSetting at_limits{.address = overtravel, .value = 1, .key = "drive.overtravel_stop"};
  for (const auto& [setting, limits] : std::vector<std::pair<DriveSetting, bool>>{
           {levels_of(1), true},
           {input_of(x0, home), true},
           {at_limits, true},
           {{.address = output_levels, .value = 1, .key = "outputs"}, false}}) {
    let({.input_functions = functions, .parameters = parameters}, std::vector{setting});
    EXPECT_EQ(configuration_->drift_in({{setting.address, 0}}).limits_changed, limits) << setting.key;
  }
}

}  // namespace
}  // namespace axisd
