// Each arrow of the drawing in registry_machine.hpp.
#include "api/cell/registry_machine.hpp"

#include <gmock/gmock.h>

#include <memory>

namespace axisd::cell {
namespace {

using namespace std::chrono_literals;
using State = RegistryMachine::State;

kept::Registration registration(const std::string& name, const std::string& computer = "a") {
  kept::Registration made;
  made.set_name(name);
  made.set_machine_id(computer);
  made.set_axisd_address(name + ":7443");
  return made;
}

class RegistryMachineTest : public ::testing::Test {
 protected:
  template <class Effect>
  static std::optional<Effect> only(const RegistryMachine::Effects& effects) {
    if (effects.size() != 1 || !std::holds_alternative<Effect>(effects.front())) return std::nullopt;
    return std::get<Effect>(effects.front());
  }
  /// As far as `state`, with everything that etcd would answer.
  void reach(State state) {
    (void)machine().start(now_);
    if (state == State::looking) return;
    (void)machine().listed(now_, {});
    if (state == State::listening) return;
    (void)machine().offer(now_, registration("press-1"));
    if (state == State::granting) return;
    (void)machine().granted(now_, 7);
    if (state == State::writing) return;
    if (state == State::refused)
      (void)machine().held(now_, registration("press-1", "b"));
    else
      (void)machine().written(now_);
    ASSERT_EQ(machine().state(), state);
  }
  void pass(Duration time) { now_ += time; }

