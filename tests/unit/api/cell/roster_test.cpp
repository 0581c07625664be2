#include "api/cell/roster.hpp"

#include <gmock/gmock.h>

namespace axisd::cell {
namespace {

using namespace std::chrono_literals;

kept::Registration registration(const std::string& name, const std::string& address) {
  kept::Registration made;
  made.set_name(name);
  made.set_axisd_address(address);
  return made;
}

class RosterTest : public ::testing::Test {
 protected:
  void answer(const std::string& name) {
    auto& peer = roster_.find(name)->peer;
    (void)peer.time(now_);
    peer.answered(now_, {.machine = name, .instance_id = "run"});
    roster_.look(now_);
  }
  void fail(const std::string& name) {
    auto& peer = roster_.find(name)->peer;
    peer.failed(now_, "refused");
    peer.failed(now_, "refused");
    roster_.look(now_);
  }
  v1::MachineState state(const std::string& name) { return roster_.find(name)->state; }

  TimePoint now_{1h};
  Roster roster_{"press-1", PeerMachine::Times()};
};

TEST_F(RosterTest, ARegisteredOneThatAnswersIsPresentElseSilent) {
  roster_.set_registered({{"press-2", registration("press-2", "a:1")}}, now_);
  roster_.look(now_);
  EXPECT_EQ(state("press-2"), v1::MACHINE_STATE_UNSPECIFIED) << "it has not been asked";
  answer("press-2");
  EXPECT_EQ(state("press-2"), v1::MACHINE_STATE_PRESENT);
  fail("press-2");
  EXPECT_EQ(state("press-2"), v1::MACHINE_STATE_SILENT);
}

TEST_F(RosterTest, OneThatIsNotRegisteredAnyMoreIsUnregisteredElseGone) {
  roster_.set_registered({{"press-2", registration("press-2", "a:1")}}, now_);
  answer("press-2");
  roster_.set_registered({}, now_);
  roster_.look(now_);
  EXPECT_EQ(state("press-2"), v1::MACHINE_STATE_UNREGISTERED);
  fail("press-2");
  EXPECT_EQ(state("press-2"), v1::MACHINE_STATE_GONE);
  answer("press-2");
  EXPECT_EQ(state("press-2"), v1::MACHINE_STATE_UNREGISTERED);
}

TEST_F(RosterTest, OneByHandNeedsNoRegistration) {
  roster_.put_by_hand(registration("press-3", "b:1"), now_);
  answer("press-3");
  EXPECT_EQ(state("press-3"), v1::MACHINE_STATE_PRESENT);
  roster_.set_registered({}, now_);
  roster_.look(now_);
  EXPECT_EQ(state("press-3"), v1::MACHINE_STATE_PRESENT);
}

TEST_F(RosterTest, TheConfigurationSaysWhereOneIs) {
  roster_.put_by_hand(registration("press-3", "by-hand:1"), now_);
  auto known = registration("press-3", "etcd:1");
  known.add_axes("feeder");
  roster_.set_registered({{"press-3", known}}, now_);
  EXPECT_EQ(roster_.find("press-3")->registration.axisd_address(), "by-hand:1");
  EXPECT_EQ(roster_.find("press-3")->registration.axes(0), "feeder");
}

TEST_F(RosterTest, AnotherAddressIsAskedAnewBeforeItIsBelieved) {
  roster_.set_registered({{"press-2", registration("press-2", "a:1")}}, now_);
  answer("press-2");
  roster_.set_registered({{"press-2", registration("press-2", "b:1")}}, now_);
  EXPECT_FALSE(roster_.find("press-2")->peer.is_open());
}

TEST_F(RosterTest, OneOfAnEarlierRunIsRegisteredUntilEtcdSaysOtherwise) {
  roster_.put_remembered(registration("press-2", "a:1"), now_);
  answer("press-2");
  EXPECT_EQ(state("press-2"), v1::MACHINE_STATE_PRESENT);
  roster_.set_registered({}, now_);
  roster_.look(now_);
  EXPECT_EQ(state("press-2"), v1::MACHINE_STATE_UNREGISTERED);
}

TEST_F(RosterTest, OneThatIsGoneIsForgottenAfterADay) {
  roster_.set_registered({{"press-2", registration("press-2", "a:1")}}, now_);
  answer("press-2");
  roster_.set_registered({}, now_);
  fail("press-2");
  (void)roster_.take_changes();
  now_ += 24h - 1s;
  roster_.look(now_);
  EXPECT_NE(roster_.find("press-2"), nullptr);
  now_ += 1s;
  roster_.look(now_);
  EXPECT_EQ(roster_.find("press-2"), nullptr);
  const auto changes = roster_.take_changes();
  ASSERT_EQ(changes.size(), 1U);
  EXPECT_EQ(changes[0].to, v1::MACHINE_STATE_UNSPECIFIED);
  EXPECT_TRUE(roster_.take_touched().contains("press-2"));
}

TEST_F(RosterTest, TellsEachChangeOnce) {
  roster_.set_registered({{"press-2", registration("press-2", "a:1")}}, now_);
  answer("press-2");
  EXPECT_EQ(roster_.take_changes().size(), 1U);
  answer("press-2");
  EXPECT_TRUE(roster_.take_changes().empty());
}

TEST_F(RosterTest, HasRoomForSoMany) {
  std::map<std::string, kept::Registration, std::less<>> many;
  for (std::size_t i = 0; i < Roster::most + 10; ++i) {
    const auto name = "m" + std::to_string(i);
    many.emplace(name, registration(name, "a:1"));
  }
  roster_.set_registered(many, now_);
  EXPECT_EQ(roster_.entries().size(), Roster::most);
}

}  // namespace
}  // namespace axisd::cell
