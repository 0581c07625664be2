// Explain: a drive that is silent, another one, or not (any longer) configured.
#include "tests/rules/explain_rig.hpp"

namespace axisd::test {
namespace {

using namespace std::chrono_literals;
using ::testing::AllOf;
using ::testing::ElementsAre;
using ::testing::HasSubstr;

const Action move = MoveAbsoluteRequest{.position = 10};

TEST(Explain, ASilentNodeIsOfflineAndInQuarantine) {
  ExplainRig rig;
  rig.ready();
  rig.line->network().set_connected(false);
  ASSERT_TRUE(rig.run_until([&] { return rig.state()->link == LinkState::offline; }, 5s));
  rig.run(5s);
  EXPECT_THAT(rig.reasons(move), ElementsAre("offline", "no_reply"));
  EXPECT_THAT(rig.text(move, Reason::no_reply),
              AllOf(HasSubstr("node 1 is in quarantine for"), HasSubstr("asked again in"),
                    HasSubstr("axisctl bus scan line-a")));
  EXPECT_THAT(rig.reasons(DisableRequest{}), ElementsAre("offline", "no_reply"));
  EXPECT_THAT(rig.reasons(ResetRequest{}), ElementsAre("offline", "no_reply"));
}

TEST(Explain, ADriveThatNeverAnsweredIsNotKnownToBeOn) {
  ExplainRig rig(
      {.adjust_drive = [](simulation::SimulatedNodeSettings& node) { node.address = 2; }, .connect = false});
  rig.run(3s);
  EXPECT_THAT(rig.reasons(move), ElementsAre("offline", "no_reply", "disabled", "not_trusted"));
  EXPECT_THAT(rig.text(move, Reason::disabled), HasSubstr("not known to be on"));
}

TEST(Explain, APortThatIsGoneIsNamed) {
  ExplainRig rig;
  rig.ready();
  rig.line->set_open(false);
  ASSERT_TRUE(rig.run_until([&] { return rig.state()->link == LinkState::offline; }, 5s));
  EXPECT_THAT(rig.reasons(move), ElementsAre("offline", "bus_down"));
  EXPECT_THAT(rig.text(move, Reason::offline), ::testing::Not(HasSubstr("it is retried by itself")))
      << "what the port says of that is enough";
}

TEST(Explain, AnotherModelThanConfiguredIsNamed) {
  ExplainRig rig({.adjust = [](AxisSettings& axis) { axis.model = "ssd2608pr"; }, .connect = false});
  rig.run(3s);
  EXPECT_THAT(rig.reasons(EnableRequest{}), ElementsAre("wrong_model"));
}

TEST(Explain, ADriveThatWasRestartedIsBeingConfigured) {
  ExplainRig rig({.switches = {{"enabled_at_power_up", false}}});
  rig.ready();
  rig.cycle_power(10ms);
  ASSERT_TRUE(rig.run_until([&] { return rig.state()->link == LinkState::configuring; }, 5s));
  EXPECT_THAT(rig.reasons(EnableRequest{}), ElementsAre("configuring"));
  EXPECT_THAT(rig.text(EnableRequest{}, Reason::configuring), HasSubstr("wait"));
}

/// Each of these is refused, so none may be the remedy of another.
TEST(Explain, ARestartThatWasSeenIsWaitedFor) {
  ExplainRig rig;
  rig.ready();
  rig.cycle_power(10ms);
  ASSERT_TRUE(rig.run_until([&] { return rig.state()->reboots == 1; }, 5s));
  ASSERT_EQ(rig.state()->link, LinkState::configuring);
  for (const Action& action : {Action{EnableRequest{}}, Action{HomeRequest{}}, Action{ResetRequest{}}})
    EXPECT_THAT(rig.text(action, Reason::configuring),
                AllOf(HasSubstr("-> wait until it is configured again"),
                      HasSubstr("then axisctl enable feeder, and axisctl home feeder")));
}

TEST(Explain, WorkOnTheDrivesMemoryIsWaitedFor) {
  ExplainRig rig;
  rig.complete(DisableRequest{});
  const auto token = rig.axis().begin_maintenance();
  ASSERT_TRUE(token) << to_string(token.error());
  EXPECT_THAT(rig.reasons(EnableRequest{}), ElementsAre("busy"));
  EXPECT_THAT(rig.reasons(ResetRequest{}), ElementsAre("busy"));
}

TEST(Explain, ADriveThatNoLongerHoldsItsConfigurationIsToBeDisabled) {
  ExplainRig rig({.adjust = [](AxisSettings& axis) { axis.drift_check = 1s; }});
  rig.ready();
  rig.write_behind(0x0044, 0);
  ASSERT_TRUE(rig.run_until([&] { return !rig.state()->drift.empty(); }, 3s));
  EXPECT_THAT(rig.reasons(move), ElementsAre("misconfigured"));
  EXPECT_THAT(rig.text(move, Reason::misconfigured),
              AllOf(HasSubstr(rig.state()->drift), HasSubstr("axisctl disable feeder")));
}

}  // namespace
}  // namespace axisd::test
