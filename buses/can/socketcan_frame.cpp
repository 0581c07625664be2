#include "buses/can/socketcan_frame.hpp"

#include <linux/can/error.h>

#include <algorithm>

namespace axisd::can {

can_frame to_kernel(const Frame& frame) {
  can_frame kernel{};
  kernel.can_id = frame.id | (frame.extended ? CAN_EFF_FLAG : 0U) | (frame.rtr ? CAN_RTR_FLAG : 0U);
  kernel.len = frame.size;
  std::ranges::copy(frame.data, kernel.data);
  return kernel;
}

Frame from_kernel(const can_frame& kernel) {
  const bool extended = (kernel.can_id & CAN_EFF_FLAG) != 0;
  Frame frame{.id = kernel.can_id & (extended ? CAN_EFF_MASK : CAN_SFF_MASK),
              .extended = extended,
              .rtr = (kernel.can_id & CAN_RTR_FLAG) != 0,
              // Some controllers give a DLC above 8 for 8 bytes.
              .size = std::min<std::uint8_t>(kernel.len, CAN_MAX_DLEN)};
  if (!frame.rtr) std::copy_n(kernel.data, frame.size, frame.data.begin());
  return frame;
}

can_err_mask_t wanted_errors() { return CAN_ERR_CRTL | CAN_ERR_BUSOFF | CAN_ERR_RESTARTED | CAN_ERR_ACK; }

std::optional<Controller> controller_of(const can_frame& error_frame) {
  if ((error_frame.can_id & CAN_ERR_BUSOFF) != 0) return Controller::bus_off;
  if ((error_frame.can_id & CAN_ERR_CRTL) == 0) return std::nullopt;
  const auto status = error_frame.data[1];
  if ((status & (CAN_ERR_CRTL_RX_PASSIVE | CAN_ERR_CRTL_TX_PASSIVE)) != 0) return Controller::passive;
  // A warning is below passive: coming down from passive the controller may report nothing else.
  if ((status & (CAN_ERR_CRTL_ACTIVE | CAN_ERR_CRTL_RX_WARNING | CAN_ERR_CRTL_TX_WARNING)) != 0)
    return Controller::active;
  return std::nullopt;
}

}  // namespace axisd::can
