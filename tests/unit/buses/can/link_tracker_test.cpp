#include "buses/can/link_tracker.hpp"

#include <gtest/gtest.h>

namespace axisd::can {
namespace {

struct Tracker : LinkTracker {
  Tracker() : LinkTracker("cell", "can0") {}
};

TEST(LinkTracker, BeginsWithoutAnInterface) {
  const Tracker tracker;
  EXPECT_EQ(tracker.state().link, InterfaceState::removed);
  EXPECT_FALSE(tracker.state().can_send());
  EXPECT_EQ(tracker.state().error->where.bus, "cell");
  EXPECT_NE(tracker.state().error->message.find("can0"), std::string::npos);
}

TEST(LinkTracker, FollowsTheInterface) {
  Tracker tracker;
  tracker.up();
  EXPECT_EQ(tracker.state().link, InterfaceState::up);
  EXPECT_FALSE(tracker.state().error);
  tracker.down();
  EXPECT_EQ(tracker.state().link, InterfaceState::down);
  tracker.up();
  tracker.removed();
  EXPECT_EQ(tracker.state().link, InterfaceState::removed);
}

TEST(LinkTracker, ErrorPassiveStillSends) {
  Tracker tracker;
  tracker.up();
  tracker.controller(Controller::passive);
  EXPECT_EQ(tracker.state().link, InterfaceState::error_passive);
  EXPECT_TRUE(tracker.state().can_send());
  EXPECT_TRUE(tracker.state().error);
  tracker.controller(Controller::active);
  EXPECT_EQ(tracker.state().link, InterfaceState::up);
}

TEST(LinkTracker, BusOffLastsUntilTheLinkWasDownWhateverTheControllerSays) {
  Tracker tracker;
  tracker.up();
  tracker.controller(Controller::bus_off);
  tracker.controller(Controller::active);  // restart-ms other than 0
  tracker.up();
  EXPECT_EQ(tracker.state().link, InterfaceState::bus_off);
  EXPECT_TRUE(tracker.state().needs_cycle());
  tracker.down();
  EXPECT_FALSE(tracker.state().needs_cycle());
  tracker.controller(Controller::bus_off);  // read late: of before
  tracker.up();
  EXPECT_EQ(tracker.state().link, InterfaceState::up);
}

TEST(LinkTracker, AStallLastsUntilTheLinkWasDownOrGone) {
  for (const bool down : {true, false}) {
    Tracker tracker;
    tracker.stalled();  // nothing is up
    EXPECT_EQ(tracker.state().link, InterfaceState::removed);
    tracker.up();
    tracker.stalled();
    tracker.up();
    EXPECT_EQ(tracker.state().link, InterfaceState::stalled);
    EXPECT_TRUE(tracker.state().needs_cycle());
    down ? tracker.down() : tracker.removed();
    tracker.up();
    EXPECT_EQ(tracker.state().link, InterfaceState::up);
  }
}

TEST(LinkTracker, AnObjectionForbidsSendingUntilItIsGone) {
  Tracker tracker;
  tracker.up(Error{.reason = Reason::misconfigured, .message = "other bit rate", .remedy = "set it"});
  EXPECT_EQ(tracker.state().link, InterfaceState::down);
  EXPECT_EQ(tracker.state().error->reason, Reason::misconfigured);
  EXPECT_EQ(tracker.state().error->where.bus, "cell");
  tracker.up();
  EXPECT_TRUE(tracker.state().can_send());
  tracker.unusable(Error{.reason = Reason::bus_down, .message = "no socket", .remedy = "allow it"});
  EXPECT_EQ(tracker.state().link, InterfaceState::down);
  EXPECT_EQ(tracker.state().error->message, "no socket");
}

}  // namespace
}  // namespace axisd::can