  TimePoint now_{1h};
  std::unique_ptr<RegistryMachine> held_ =
      std::make_unique<RegistryMachine>("press-1", 3, RegistryMachine::Times());
  RegistryMachine& machine() { return *held_; }
};

TEST_F(RegistryMachineTest, LooksAtTheFirstEndpoint) {
  EXPECT_EQ(only<RegistryMachine::Look>(machine().start(now_)).value().endpoint, 0U);
  EXPECT_EQ(machine().state(), State::looking);
}

TEST_F(RegistryMachineTest, KnowsWhoIsRegisteredBeforeItIsItself) {
  reach(State::looking);
  EXPECT_TRUE(machine().listed(now_, {{"press-2", registration("press-2")}}).empty());
  EXPECT_EQ(machine().state(), State::listening);
  EXPECT_TRUE(machine().machines().contains("press-2"));
}

TEST_F(RegistryMachineTest, RegistersWhatItIsOffered) {
  reach(State::listening);
  EXPECT_TRUE(only<RegistryMachine::Grant>(machine().offer(now_, registration("press-1"))));
  EXPECT_EQ(machine().state(), State::granting);
  const auto write = only<RegistryMachine::Write>(machine().granted(now_, 42)).value();
  EXPECT_EQ(write.lease, 42);
  EXPECT_EQ(write.value.name(), "press-1");
  EXPECT_EQ(machine().state(), State::writing);
  EXPECT_TRUE(machine().written(now_).empty());
  EXPECT_EQ(machine().state(), State::registered);
  EXPECT_EQ(machine().trouble(), "");
  EXPECT_EQ(machine().lease(), 42);
}

TEST_F(RegistryMachineTest, OffersBeforeEtcdAnswersAreKept) {
  reach(State::looking);
  EXPECT_TRUE(machine().offer(now_, registration("press-1")).empty());
  EXPECT_TRUE(only<RegistryMachine::Grant>(machine().listed(now_, {})));
}

TEST_F(RegistryMachineTest, AnotherComputersNameIsRefusedAndSaysWhose) {
  reach(State::writing);
  EXPECT_TRUE(machine().held(now_, registration("press-1", "b")).empty());
  EXPECT_EQ(machine().state(), State::refused);
  EXPECT_THAT(machine().trouble(), ::testing::HasSubstr("another computer (b, its axisd at press-1:7443)"));
  ASSERT_NE(machine().holder(), nullptr);
  EXPECT_EQ(machine().holder()->machine_id(), "b");
}

TEST_F(RegistryMachineTest, ARefusedOneTriesAgain) {
  reach(State::refused);
  pass(10s);
  machine().heard(now_);
  const auto effects = machine().time(now_);
  ASSERT_EQ(effects.size(), 2U) << "progress, and";
  EXPECT_TRUE(std::holds_alternative<RegistryMachine::Grant>(effects.back()));
}

TEST_F(RegistryMachineTest, ARefusedOneTakesItsNameOnceItIsFree) {
  reach(State::refused);
  pass(2500ms);
  machine().heard(now_);
  EXPECT_TRUE(only<RegistryMachine::Grant>(machine().changed(now_, "press-1", std::nullopt)));
  (void)machine().granted(now_, 8);
  (void)machine().written(now_);
  EXPECT_EQ(machine().holder(), nullptr);
}

TEST_F(RegistryMachineTest, RenewsItsLease) {
  reach(State::registered);
  for (int i = 0; i < 5; ++i) {
    pass(1s);
    machine().heard(now_);
    const auto effects = machine().time(now_);
    EXPECT_EQ(effects.size(), i < 4 ? 1U : 2U) << "progress each second, and the lease after 5 s";
  }
  EXPECT_TRUE(machine().kept_alive(now_, true).empty());
  EXPECT_EQ(machine().state(), State::registered);
}

TEST_F(RegistryMachineTest, ALeaseThatIsGoneIsTakenAnewAtOnce) {
  reach(State::registered);
  pass(1s);
  EXPECT_TRUE(only<RegistryMachine::Grant>(machine().kept_alive(now_, false)));
}

TEST_F(RegistryMachineTest, AKeyThatIsGoneIsWrittenAnewAtOnce) {
  reach(State::registered);
  pass(1s);
  EXPECT_TRUE(only<RegistryMachine::Grant>(machine().changed(now_, "press-1", std::nullopt)));
  EXPECT_EQ(machine().state(), State::granting);
}

TEST_F(RegistryMachineTest, WhoTakesTheKeyAwayAgainAndAgainIsAnsweredOnceASecond) {
  reach(State::registered);
  EXPECT_TRUE(machine().changed(now_, "press-1", std::nullopt).empty());
  EXPECT_EQ(machine().state(), State::refused);
  pass(1s);
  EXPECT_TRUE(std::holds_alternative<RegistryMachine::Grant>(machine().time(now_).back()));
}

TEST_F(RegistryMachineTest, OthersComeAndGo) {
  reach(State::registered);
  EXPECT_TRUE(machine().changed(now_, "press-2", registration("press-2")).empty());
  EXPECT_TRUE(machine().machines().contains("press-2"));
  EXPECT_TRUE(machine().changed(now_, "press-2", std::nullopt).empty());
  EXPECT_FALSE(machine().machines().contains("press-2"));
}

TEST_F(RegistryMachineTest, AnotherRegistrationIsWrittenUnderTheSameLease) {
  reach(State::registered);
  auto other = registration("press-1");
  other.add_axes("feeder");
  EXPECT_EQ(only<RegistryMachine::Write>(machine().offer(now_, other)).value().lease, 7);
  (void)machine().written(now_);
  EXPECT_TRUE(machine().offer(now_, other).empty()) << "the same once more";
}

TEST_F(RegistryMachineTest, ALostEndpointIsFollowedByTheNext) {
  reach(State::registered);
  EXPECT_TRUE(only<RegistryMachine::Leave>(machine().lost(now_, "gone")));
  EXPECT_EQ(machine().state(), State::resting);
  EXPECT_EQ(machine().trouble(), "gone");
  pass(250ms);
  EXPECT_EQ(only<RegistryMachine::Look>(machine().time(now_)).value().endpoint, 1U);
  (void)machine().lost(now_, "gone, too");
  pass(250ms);
  EXPECT_EQ(only<RegistryMachine::Look>(machine().time(now_)).value().endpoint, 2U);
  (void)machine().lost(now_, "all of them");
  pass(250ms);
  EXPECT_EQ(only<RegistryMachine::Look>(machine().time(now_)).value().endpoint, 0U);
}

TEST_F(RegistryMachineTest, WhatIsKnownStaysWhileNobodyAnswers) {
  reach(State::registered);
  (void)machine().changed(now_, "press-2", registration("press-2"));
  (void)machine().lost(now_, "gone");
  EXPECT_TRUE(machine().machines().contains("press-2"));
  EXPECT_TRUE(machine().changed(now_, "press-2", std::nullopt).empty());
  EXPECT_TRUE(machine().machines().contains("press-2")) << "an answer of a watch that has ended";
}

TEST_F(RegistryMachineTest, SilenceOfTheWatchIsALoss) {
  reach(State::registered);
  pass(3s);
  EXPECT_TRUE(only<RegistryMachine::Leave>(machine().time(now_)));
  EXPECT_EQ(machine().state(), State::resting);
}

TEST_F(RegistryMachineTest, ProgressIsAskedForEachSecond) {
  reach(State::registered);
  pass(1s);
  EXPECT_TRUE(only<RegistryMachine::AskProgress>(machine().time(now_)));
  EXPECT_TRUE(machine().time(now_).empty());
}

TEST_F(RegistryMachineTest, NothingIsWaitedForForEver) {
  for (const auto state : {State::looking, State::granting, State::writing}) {
    held_ = std::make_unique<RegistryMachine>("press-1", 3, RegistryMachine::Times());
    reach(state);
    pass(3s);
    machine().heard(now_);  // the watch goes on all the same
    EXPECT_TRUE(only<RegistryMachine::Leave>(machine().time(now_))) << static_cast<int>(state);
  }
}

TEST_F(RegistryMachineTest, ALeaseThatIsNotRenewedIsALoss) {
  reach(State::registered);
  for (int i = 0; i < 8; ++i) {
    pass(1s);
    machine().heard(now_);
    (void)machine().time(now_);
  }
  EXPECT_EQ(machine().state(), State::resting);
  EXPECT_THAT(machine().trouble(), ::testing::HasSubstr("does not renew"));
}

TEST_F(RegistryMachineTest, WantsNothingAfterItsEnd) {
  reach(State::registered);
  machine().end();
  EXPECT_EQ(machine().state(), State::ended);
  EXPECT_TRUE(machine().changed(now_, "press-1", std::nullopt).empty()) << "it has given its key back";
  EXPECT_TRUE(machine().kept_alive(now_, false).empty());
  EXPECT_TRUE(machine().lost(now_, "gone").empty());
  pass(1h);
  EXPECT_TRUE(machine().time(now_).empty());
  EXPECT_EQ(machine().due(), TimePoint::max());
}

TEST_F(RegistryMachineTest, IsDueWhenItHasSomethingToDo) {
  reach(State::registered);
  EXPECT_EQ(machine().due(), now_ + 1s);
}

}  // namespace
}  // namespace axisd::cell
