// A drive that is restarted while its node is not asked, because it was silent or answered what nobody could
// tell from late replies (M7).
#include <gtest/gtest.h>

#include "buses/modbus_rtu/rtu_bus.hpp"
#include "tests/support/rig.hpp"

namespace axisd::test {
namespace {

using namespace std::chrono_literals;
using simulation::FaultKind;

constexpr std::uint16_t canary = 0x0020;
/// 2.5 s, and what is under way then may go on to its end.
constexpr auto longest_unproven = 2600ms;

/// Knows when the drive has last proven that it was not restarted.
class Witness {
 public:
  explicit Witness(Rig& rig) : rig_(&rig) {}

  TimePoint proven() {
    const auto& wire = rig_->line->wire();
    for (; seen_ < wire.size(); ++seen_) {
      const bool may_be_under_way = seen_ + 1 == wire.size();
      if (may_be_under_way && wire[seen_].status == modbus_rtu::ExchangeStatus::timeout) break;
      note(wire[seen_]);
    }
    return proven_;
  }
  /// Runs until it was proven just now.
  void await_proof() {
    const auto before = proven();
    ASSERT_TRUE(rig_->run_until([&] { return proven() != before; }, 2s));
  }
  /// Runs and looks at each millisecond.
  void run(Duration time) {
    for (auto ms = 0ms; ms < time; ms += 1ms) {
      rig_->run(1ms);
      if (rig_->state()->link != LinkState::online) continue;
      ASSERT_LE(rig_->world.now() - proven(), longest_unproven) << "online though nobody knows";
    }
  }

