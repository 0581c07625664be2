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

  /// Somebody here wanted it, in `transaction_class`; else it came by itself.
  [[nodiscard]] bool asked_for() const {
    return !on_network || (kind != Kind::received && kind != Kind::link);
  }
  /// Sets what a CAN frame has. `frame` must outlive this.
  void set(const can::Frame& frame);
  [[nodiscard]] can::Frame frame() const;
};

/// Version of the text format; 1 had no classes.
inline constexpr int trace_text_version = 2;

/// Appends the line that the text format has for it, with its line end; times are CLOCK_MONOTONIC, @<class>
/// is the class of the transaction (stop, motion, moving_state, idle_state, parameters, scan):
///
///   <ns> <bus> tx <hex> @<class>    request
///   <ns> <bus> rx <hex> @<class>    reply
///   <ns> <bus> -- <why> @<class>    no sound reply to the request before: timeout, cut, corrupt, port lost
///   <ns> <bus> -- <hex> not sent: <why> @<class>
///
/// and on a CAN network, frames as candump writes them:
///
///   <ns> <bus> tx 605#2B406000... @<class>  handed to the interface (written when its fate is known)
///   <ns> <bus> rx 585#...                   received
///   <ns> <bus> -- <frame> <why> @<class>    not sent; `unknown`, after its tx line: never confirmed
///   <ns> <bus> link <state>                 up, down, bus_off, ...
///
/// Lines that begin with # say where a file comes from, and the version of the format.
void append_line(std::string& text, std::string_view bus, const TracedFrame& frame);

}  // namespace axisd
