#include "api/axisctl/state_view.hpp"

#include <gmock/gmock.h>

namespace axisd::axisctl {
namespace {

using testing::HasSubstr;
using testing::Not;

/// At 12.5 mm, offline; measured 90 s ago, unless it never was.
v1::AxisState offline(bool measured) {
  v1::AxisState state;
  state.set_axis("feeder");
  state.set_unit("mm");
  state.set_link(v1::LINK_STATE_OFFLINE);
  if (!measured) return state;
  state.set_position(12.5);
  state.set_velocity(3);
  state.mutable_age()->set_seconds(90);
  return state;
}

std::string table(const v1::AxisState& state) {
  google::protobuf::RepeatedPtrField<v1::AxisState> axes;
  *axes.Add() = state;
  return axis_table(axes).lines(false).at(1);
}

TEST(StateView, RemarksNameWhatAPersonMustKnow) {
  v1::AxisState state;
  EXPECT_EQ(remarks(state), "");
  state.set_simulated(true);
  state.set_inhibited(true);
  state.set_alarm_code(3);
  state.set_alarm_name("overcurrent");
  state.set_enabled(true);
  EXPECT_EQ(remarks(state), "simulated, all stopped, alarm 3 overcurrent, not enabled by us");
  state.set_alarm_code(0x8611);
  state.set_alarm_name("following_error");
  EXPECT_THAT(remarks(state), HasSubstr("alarm 8611h following_error"));
  EXPECT_THAT(state_details(state, false), HasSubstr("8611h following_error"));
}

TEST(StateView, TickIsOneLine) {
  v1::WatchAxesResponse batch;
  batch.set_tick(7);
  auto& state = *batch.add_axes();
  state.set_axis("feeder");
  state.set_unit("mm");
  state.set_state(v1::STATE_STANDSTILL);
  state.set_position(1.5);
  state.mutable_age();
  EXPECT_EQ(tick_line(batch), "7  feeder Standstill 1.5 mm 0 mm/s");
}

TEST(StateView, WhatWasNeverMeasuredIsNotShownAsZero) {
  EXPECT_THAT(table(offline(false)), Not(HasSubstr("mm")));
  EXPECT_THAT(state_details(offline(false), false), HasSubstr("position:   never measured"));
  EXPECT_THAT(state_details(offline(false), false), Not(HasSubstr("velocity:")));
  auto connecting = offline(false);
  connecting.set_link(v1::LINK_STATE_CONFIGURING);
  connecting.set_state(v1::STATE_DISABLED);
  connecting.add_inputs()->set_name("X0");
  const auto details = state_details(connecting, false);
  EXPECT_THAT(details, HasSubstr("power:      not known"));
  EXPECT_THAT(details, Not(HasSubstr("Disabled")));
  EXPECT_THAT(details, Not(HasSubstr("X0")));
  v1::WatchAxesResponse batch;
  batch.set_tick(7);
  *batch.add_axes() = offline(false);
  *batch.add_axes() = connecting;
  EXPECT_EQ(tick_line(batch), "7  feeder Offline - -  feeder - - -");
}

TEST(StateView, WhatADriveThatFellSilentSaidLastIsMarked) {
  EXPECT_THAT(table(offline(true)), HasSubstr("last measured 1 min 30 s ago"));
  EXPECT_THAT(table(offline(true)), HasSubstr("12.5"));
  auto online = offline(true);
  online.set_link(v1::LINK_STATE_ONLINE);
  EXPECT_THAT(table(online), Not(HasSubstr("ago")));
}

}  // namespace
}  // namespace axisd::axisctl
