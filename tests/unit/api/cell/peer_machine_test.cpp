// Each arrow of the drawing in peer_machine.hpp.
#include "api/cell/peer_machine.hpp"

#include <gmock/gmock.h>

namespace axisd::cell {
namespace {

using namespace std::chrono_literals;
using State = PeerMachine::State;
using Effect = PeerMachine::Effect;

class PeerMachineTest : public ::testing::Test {
 protected:
  void answer(const std::string& name = "press-2") {
    peer_.answered(now_, {.machine = name, .instance_id = "run", .version = "1", .round_trip = 1ms});
  }
  void reach(State state) {
    if (state == State::unknown) return;
    EXPECT_EQ(peer_.time(now_), Effect::ask);
    if (state == State::silent) return peer_.failed(now_, "refused");
    answer();
    if (state == State::late) peer_.late(now_, "slow");
    if (state == State::lost) peer_.connection_lost(now_);
    ASSERT_EQ(peer_.state(), state);
  }

  TimePoint now_{1h};
  PeerMachine peer_{"press-2", PeerMachine::Times(), now_};
};

TEST_F(PeerMachineTest, IsAskedAtOnce) {
  EXPECT_EQ(peer_.time(now_), Effect::ask);
  EXPECT_EQ(peer_.time(now_), Effect::none) << "one question at a time";
  EXPECT_EQ(peer_.due(), TimePoint::max());
}

TEST_F(PeerMachineTest, WhoAnswersIsAskedEachSecond) {
  reach(State::answering);
  EXPECT_TRUE(peer_.answers());
  EXPECT_TRUE(peer_.is_open());
  EXPECT_EQ(peer_.due(), now_ + 1s);
  now_ += 1s;
  EXPECT_EQ(peer_.time(now_), Effect::ask);
}

TEST_F(PeerMachineTest, WhoWasNeverHeardOfIsSilentAtTheFirstFailure) {
  (void)peer_.time(now_);
  peer_.failed(now_, "connection refused");
  EXPECT_EQ(peer_.state(), State::silent);
  EXPECT_EQ(peer_.trouble(), "connection refused");
  EXPECT_FALSE(peer_.is_open());
}

TEST_F(PeerMachineTest, OneLateAnswerIsNoDeath) {
  reach(State::answering);
  (void)peer_.time(now_ + 1s);
  peer_.late(now_, "slow");
  EXPECT_EQ(peer_.state(), State::late);
  EXPECT_TRUE(peer_.answers());
  EXPECT_TRUE(peer_.is_open()) << "the connection is the same";
  now_ += 100ms;
  EXPECT_EQ(peer_.time(now_), Effect::ask);
  answer();
  EXPECT_EQ(peer_.state(), State::answering);
}

TEST_F(PeerMachineTest, TwoLateAnswersAre) {
  reach(State::late);
  (void)peer_.time(now_ + 100ms);
  peer_.late(now_, "slow");
  EXPECT_EQ(peer_.state(), State::silent);
}

TEST_F(PeerMachineTest, ALateOneThatFailsIsSilent) {
  reach(State::late);
  peer_.failed(now_, "reset");
  EXPECT_EQ(peer_.state(), State::silent);
}

TEST_F(PeerMachineTest, ALostConnectionTakesNoCallsUntilItIsKnownWhoIsThere) {
  reach(State::answering);
  peer_.connection_lost(now_);
  EXPECT_EQ(peer_.state(), State::lost);
  EXPECT_TRUE(peer_.answers()) << "it may have been the network";
  EXPECT_FALSE(peer_.is_open());
  EXPECT_EQ(peer_.time(now_), Effect::ask_anew) << "at once";
  answer();
  EXPECT_TRUE(peer_.is_open());
}

TEST_F(PeerMachineTest, ALateOneWhoseConnectionEndsIsLost) {
  reach(State::late);
  peer_.connection_lost(now_);
  EXPECT_EQ(peer_.state(), State::lost);
}

TEST_F(PeerMachineTest, AFailedQuestionIsAskedOnceMoreOnAnotherConnection) {
  reach(State::answering);
  (void)peer_.time(now_ + 1s);
  peer_.failed(now_, "reset");
  EXPECT_EQ(peer_.state(), State::lost);
  EXPECT_EQ(peer_.due(), now_ + 100ms);
  EXPECT_EQ(peer_.time(now_ + 100ms), Effect::ask_anew);
  peer_.failed(now_, "refused");
  EXPECT_EQ(peer_.state(), State::silent);
}

TEST_F(PeerMachineTest, ALostOneThatIsLateIsSilent) {
  reach(State::lost);
  peer_.late(now_, "slow");
  EXPECT_EQ(peer_.state(), State::silent);
}

TEST_F(PeerMachineTest, ASilentOneIsAskedAnewEachSecond) {
  reach(State::silent);
  EXPECT_EQ(peer_.time(now_ + 999ms), Effect::none);
  EXPECT_EQ(peer_.time(now_ + 1s), Effect::ask_anew);
  answer();
  EXPECT_EQ(peer_.state(), State::answering);
  EXPECT_EQ(peer_.trouble(), "");
}

TEST_F(PeerMachineTest, ASilentOneHasNoConnectionToLose) {
  reach(State::silent);
  peer_.connection_lost(now_);
  EXPECT_EQ(peer_.state(), State::silent);
}

TEST_F(PeerMachineTest, AnotherMachineIsNotTakenForIt) {
  reach(State::answering);
  answer("press-3");
  EXPECT_EQ(peer_.state(), State::silent);
  EXPECT_FALSE(peer_.is_open());
  EXPECT_THAT(peer_.trouble(), ::testing::HasSubstr("leads to the machine 'press-3'"));
}

TEST_F(PeerMachineTest, AnotherAddressIsAskedAtOnceBeforeAnythingGoesThere) {
  reach(State::answering);
  peer_.moved(now_);
  EXPECT_FALSE(peer_.is_open());
  EXPECT_EQ(peer_.time(now_), Effect::ask_anew);
}

}  // namespace
}  // namespace axisd::cell
