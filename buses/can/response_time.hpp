// Worst-case response times on CAN: R. I. Davis, A. Burns, R. J. Bril, J. J. Lukkien: Controller Area Network
// (CAN) schedulability analysis: Refuted, revisited and revised, Real-Time Systems 35 (2007), 239-272. Pure.
#pragma once

#include <cstdint>
#include <optional>
#include <span>

#include "buses/clock.hpp"

namespace axisd::can {

/// One message as the analysis sees it.
struct Stream {
  std::uint32_t id = 0;  ///< the lower, the more urgent
  Duration transmission{};
  Duration period{};  ///< least time between two of them, but for `jitter`; Duration::max(): there is one
  Duration jitter{};  ///< of the queuing, behind the event that it belongs to
};

/// Time of a data frame with an 11-bit identifier, with all stuff bits and the interframe space. bitrate > 0.
Duration frame_time(int data_bytes, std::uint32_t bitrate);

/// From the event to the end of the frame, for the worst instance of `all[index]` (section 3.2, equations 10
/// to 16: blocking, the length of the busy period, each instance in it). A bound that has no end within
/// `limit` is none. `all` has no id twice.
std::optional<Duration> response_time(std::span<const Stream> all, std::size_t index, std::uint32_t bitrate,
                                      Duration limit);

/// The same for a frame that goes out of a queue in order of arrival, behind frames of other identifiers that
/// take `ahead`: the urgency of all is that of the least urgent. `others`: what is sent by others and may win
/// against that one. `blocking`: longest frame that may just have begun.
std::optional<Duration> queue_response_time(std::span<const Stream> others, Duration ahead, Duration own,
                                            Duration blocking, std::uint32_t bitrate, Duration limit);

}  // namespace axisd::can
