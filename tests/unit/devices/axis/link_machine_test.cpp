#include "devices/axis/link_machine.hpp"

#include <gtest/gtest.h>

#include <array>
#include <string>

namespace axisd {
namespace {

using State = LinkMachine::State;

Error cause(Reason reason) { return {.reason = reason, .message = "a: " + std::string(to_string(reason))}; }

/// A link in each of its states.
LinkMachine link_in(State state) {
  LinkMachine link;
  if (state == State::offline) return link;
  link.answers();
  if (state == State::configuring) return link;
  link.configured();
  if (state == State::verifying) return link;
  link.connected();
  if (state == State::silent) link.lost(cause(Reason::no_reply));
  return link;
}

constexpr std::array all{State::offline, State::silent, State::configuring, State::verifying, State::online};

TEST(LinkMachine, EachStateIsShown) {
  for (const auto state : all) EXPECT_EQ(link_in(state).state(), state);
  EXPECT_EQ(link_in(State::offline).shown(), LinkState::offline);
  EXPECT_EQ(link_in(State::silent).shown(), LinkState::offline);
  EXPECT_EQ(link_in(State::configuring).shown(), LinkState::configuring);
  EXPECT_EQ(link_in(State::verifying).shown(), LinkState::configuring);
  EXPECT_EQ(link_in(State::online).shown(), LinkState::online);
}

TEST(LinkMachine, AnAnswerIsNewsOnceAndTakesTheReasonAway) {
  LinkMachine link;
  link.failed(cause(Reason::no_reply), false);
  EXPECT_TRUE(link.answers());
  EXPECT_EQ(link.state(), State::configuring);
  EXPECT_FALSE(link.error());
  link.failed(cause(Reason::wrong_model), true);
  EXPECT_FALSE(link.answers());
  EXPECT_TRUE(link.error()) << "it stays until it is online";
}

TEST(LinkMachine, ADriveThatWasConfiguredIsVerifiedWhenItAnswersAgain) {
  auto link = link_in(State::silent);
  EXPECT_TRUE(link.answers());
  EXPECT_EQ(link.state(), State::verifying);
  link.connected();
  EXPECT_TRUE(link.online());
  EXPECT_FALSE(link.error());
}

TEST(LinkMachine, AConfigurationThatEndsInSilenceIsKnown) {
  LinkMachine link;
  link.configured();
  EXPECT_EQ(link.state(), State::silent);
  EXPECT_TRUE(link.is_configured());
}

TEST(LinkMachine, AnAttemptInVainKeepsWhatIsKnownOfTheConfiguration) {
  auto link = link_in(State::verifying);
  link.failed(cause(Reason::no_reply), false);
  EXPECT_EQ(link.state(), State::silent);
  link.failed(cause(Reason::refused), true);
  EXPECT_EQ(link.state(), State::verifying);
  link = link_in(State::configuring);
  link.failed(cause(Reason::no_reply), false);
  EXPECT_EQ(link.state(), State::offline);
  link.failed(cause(Reason::refused), true);
  EXPECT_EQ(link.state(), State::configuring);
}

TEST(LinkMachine, AnotherReasonIsNews) {
  LinkMachine link;
  EXPECT_TRUE(link.failed(cause(Reason::no_reply), false));
  EXPECT_FALSE(link.failed(cause(Reason::no_reply), false));
  EXPECT_TRUE(link.failed(cause(Reason::bus_down), false));
  EXPECT_EQ(link.error()->reason, Reason::bus_down);
}

TEST(LinkMachine, SilenceEndsIt) {
  auto link = link_in(State::online);
  link.lost(cause(Reason::no_reply));
  EXPECT_EQ(link.state(), State::silent);
  EXPECT_EQ(link.error()->reason, Reason::no_reply);
}

TEST(LinkMachine, ARestartVoidsTheConfigurationFromEachState) {
  for (const auto state : all) {
    auto link = link_in(state);
    link.restarted(cause(Reason::rebooted));
    EXPECT_EQ(link.state(), State::configuring);
    EXPECT_EQ(link.error()->reason, Reason::rebooted);
    EXPECT_EQ(link.restarts(), 1);
  }
}

TEST(LinkMachine, AMemoryThatWasChangedIsConfiguredAgainFromEachState) {
  for (const auto state : all) {
    auto link = link_in(state);
    link.reconfigure(cause(Reason::configuring));
    EXPECT_EQ(link.state(), State::configuring);
    EXPECT_EQ(link.restarts(), 0);
  }
}

TEST(LinkMachine, APortThatClosesAndTheEndMakeItSilent) {
  for (const auto state : all) {
    auto by_port = link_in(state), by_end = link_in(state);
    const auto silent = by_port.is_configured() ? State::silent : State::offline;
    by_port.port_closed(cause(Reason::bus_down));
    EXPECT_EQ(by_port.state(), silent);
    EXPECT_EQ(by_port.error()->reason, Reason::bus_down);
    by_end.close();
    EXPECT_EQ(by_end.state(), silent);
  }
}

TEST(LinkMachine, AReasonCanBeGivenWhateverTheState) {
  auto link = link_in(State::online);
  link.explain(cause(Reason::reloading));
  EXPECT_TRUE(link.online());
  EXPECT_EQ(link.error()->reason, Reason::reloading);
}

TEST(LinkMachine, ABusLossCountsOnlyWhileItIsOnlineAndUntilItIsActedUpon) {
  for (const auto state : all) {
    auto link = link_in(state);
    EXPECT_EQ(link.bus_lost(cause(Reason::bus_down)), state == State::online);
    EXPECT_EQ(link.bus_loss().has_value(), state == State::online);
    link.forget_bus_loss();
    EXPECT_FALSE(link.bus_loss());
  }
}

}  // namespace
}  // namespace axisd
