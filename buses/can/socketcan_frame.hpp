// The kernel's form of frames. Pure.
#pragma once

#include <linux/can.h>

#include <optional>

#include "buses/can/link_tracker.hpp"
#include "buses/can/port.hpp"

namespace axisd::can {

/// Precondition: valid(frame).
can_frame to_kernel(const Frame& frame);
/// A data or remote frame. Precondition: not an error frame.
Frame from_kernel(const can_frame& frame);

/// Which error frames the port asks for (CAN_RAW_ERR_FILTER).
can_err_mask_t wanted_errors();
/// What an error frame says of the controller; nothing where it speaks of something else.
std::optional<Controller> controller_of(const can_frame& error_frame);

}  // namespace axisd::can
