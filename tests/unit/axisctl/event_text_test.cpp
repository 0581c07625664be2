#include "api/axisctl/event_text.hpp"

#include <gmock/gmock.h>

#include "api/axisctl/error.hpp"

namespace axisd::axisctl {
namespace {

v1::Event event() {
  v1::Event result;
  result.set_sequence(12);
  result.set_axis("feeder");
  result.mutable_at()->set_seconds(1'700'000'000);
  result.mutable_at()->set_nanos(123'999'999);
  return result;
}

const std::string lead = "2023-11-14T22:13:20.123Z  12  feeder  ";

TEST(EventText, EdgesTellHowExactTheirTimeIs) {
  auto edge = event();
  edge.mutable_terminal_edge()->set_terminal("X1");
  edge.mutable_terminal_edge()->mutable_before()->set_nanos(20'000'000);
  edge.mutable_terminal_edge()->mutable_after()->set_nanos(5'000'000);
  EXPECT_EQ(event_line(edge), lead + "X1 off (within 15 ms)");
  edge.mutable_terminal_edge()->set_function("home");
  edge.mutable_terminal_edge()->set_active(true);
  EXPECT_EQ(event_line(edge), lead + "X1 home on (within 15 ms)");
}

TEST(EventText, StatesLinksAndDrift) {
  auto state = event();
  state.mutable_state_change()->set_from(v1::STATE_STANDSTILL);
  state.mutable_state_change()->set_to(v1::STATE_CONTINUOUS_MOTION);
  state.mutable_state_change()->set_cause(v1::MOTION_CAUSE_COMMAND);
  EXPECT_EQ(event_line(state), lead + "Standstill -> ContinuousMotion");
  state.mutable_state_change()->set_cause(v1::MOTION_CAUSE_UNKNOWN);
  EXPECT_EQ(event_line(state), lead + "Standstill -> ContinuousMotion, started by nobody that is known");
  auto link = event();
  link.mutable_link_change()->set_to(v1::LINK_STATE_ONLINE);
  EXPECT_EQ(event_line(link), lead + "online");
  link.mutable_link_change()->set_to(v1::LINK_STATE_OFFLINE);
  link.mutable_link_change()->set_detail("no reply");
  EXPECT_EQ(event_line(link), lead + "offline: no reply");
  auto drift = event();
  drift.mutable_configuration_drift()->set_text("X1 has no function");
  EXPECT_EQ(event_line(drift), lead + "drift: X1 has no function");
  drift.mutable_configuration_drift()->clear_text();
  EXPECT_EQ(event_line(drift), lead + "holds its configuration again");
  EXPECT_EQ(event_line(event()), lead + "an event that this axisctl does not know");
}

TEST(EventText, AReloadWithWhatItChanged) {
  v1::Event event;
  auto& reloaded = *event.mutable_configuration_reloaded();
  reloaded.set_client("hmi-1");
  reloaded.set_revision("r2");
  EXPECT_THAT(event_line(event), testing::EndsWith("  -  configuration r2 reloaded by hmi-1"));
  auto& changed = *reloaded.add_changes();
  changed.set_section("axes");
  changed.set_name("feeder");
  changed.set_kind(v1::CONFIG_CHANGE_KIND_CHANGED);
  changed.add_keys("scale.invert");
  changed.add_keys("unit");
  auto& control = *reloaded.add_changes();
  control.set_section("control");
  control.set_kind(v1::CONFIG_CHANGE_KIND_ADDED);
  EXPECT_THAT(event_line(event),
              testing::EndsWith(": axes.feeder changed (scale.invert, unit); control added"));
}

TEST(EventText, KindsByTheirNameOrFirstWord) {
  EXPECT_EQ(parse_event_kind("terminal"), v1::EVENT_KIND_TERMINAL_EDGE);
  EXPECT_EQ(parse_event_kind("link-change"), v1::EVENT_KIND_LINK_CHANGE);
  EXPECT_EQ(parse_event_kind("configuration"), v1::EVENT_KIND_CONFIGURATION_DRIFT);
  EXPECT_EQ(parse_event_kind("configuration-reloaded"), v1::EVENT_KIND_CONFIGURATION_RELOADED);
  EXPECT_THROW(parse_event_kind(""), Failure);
  EXPECT_THROW(parse_event_kind("unspecified"), Failure);
}

}  // namespace
}  // namespace axisd::axisctl
