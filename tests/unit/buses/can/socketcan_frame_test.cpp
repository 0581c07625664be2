#include "buses/can/socketcan_frame.hpp"

#include <gtest/gtest.h>
#include <linux/can/error.h>

#include "tests/unit/buses/can/frames.hpp"

namespace axisd::can {
namespace {

using test::frame_of;

TEST(SocketCanFrame, SurvivesTheKernelsForm) {
  for (const auto& frame :
       {frame_of(0x7FF, {1, 2, 3}), frame_of(0), Frame{.id = 0x12345, .extended = true, .size = 8},
        Frame{.id = 0x123, .rtr = true, .size = 4}})
    EXPECT_EQ(from_kernel(to_kernel(frame)), frame) << to_string(frame);
  EXPECT_EQ(to_kernel(Frame{.id = 1, .extended = true}).can_id, 1U | CAN_EFF_FLAG);
}

TEST(SocketCanFrame, ClearsWhatIsBehindTheData) {
  can_frame kernel{};
  kernel.can_id = 0x181;
  kernel.len = 2;
  kernel.data[0] = 1;
  kernel.data[7] = 9;
  EXPECT_EQ(from_kernel(kernel), frame_of(0x181, {1, 0}));
  kernel.can_id |= CAN_RTR_FLAG;
  EXPECT_TRUE(valid(from_kernel(kernel)));
}

can_frame error_frame(canid_t classes, std::uint8_t status = 0) {
  can_frame frame{};
  frame.can_id = CAN_ERR_FLAG | classes;
  frame.len = CAN_ERR_DLC;
  frame.data[1] = status;
  return frame;
}

TEST(SocketCanFrame, TellsTheControllersStateFromErrorFrames) {
  EXPECT_EQ(controller_of(error_frame(CAN_ERR_BUSOFF)), Controller::bus_off);
  EXPECT_EQ(controller_of(error_frame(CAN_ERR_CRTL, CAN_ERR_CRTL_TX_PASSIVE)), Controller::passive);
  EXPECT_EQ(controller_of(error_frame(CAN_ERR_CRTL, CAN_ERR_CRTL_RX_PASSIVE | CAN_ERR_CRTL_RX_WARNING)),
            Controller::passive);
  EXPECT_EQ(controller_of(error_frame(CAN_ERR_CRTL, CAN_ERR_CRTL_RX_WARNING)), Controller::active);
  EXPECT_EQ(controller_of(error_frame(CAN_ERR_CRTL, CAN_ERR_CRTL_ACTIVE)), Controller::active);
  EXPECT_EQ(controller_of(error_frame(CAN_ERR_CRTL, CAN_ERR_CRTL_RX_OVERFLOW)), std::nullopt);
  EXPECT_EQ(controller_of(error_frame(CAN_ERR_ACK)), std::nullopt);
}

}  // namespace
}  // namespace axisd::can