 private:
  void note(const WireEntry& entry) {
    const bool proof = !entry.is_write() && entry.address() == canary;
    if (proof && entry.status == modbus_rtu::ExchangeStatus::replied) proven_ = entry.end;
  }
  Rig* rig_;
  std::size_t seen_ = 0;
  TimePoint proven_{};
};

/// The counter of a drive that was restarted is never shown with the trust of before.
void expect_noticed(Rig& rig, Witness& witness) {
  for (int i = 0; i < 9000; ++i) {
    ASSERT_NO_FATAL_FAILURE(witness.run(1ms));
    const auto state = rig.state();
    if (state->link == LinkState::online && state->trust != PositionTrust::unknown)
      ASSERT_EQ(state->position, 10) << i;
  }
  EXPECT_EQ(rig.state()->link, LinkState::online);
  EXPECT_EQ(rig.state()->reboots, 1);
  EXPECT_EQ(rig.state()->trust, PositionTrust::unknown);
}

/// A reading that waited for long, because its node was not asked meanwhile, shows nothing before the drive
/// has proven that it was not restarted; and who waits for longer than that is offline.
TEST(M07, PowerCycleWhileTheNodeIsHeldBack) {
  int stayed = 0, gone = 0;
  both_directions({}, [&](const RigOptions& options) {
    for (auto silent = 1400ms; silent <= 3800ms; silent += 200ms) {
      SCOPED_TRACE(silent.count());
      Rig rig(options);
      Witness witness(rig);
      rig.ready();
      EXPECT_EQ(rig.complete(MoveAbsoluteRequest{.position = 10}).state, CommandState::done);
      witness.await_proof();
      rig.fault({.kind = FaultKind::drop_request, .count = -1});
      // Each asks several times in vain: polls are held back for longer and longer.
      for (auto passed = 0ms; passed < silent; passed += 100ms) {
        if (passed % 700ms == 0ms) (void)rig.try_submit(MoveAbsoluteRequest{.position = 20});
        ASSERT_NO_FATAL_FAILURE(witness.run(100ms));
      }
      rig.state()->link == LinkState::online ? ++stayed : ++gone;
      rig.cycle_power(300ms);
      rig.faults().clear();
      ASSERT_NO_FATAL_FAILURE(expect_noticed(rig, witness));
    }
  });
  EXPECT_GT(stayed, 0);
  EXPECT_GT(gone, 0);
}

/// Replies of every length may still come: nothing is read for seconds, though the node is fine.
void use_up_all_lengths(Rig& rig) {
  rig.fault({.kind = FaultKind::corrupt_reply, .function = 0x03, .count = -1});
  int ended = 0;
  auto read = [](modbus_rtu::RtuBus& bus, std::uint16_t count, int& reads) -> Task<> {
    (void)co_await bus.transact({.node = 1, .address = 0x0040, .count = count}, {});
    ++reads;
  };
  constexpr std::uint16_t longest = 16;
  for (std::uint16_t count = 1; count <= longest; ++count)
    spawn(rig.world.executor(), read(*rig.machine->find_line("line-a"), count, ended), "read");
  ASSERT_TRUE(rig.run_until([&] { return ended == longest; }, 1s));
  rig.faults().clear();
  ASSERT_EQ(rig.state()->link, LinkState::online);
}

/// No request fails meanwhile, as none is sent.
TEST(M07, PowerCycleWhileNoReplyCouldBeToldFromALateOne) {
  both_directions({}, [](const RigOptions& options) {
    for (const auto wait : {0ms, 1000ms, 3000ms}) {
      SCOPED_TRACE(wait.count());
      Rig rig(options);
      Witness witness(rig);
      rig.ready();
      EXPECT_EQ(rig.complete(MoveAbsoluteRequest{.position = 10}).state, CommandState::done);
      witness.await_proof();
      // To just after a reading: the next is 200 ms away.
      const auto read = rig.state()->sampled.after();
      ASSERT_TRUE(rig.run_until([&] { return rig.state()->sampled.after() != read; }, 1s));
      ASSERT_NO_FATAL_FAILURE(use_up_all_lengths(rig));
      ASSERT_NO_FATAL_FAILURE(witness.run(wait));
      rig.cycle_power(300ms);
      ASSERT_NO_FATAL_FAILURE(expect_noticed(rig, witness));
    }
  });
}

/// A drive that may still be moving then gets its stop at once, before what waited for it.
TEST(M04, TheFirstFrameAfterItWasHeldBackForTooLongIsAStop) {
  RigOptions slow;
  slow.adjust = [](AxisSettings& axis) { axis.poll_moving = 500ms; };
  both_directions(slow, [](const RigOptions& options) {
    Rig rig(options);
    Witness witness(rig);
    rig.ready();
    const auto move = rig.submit(MoveAbsoluteRequest{.position = 390, .with = {.velocity = 20}});
    rig.run(1s);
    witness.await_proof();
    rig.run(20ms);
    ASSERT_NO_FATAL_FAILURE(use_up_all_lengths(rig));
    rig.line->forget_wire();
    ASSERT_TRUE(rig.run_until([&] { return rig.state()->link == LinkState::offline; }, 4s));
    EXPECT_TRUE(rig.line->wire().empty()) << "it was not held back";
    EXPECT_EQ(move->value().state, CommandState::unknown) << describe(move->value());
    rig.run(50ms);
    ASSERT_FALSE(rig.line->wire().empty());
    EXPECT_EQ(rig.line->wire().front().address(), 0x0028);
    rig.run(1s);
    rig.drive->advance(rig.world.now());
    EXPECT_FALSE(rig.drive->shaft_moving());
    EXPECT_EQ(rig.state()->link, LinkState::offline);
    rig.reconnect();
    EXPECT_EQ(rig.state()->reboots, 0);
    EXPECT_EQ(rig.state()->trust, PositionTrust::unknown) << "a limit may have stopped it before";
    EXPECT_NEAR(rig.state()->position, rig.load_mm(), 1e-9);
  });
}

/// Somebody else's exchange kept the line: where readings are rare, nothing but the canaries themselves would
/// notice that they come no more.
TEST(M07, TheCanaryIsReadAgainInTimeOnceTheLineIsFree) {
  for (const auto idle : {200ms, 2000ms, 5000ms, 10000ms})
    for (const auto kept : {300ms, 450ms, 600ms, 900ms})
      for (const auto after : {100ms, 790ms, 845ms}) {
        SCOPED_TRACE(testing::Message() << idle.count() << ", " << kept.count() << ", " << after.count());
        Rig rig({.adjust = [idle](AxisSettings& axis) { axis.poll_idle = idle; }});
        rig.run(2s);
        auto keep = [](modbus_rtu::RtuBus& bus, Duration turnaround) -> Task<> {
          (void)co_await bus.transact(
              {.node = 9, .address = 0x0003, .count = 1},
              {.transaction_class = TransactionClass::stop, .turnaround_max = turnaround});
        };
        const auto is_canary = [](const WireEntry& entry) {
          return entry.node() == 1 && entry.address() == 0x0020;
        };
        rig.line->forget_wire();
        ASSERT_TRUE(rig.run_until(
            [&] { return !rig.line->wire().empty() && is_canary(rig.line->wire().back()); }, 2s));
        rig.run(after);
        spawn(rig.world.executor(), keep(*rig.machine->find_line("line-a"), kept), "keep");
        rig.run(22s);
        std::optional<TimePoint> last;
        for (const auto& entry : rig.line->wire()) {
          if (!is_canary(entry)) continue;
          if (last) EXPECT_LE(entry.begin - *last, 1s + kept);
          if (last && entry.begin > rig.line->wire().front().begin + 4s) EXPECT_LE(entry.begin - *last, 1s);
          last = entry.begin;
        }
        EXPECT_GE(rig.world.now() - *last, 0s);
        EXPECT_LE(rig.world.now() - *last, 1s);
        EXPECT_EQ(rig.state()->link, LinkState::online);
      }
}

}  // namespace
}  // namespace axisd::test
