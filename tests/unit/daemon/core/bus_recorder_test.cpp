#include "daemon/core/bus_recorder.hpp"

#include <gtest/gtest.h>

#include "tests/support/virtual_world.hpp"

namespace axisd::core {
namespace {

using namespace std::chrono_literals;

/// 100 frames of at most 135 bits at 1 Mbit/s, half of them received, in a tenth of a second.
TEST(BusRecorder, ANetworkIsOccupiedAsLongAsItsFramesAreOnTheWire) {
  test::VirtualWorld world;
  BusRecorder recorder("can0", 1000, 1'000'000, world.clock(), {});
  const auto observer = recorder.network_observer();
  const auto frame = can::make_frame(0x185, std::array<std::uint8_t, 8>{});
  for (int i = 0; i < 50; ++i) {
    world.run_for(1ms);
    observer.received({.frame = frame, .at = world.now()});
    world.run_for(1ms);
    const auto now = world.now();
    observer.ended(frame, TransactionClass::motion,
                   {.status = can::SendStatus::sent, .handed_over = now, .sent_at = now}, now);
  }
  EXPECT_EQ(recorder.network_load().occupied(), 100 * 135us);
  EXPECT_DOUBLE_EQ(recorder.network_load().overall(world.now()), 0.135);
}

}  // namespace
}  // namespace axisd::core
