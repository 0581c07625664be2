// A frame, or what became of one, as the wire log, traces and flight records show it.
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <string>
#include <string_view>

#include "buses/can/port.hpp"
#include "buses/clock.hpp"
#include "buses/transaction.hpp"

namespace axisd {

/// One line of a trace. Small enough to be copied; owns nothing.
struct TracedFrame {
  enum class Kind : std::uint8_t {
    sent,      ///< `at` its first byte; on CAN when it was handed to the interface
    received,  ///< `at` its first byte; on CAN its end
    not_sent,  ///< not a bit of it reached the wire, nor ever will: `why`
    failed,    ///< of the frame sent last to this node: no sound reply, or never confirmed: `why`
    link,      ///< the state of the CAN link: `why`
  };
  TimePoint at{};
  Kind kind = Kind::sent;
  /// Of what was asked for, or answers it; of a received CAN frame without meaning.
  TransactionClass transaction_class = TransactionClass::parameters;
  std::uint8_t node = 0;    ///< 0: no single one
  bool on_network = false;  ///< a CAN frame: the next four hold
  bool extended = false, remote = false;
  std::uint8_t length = 0;  ///< of the data, also where a remote request has none
  std::uint32_t id = 0;
  std::string_view why{};               ///< "timeout"; static text
  std::span<const std::uint8_t> bytes;  ///< RTU: with its CRC; CAN: the data. Valid during the call

  /// Sets what a CAN frame has. `frame` must outlive this.
  void set(const can::Frame& frame);
  [[nodiscard]] can::Frame frame() const;
};

/// Appends the line that the text format has for it, with its line end; times are CLOCK_MONOTONIC:
///
///   <ns> <bus> tx <hex>             request
///   <ns> <bus> rx <hex>             reply
///   <ns> <bus> -- <why>             no sound reply to the request before: timeout, cut, corrupt, port lost
///   <ns> <bus> -- <hex> not sent: <why>
///
/// and on a CAN network, frames as candump writes them:
///
///   <ns> <bus> tx 605#2B406000...   handed to the interface (the line is written when its fate is known)
///   <ns> <bus> rx 585#...           received
///   <ns> <bus> -- <frame> <why>     not sent; `unknown`, after its tx line: never confirmed
///   <ns> <bus> link <state>         up, down, bus_off, ...
///
/// Lines that begin with # say where a file comes from.
void append_line(std::string& text, std::string_view bus, const TracedFrame& frame);

}  // namespace axisd
