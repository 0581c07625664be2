#include "daemon/store/change.hpp"

#include <gtest/gtest.h>

namespace axisd::store {
namespace {

const OffsetRecord homed{.offset_pulses = 5,
                         .trust = PositionTrust::homed,
                         .canary = {1, 2, 3, 4, 5, 6},
                         .last_position_pulses = 9,
                         .pulses_per_revolution = 10000,
                         .invert = false};
const InhibitRecord latched{.active = true, .by = "panel", .since = WallTime(std::chrono::seconds(5))};
const InhibitRecord released{.active = false, .by = "supervisor", .since = WallTime(std::chrono::seconds(6))};

TEST(Change, DoesWhatIsAsked) {
  StoredState state;
  apply(state, SetOffset{.axis = "x", .offset = homed});
  apply(state, CountEepromWrites{.axis = "x", .writes = 2});
  apply(state, CountEepromWrites{.axis = "x", .writes = 3});
  apply(state, SetInhibit{latched});
  EXPECT_EQ(state.axes.at("x").offset, homed);
  EXPECT_EQ(state.axes.at("x").eeprom_writes, 5U);
  EXPECT_EQ(state.inhibit, latched);
  apply(state, SetInhibit{released});
  apply(state, ForgetOffset{"x"});
  EXPECT_EQ(state.inhibit, released);
  EXPECT_EQ(state.axes.at("x").offset, std::nullopt);
  EXPECT_EQ(state.axes.at("x").eeprom_writes, 5U);
}

/// By the canary, or the mark in its place, a restart of the drive is still found (M1).
OffsetRecord distrusted(OffsetRecord record) {
  record.trust = PositionTrust::unknown;
  return record;
}

TEST(Change, AFailedOffsetIsNotTrustedAndNotTheOldOne) {
  StoredState state;
  apply(state, SetOffset{.axis = "x", .offset = homed});
  auto other = homed;
  other.offset_pulses = 6;
  other.canary = {6, 5, 4, 3, 2, 1};
  apply_after_failure(state, SetOffset{.axis = "x", .offset = other});
  EXPECT_EQ(state.axes.at("x").offset, distrusted(other));
  apply_after_failure(state, SetOffset{.axis = "y", .offset = homed});
  EXPECT_EQ(state.axes.at("y").offset, distrusted(homed));
}

TEST(Change, AFailedForgetStillForgets) {
  StoredState state;
  apply(state, SetOffset{.axis = "x", .offset = homed});
  apply_after_failure(state, ForgetOffset{"x"});
  EXPECT_EQ(state.axes.at("x").offset, std::nullopt);
}

TEST(Change, AFailedInhibitLatchesAndAFailedReleaseDoesNotRelease) {
  StoredState state;
  apply_after_failure(state, SetInhibit{latched});
  EXPECT_EQ(state.inhibit, latched);
  apply_after_failure(state, SetInhibit{released});
  EXPECT_EQ(state.inhibit, latched);
}

const HoldKey hmi{.holder = "hmi", .request_id = "r1"}, panel{.holder = "panel", .request_id = {}};
const WallTime noon{std::chrono::hours(12)}, later{std::chrono::hours(13)};

TEST(Change, HoldsBeginAndEnd) {
  StoredState state;
  apply(state, SetHold{.axis = "x", .hold = hmi, .since = noon});
  apply(state, SetHold{.axis = "x", .hold = panel, .since = later});
  EXPECT_EQ(state.axes.at("x").holds, (HoldRecords{{hmi, noon}, {panel, later}}));
  apply(state, ForgetHolds{.axis = "x", .holds = {{hmi, noon}}});
  EXPECT_EQ(state.axes.at("x").holds, (HoldRecords{{panel, later}}));
}

TEST(Change, AFailedHoldStandsAndAFailedReleaseDoesNotRelease) {
  StoredState state;
  apply_after_failure(state, SetHold{.axis = "x", .hold = hmi, .since = noon});
  EXPECT_EQ(state.axes.at("x").holds, (HoldRecords{{hmi, noon}}));
  apply_after_failure(state, ForgetHolds{.axis = "x", .holds = {{hmi, noon}}});
  EXPECT_EQ(state.axes.at("x").holds, (HoldRecords{{hmi, noon}}));
  // As the core's picture is, which was changed when it was asked for.
  apply(state, ForgetHolds{.axis = "x", .holds = {{hmi, noon}}});
  apply(state, SetHold{.axis = "x", .hold = hmi, .since = later});
  apply_after_failure(state, ForgetHolds{.axis = "x", .holds = {{hmi, noon}}});
  EXPECT_EQ(state.axes.at("x").holds, (HoldRecords{{hmi, later}})) << "one that came since stands as it is";
}

TEST(Change, AFailedCountIsKept) {
  StoredState state;
  apply_after_failure(state, CountEepromWrites{.axis = "x", .writes = 2});
  EXPECT_EQ(state.axes.at("x").eeprom_writes, 2U);
}

const EepromRecord one_save{.saves = 1, .by_hour = {{7, 1}}}, two_saves{.saves = 2, .by_hour = {{7, 2}}};

TEST(Change, SavesOfTheDayAreAsTheyWereCountedLast) {
  StoredState state;
  apply(state, CountEepromWrites{.axis = "x", .writes = 2, .saves = one_save});
  apply(state, CountEepromWrites{.axis = "x", .writes = 3, .saves = two_saves});
  EXPECT_EQ(state.axes.at("x").eeprom, two_saves);
  const EepromRecord settled{.saves = 2, .by_hour = {}};
  apply(state, CountEepromWrites{.axis = "x", .writes = 0, .saves = settled});
  EXPECT_EQ(state.axes.at("x").eeprom, settled);
}

TEST(Change, FailedSavesOfTheDayAreKeptAndDoNotReplaceNewerOnes) {
  StoredState state;
  apply_after_failure(state, CountEepromWrites{.axis = "x", .writes = 2, .saves = one_save});
  EXPECT_EQ(state.axes.at("x").eeprom, one_save);
  apply(state, CountEepromWrites{.axis = "x", .writes = 3, .saves = two_saves});
  apply_after_failure(state, CountEepromWrites{.axis = "x", .writes = 2, .saves = one_save});
  EXPECT_EQ(state.axes.at("x").eeprom, two_saves);
}

TEST(Change, AnOlderStateIsNotTrustedAndWhatIsNotKnownInhibitsMotion) {
  StoredState state;
  state.start_count = 3;
  apply(state, SetOffset{.axis = "x", .offset = homed});
  apply(state, CountEepromWrites{.axis = "x", .writes = 2});
  distrust_offsets(state);
  EXPECT_FALSE(state.inhibit.active);
  latch_by_caution(state, WallTime(std::chrono::seconds(9)));
  EXPECT_EQ(state.axes.at("x").offset, distrusted(homed));
  EXPECT_EQ(state.axes.at("x").eeprom_writes, 2U);
  EXPECT_TRUE(state.inhibit.active);
  EXPECT_EQ(state.inhibit.since, WallTime(std::chrono::seconds(9)));
  EXPECT_EQ(state.start_count, 3U);
  apply(state, SetHold{.axis = "x", .hold = hmi, .since = noon});

  state.inhibit = latched;
  distrust_offsets(state);
  latch_by_caution(state, WallTime(std::chrono::seconds(9)));
  EXPECT_EQ(state.inhibit, latched) << "who latched it must not get lost";
  EXPECT_EQ(state.axes.at("x").holds.size(), 1U) << "holds stand";
}

TEST(Change, ConvictionsStandUntilTheirAcceptanceIsSaved) {
  StoredState state;
  state.convictions = {{.file = KeptFile::journal, .fault = KeptFault::missing}};
  apply_after_failure(state, AcceptState{});
  EXPECT_EQ(state.convictions.size(), 1U);
  apply(state, AcceptState{});
  EXPECT_TRUE(state.convictions.empty());
}

}  // namespace
}  // namespace axisd::store
