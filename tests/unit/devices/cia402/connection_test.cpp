// First contact with simulated YSS-Cs, and what they report.
#include <gtest/gtest.h>

#include "tests/unit/devices/cia402/drive_bench.hpp"

namespace axisd::cia402 {
namespace {

/// Two motors would turn on one command. The second need not answer soon after the first.
TEST(Cia402Connection, ASecondDriveWithTheSameNodeIdIsNoticedThoughItAnswersLate) {
  DriveBench bench;
  simulation::NetworkNodes others(bench.world().clock(), bench.network());
  others.nodes().add(std::make_unique<yss_c::SimulatedDrive>(
      simulation::SimulatedNodeSettings{.address = DriveBench::node}));
  others.nodes().add_fault(simulation::Fault{
      .kind = simulation::FaultKind::delay_reply, .count = -1, .delay = std::chrono::seconds(2)});
  bench.world().run_for(std::chrono::seconds(1));  // it boots before it is looked for
  bench.bring_up();
  bench.world().run_for(std::chrono::seconds(3));
  const auto checked = bench.run(bench.drive().check_continuity(TransactionClass::parameters));
  ASSERT_FALSE(checked);
  EXPECT_EQ(checked.error().reason, Reason::misconfigured) << to_string(checked.error());
  const auto moved = bench.run(bench.drive().enable({}));
  ASSERT_FALSE(moved);
  EXPECT_EQ(moved.error().reason, Reason::misconfigured) << to_string(moved.error());
}

/// The status word tells of the fault still, 603Fh no more.
TEST(Cia402Alarms, AResetBetweenTwoObjectsOfOneReadingIsNoOtherAlarm) {
  DriveBench bench;
  bench.bring_up();
  bench.simulated().raise_alarm(2);
  bench.nodes().advance();
  bench.world().run_for(std::chrono::milliseconds(200));
  const auto alarmed = bench.run(bench.drive().read_state(TransactionClass::motion));
  ASSERT_TRUE(alarmed) << to_string(alarmed.error());
  ASSERT_EQ(alarmed->alarm_code, 2);
  bool cleared = false;
  bench.nodes().set_observer([&](TimePoint, bool received, const can::Frame& frame) {
    const bool asks_for_error_code =
        received && frame.id == 0x605 && frame.data[1] == 0x3F && frame.data[2] == 0x60;
    if (asks_for_error_code && !std::exchange(cleared, true)) bench.simulated().raise_alarm(0);
  });
  const auto sample = bench.run(bench.drive().read_state(TransactionClass::motion));
  ASSERT_TRUE(sample) << to_string(sample.error());
  ASSERT_TRUE(cleared);
  EXPECT_EQ(sample->alarm_code, 0);
}

/// A late reply to an earlier stop may answer the next one, which was lost. What is read back to prove it is
/// refused then: that is no refusal of the stop.
TEST(Cia402Stops, ARefusedProofIsNoRefusalOfTheStop) {
  using simulation::FaultKind;
  using std::chrono::milliseconds;
  constexpr std::uint16_t control_word = 0x6040, halt_option = 0x605D, target_velocity = 0x60FF;
  bool proven_by_reading = false;
  for (auto delay = milliseconds(110); delay <= milliseconds(260); delay += milliseconds(10)) {
    SCOPED_TRACE(delay.count());
    DriveBench bench;
    bench.bring_up();
    ASSERT_TRUE(bench.run(bench.drive().stop(StopKind::stop)));
    for (const auto object : {halt_option, target_velocity})
      bench.nodes().add_fault({.kind = FaultKind::drop_reply, .count = -1, .object = object});
    bench.nodes().add_fault({.kind = FaultKind::delay_reply, .delay = delay, .object = control_word});
    (void)bench.run(bench.drive().stop(StopKind::stop));
    bench.nodes().add_fault({.kind = FaultKind::drop_request, .object = control_word});
    bench.nodes().add_fault(
        {.kind = FaultKind::abort, .count = -1, .object = control_word, .code = 0x08000000});
    const auto lost = bench.run(bench.drive().stop(StopKind::stop));
    ASSERT_FALSE(lost);
    EXPECT_EQ(lost.error().reason, Reason::no_reply) << to_string(lost.error());
    EXPECT_EQ(lost.error().outcome, Outcome::unknown);
    proven_by_reading |= lost.error().where.native_code.has_value();
  }
  EXPECT_TRUE(proven_by_reading) << "no late reply has answered the second stop";
}

/// What a busy network brings late is waited for: asking by SDO as well would only make it busier. But what
/// waits is told with the age that it has, and a node that is not heard any more is asked.
TEST(Cia402State, LatePdosOfALivingNodeAreWaitedForAndThoseOfASilentOneAreNot) {
  using std::chrono::milliseconds;
  for (const bool heartbeat : {true, false}) {
    DriveBench bench({}, DriveBench::plain_setup(), milliseconds(10));
    bench.bring_up();
    bench.world().run_for(std::chrono::seconds(1));
    const auto without = [&](bool pdos) {
      bench.network().set_fault([=](const can::Frame& frame) {
        const bool beat = frame.id == 0x700U + DriveBench::node;
        const bool pdo = frame.id == 0x180U + DriveBench::node || frame.id == 0x280U + DriveBench::node;
        return can::Network::Fault{.drop = (beat && !heartbeat) || (pdo && pdos)};
      });
    };
    without(false);
    bench.world().run_for(milliseconds(600));
    without(true);
    const auto begun = bench.world().now();
    const auto pdos_again = bench.world().clock().call_at(begun + milliseconds(45), [&] { without(false); });
    int asked = 0;
    bench.nodes().set_observer([&](TimePoint, bool received, const can::Frame& frame) {
      if (received && frame.id == 0x600U + DriveBench::node) ++asked;
    });
    const auto sample = bench.run(bench.drive().read_state(TransactionClass::moving_state));
    ASSERT_TRUE(sample) << to_string(sample.error());
    EXPECT_EQ(asked == 0, heartbeat) << asked;
    EXPECT_GE(sample->asked_at, begun);
    EXPECT_GE(sample->measured_at, begun + (heartbeat ? milliseconds(45) : milliseconds(30)));
  }
}

}  // namespace
}  // namespace axisd::cia402
