// Traced frames in the formats of other tools. Pure.
#pragma once

#include <string>
#include <string_view>

#include "axisd/v1/bus_service.pb.h"

namespace axisd::axisctl {

enum class TraceFormat : std::uint8_t {
  text,     ///< the daemon's own (README, wire log)
  candump,  ///< `candump -L`, which canplayer reads: CAN only, frames that were on the network
  pcap,     ///< libpcap's file format with nanoseconds, frames that were on the wire
};

/// Whether it was on the wire, as far as is known.
bool on_wire(const v1::TracedFrame& frame);
/// "(1436509053.850870) can0 605#4041600000000000", without line end. Precondition: a CAN frame.
std::string candump_line(const v1::TracedFrame& frame, std::string_view interface);
/// Begins a pcap file: link type CAN_SOCKETCAN (227), or USER0 (147) for Modbus RTU frames, of which libpcap
/// has no type of its own.
std::string pcap_header(bool network);
/// One packet: an RTU frame with its CRC, or a CAN frame as SocketCAN has it, with a big-endian identifier.
std::string pcap_packet(const v1::TracedFrame& frame);

}  // namespace axisd::axisctl
