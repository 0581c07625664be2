// A watch with a second request that proves what its readings say.
#include <gtest/gtest.h>

#include <algorithm>

#include "watch_rig.hpp"

namespace axisd::modbus_rtu {
namespace {

using namespace std::chrono_literals;
using test::WatchRig;

std::vector<std::uint16_t> addresses(const WatchRig& rig) {
  std::vector<std::uint16_t> of;
  for (const auto& entry : rig.line->wire()) of.push_back(entry.address());
  return of;
}
constexpr auto state = WatchRig::watched;
constexpr auto proof = WatchRig::proof;

/// One axis whose third and fourth reading have a proof between them, from the second one on at rest.
class RtuBusWatchProof : public ::testing::Test {
 protected:
  RtuBusWatchProof() {
    rig_.proof_every[1] = 3;
    rig_.watch(1, 100ms);
  }
  /// The proof is on the line.
  void run_until_proof() {
    for (int i = 0; i < 20000 && !proof_is_under_way(); ++i) rig_.world.run_for(50us);
    ASSERT_TRUE(proof_is_under_way());
  }
  [[nodiscard]] bool proof_is_under_way() const {
    return !rig_.line->wire().empty() && rig_.line->wire().back().address() == proof;
  }
  [[nodiscard]] const test::WatchEnd& end() const { return rig_.ends.at(1).front(); }

  WatchRig rig_{2};
};

TEST_F(RtuBusWatchProof, GoesBeforeTheReadingAtWhichItIsDue) {
  rig_.world.run_for(750ms);
  EXPECT_EQ(addresses(rig_), (std::vector<std::uint16_t>{state, state, state, proof, state, state, state,
                                                         proof, state, state}));
  const auto& wire = rig_.line->wire();
  EXPECT_EQ(wire[3].begin - wire[2].begin, 100ms) << "in the place of the reading";
  EXPECT_LT(wire[4].begin - wire[3].begin, 20ms) << "which follows at once";
  ASSERT_EQ(rig_.proofs.size(), 2U);
  EXPECT_EQ(rig_.proofs[0].sent_at, wire[3].begin);
  EXPECT_EQ(rig_.proofs[0].answered_at, wire[3].end);
  EXPECT_EQ(rig_.proofs[0].registers, (std::vector<std::uint16_t>{0x1008, 0x1009, 0x100A}));
  EXPECT_FALSE(rig_.ended(1));
  rig_.expect_told_as_sent();
  rig_.expect_silences();
}

TEST_F(RtuBusWatchProof, OneThatIsDueSoonerMovesNoReading) {
  rig_.proof_before = 30ms;
  rig_.world.run_for(450ms);
  EXPECT_EQ(addresses(rig_), (std::vector<std::uint16_t>{state, state, state, proof, state, state}));
  const auto& wire = rig_.line->wire();
  EXPECT_EQ(wire[3].begin - wire[2].begin, 70ms);
  EXPECT_EQ(wire[4].begin - wire[2].begin, 100ms);
  EXPECT_EQ(wire[5].begin - wire[2].begin, 200ms);
}

TEST_F(RtuBusWatchProof, OneThatDoesNotHoldEndsTheWatch) {
  rig_.world.run_for(450ms);
  rig_.poke(1, 7, proof);
  rig_.world.run_for(1s);
  ASSERT_TRUE(rig_.ended(1));
  ASSERT_TRUE(end().result);
  EXPECT_FALSE(*end().result) << "it is no reading";
  EXPECT_EQ(end().at, rig_.line->wire().back().end) << "at once";
  EXPECT_EQ(rig_.proofs.size(), 2U);
  EXPECT_TRUE(rig_.bus->idle());
}

TEST_F(RtuBusWatchProof, OneWithoutAnAnswerEndsTheWatchWithTheError) {
  rig_.world.run_for(250ms);
  rig_.line->network().node(1)->set_power(false);
  rig_.world.run_for(2s);
  ASSERT_TRUE(rig_.ended(1));
  ASSERT_FALSE(end().result);
  EXPECT_EQ(end().result.error().reason, Reason::no_reply);
  EXPECT_TRUE(rig_.proofs.empty());
}

TEST_F(RtuBusWatchProof, WhoeverEndsTheWatchMeanwhileWaitsForNothingBehindIt) {
  run_until_proof();
  rig_.bus->end_repetition(1);
  rig_.world.run_for(50ms);
  ASSERT_TRUE(rig_.ended(1));
  ASSERT_TRUE(end().result);
  EXPECT_FALSE(*end().result);
  EXPECT_EQ(end().at, rig_.line->wire().back().end);
  EXPECT_EQ(rig_.proofs.size(), 1U) << "it was proven all the same";
  EXPECT_TRUE(proof_is_under_way()) << "nothing follows";
}

TEST_F(RtuBusWatchProof, BetweenTwoReadingsNothingIsProvenAnyMore) {
  rig_.world.run_for(250ms);  // the proof rests
  rig_.bus->end_repetition(1);
  rig_.world.run_for(500ms);
  ASSERT_TRUE(rig_.ended(1));
  EXPECT_FALSE(*end().result);
  EXPECT_EQ(rig_.line->wire().size(), 3U);
}

TEST_F(RtuBusWatchProof, APortThatIsLostMeanwhileEndsItOnce) {
  run_until_proof();
  rig_.bus->close();
  rig_.world.run_for(1s);
  EXPECT_EQ(rig_.ends.at(1).size(), 1U);
}

TEST_F(RtuBusWatchProof, APortThatIsLostWhileItRestsEndsItOnce) {
  rig_.world.run_for(250ms);
  rig_.bus->close();
  rig_.world.run_for(1s);
  EXPECT_EQ(rig_.ends.at(1).size(), 1U);
}

TEST_F(RtuBusWatchProof, JoinedByTheSameReadingOfAnotherEndsForBoth) {
  rig_.world.run_for(299ms);
  rig_.read("busy", 2, TransactionClass::idle_state, 0x0003, 16);
  rig_.world.run_for(2ms);  // the proof waits
  rig_.read("plain", 1, TransactionClass::parameters, proof, WatchRig::proof_count);
  rig_.world.run_for(500ms);
  ASSERT_EQ(rig_.results["plain"].size(), 1U);
  ASSERT_TRUE(rig_.results["plain"].front());
  EXPECT_EQ(rig_.results["plain"].front()->registers.front(), WatchRig::value_of(1, proof - state));
  ASSERT_TRUE(rig_.ended(1));
  EXPECT_FALSE(*end().result) << "the registers are not those of the state";
}

TEST_F(RtuBusWatchProof, OneThatIsHastenedIsJudgedAndWaitedFor) {
  rig_.world.run_for(299ms);
  rig_.read("busy", 2, TransactionClass::idle_state, 0x0003, 16);
  rig_.world.run_for(2ms);
  rig_.bus->hasten(1, TransactionClass::moving_state);
  rig_.world.run_for(100ms);
  ASSERT_TRUE(rig_.ended(1));
  EXPECT_FALSE(*end().result);
  ASSERT_EQ(rig_.proofs.size(), 1U);
  EXPECT_EQ(end().at, rig_.proofs.front().answered_at);
}

TEST(RtuBusWatchProofs, SeveralGoBetweenReadingsThatAreRare) {
  WatchRig rig(1);
  rig.proof_every[1] = 0;
  rig.proof_period = 300ms;
  rig.watch(1, 1s);
  rig.world.run_for(2500ms);
  EXPECT_EQ(addresses(rig), (std::vector<std::uint16_t>{state, proof, proof, proof, state, proof, proof,
                                                        proof, state, proof}));
  std::vector<TimePoint> readings;
  for (const auto& entry : rig.line->wire())
    if (entry.address() == state) readings.push_back(entry.begin);
  ASSERT_EQ(readings.size(), 3U);
  EXPECT_EQ(readings[1] - readings[0], 1s) << "they keep no reading waiting";
  EXPECT_EQ(readings[2] - readings[1], 1s);
}

TEST(RtuBusWatchProofs, GoAheadOfReadingsThatWereAskedForSince) {
  WatchRig rig;
  rig.proof_every[2] = 5;
  for (std::uint8_t node = 1; node <= 4; ++node) rig.watch(node, 1ms, 16);
  rig.world.run_for(2s);
  const auto& wire = rig.line->wire();
  int proofs = 0;
  for (std::size_t i = 4; i + 5 < wire.size(); ++i) {
    if (wire[i].address() != proof) continue;
    ++proofs;
    std::vector<int> around;
    for (std::size_t j = i - 4; j <= i + 4; ++j) around.push_back(wire[j].node());
    EXPECT_EQ(std::ranges::count(around, 2), 3) << "a reading before, and one in its turn behind";
  }
  EXPECT_GT(proofs, 5);
}

TEST_F(RtuBusWatchProof, AReadingThatSaysSomethingNewIsTheAnswerStill) {
  rig_.world.run_for(350ms);  // one proof has been, and the exchanges were turned twice
  rig_.poke(1, 7);
  rig_.world.run_for(500ms);
  ASSERT_TRUE(rig_.ended(1));
  ASSERT_TRUE(end().result && *end().result);
  EXPECT_EQ((*end().result)->registers, (std::vector<std::uint16_t>{7, 0x1001, 0x1002, 0x1003}));
}

TEST(RtuBusWatchProofs, AreCarriedOutInRoundsToo) {
  WatchRig rig;
  for (std::uint8_t node = 1; node <= 4; ++node) {
    rig.proof_every[node] = 2;
    rig.watch(node, 1ms);  // the line is full: some always wait
  }
  rig.world.run_for(1s);
  EXPECT_TRUE(rig.ends.empty());
  rig.expect_silences();
  EXPECT_GE(rig.proofs.size(), 32U);
  const auto in_rounds =
      std::ranges::count_if(rig.proofs, [](const auto& one) { return one.at > one.answered_at; });
  EXPECT_GT(in_rounds, 16) << "told with what follows it";
  for (const auto& one : rig.proofs) EXPECT_LE(one.at - one.answered_at, 40ms);
}

TEST(RtuBusWatchProofs, OneThatDoesNotHoldIsToldAtOnceInARound) {
  WatchRig rig;
  for (std::uint8_t node = 1; node <= 4; ++node) rig.proof_every[node] = 1;
  rig.watch_all();
  rig.world.run_for(5 * WatchRig::period / 2);
  rig.poke(1, 7, proof);
  rig.world.run_for(2 * WatchRig::period);
  ASSERT_TRUE(rig.ended(1));
  EXPECT_FALSE(*rig.ends[1].front().result);
  EXPECT_EQ(rig.ends.size(), 1U);
  const auto last =
      std::find_if(rig.proofs.rbegin(), rig.proofs.rend(), [](const auto& one) { return one.node == 1; });
  ASSERT_NE(last, rig.proofs.rend());
  EXPECT_EQ(last->at, last->answered_at);
  EXPECT_EQ(rig.ends[1].front().at, last->answered_at);
}

}  // namespace
}  // namespace axisd::modbus_rtu
