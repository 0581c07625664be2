// The one error type of axisd. An error says what went wrong, where on which bus, and what to do about it.
#pragma once

#include <cstdint>
#include <expected>
#include <optional>
#include <string>
#include <string_view>

namespace axisd {

/// Why something failed. Each reason fixes the caller's policy; api/server/status.cpp maps it to a gRPC
/// status, proto/axisd/v1/error.proto documents it for clients. The list never grows with a drive model.
enum class Reason : std::uint8_t {
  invalid_argument,  ///< The request is malformed. Fix it; repeating it is pointless.
  out_of_range,      ///< A value the drive or the limits forbid; `permitted` holds the range.
  unknown_axis,      ///< No axis of that name in the configuration.
  unknown_command,   ///< No command with that id (any more).
  not_supported,     ///< The model or this build lacks the function (a capability, not a fault).
  offline,         ///< The node or its port does not answer. Check power and wiring; it is retried by itself.
  configuring,     ///< Identity and configuration are not yet verified in this power cycle. Wait.
  wrong_model,     ///< Another model answers at this address than the configuration names.
  misconfigured,   ///< The drive refused or lost a configured value.
  disabled,        ///< The power stage is off. Enable the axis first.
  fault,           ///< The axis is in ErrorStop. Clear the cause, then Reset.
  stopping,        ///< A stop is being executed or held. Wait, or ReleaseStop.
  moving,          ///< Not possible while the axis moves.
  inhibited,       ///< StopAll holds the machine. Release it explicitly.
  not_trusted,     ///< The position is unknown. Home the axis or set its position.
  soft_limit,      ///< The target lies beyond a software limit; `permitted` holds the range.
  limit_switch,    ///< A limit terminal ended or forbids the motion.
  terminal,        ///< A terminal of the drive started, changed or ended the motion.
  alarm,           ///< The drive reports an alarm; `native_code` is its code.
  did_not_start,   ///< The drive accepted a start but never moved.
  not_reached,     ///< The drive stopped, but not at the target.
  took_too_long,   ///< The motion ran longer than predicted and was stopped.
  not_confirmed,   ///< A stop was sent, but standstill was not confirmed.
  rebooted,        ///< The drive lost its memory (power cycle). Nothing resumes by itself.
  superseded,      ///< A newer command, stop or loss of link took its place. Nothing was sent after that.
  expired,         ///< `not_after` or a deadline passed before the frame could be sent.
  lease_lost,      ///< The lease that the command was given under is gone.
  lease_required,  ///< The axis is leased (or must be) and the token does not fit.
  request_id_conflict,  ///< The request_id was used before for other content.
  busy,                 ///< Too many requests in progress. Retry later.
  refused,              ///< The drive answered with an exception or abort; `native_code` is its code.
  no_reply,             ///< A frame was sent and no valid reply came. Whether it was executed is unknown.
  bus_down,             ///< The port cannot be opened or was lost.
  storage,              ///< The state directory cannot be written.
  cancelled,            ///< Ended by CancelCommand or by the daemon's shutdown.
  internal,             ///< A bug of axisd.
  reloading,            ///< The configuration of the axis is being reloaded. Repeat it in a moment.
  eeprom_budget,        ///< It would wear the drive's EEPROM beyond `limits.eeprom_saves_per_day`.
  state_unaccepted,     ///< Files of the state are not what they were. Look at the machine, then accept it.
  access_denied,        ///< The client lacks the role that this needs.
  unauthenticated,      ///< The client's certificate has expired or was revoked. Connect with a good one.
};
/// The last one of the list, for whoever goes through all of it.
inline constexpr Reason last_reason = Reason::unauthenticated;

std::string_view to_string(Reason reason);

/// What is known about a request that did not succeed.
enum class Outcome : std::uint8_t {
  not_sent,      ///< Rejected before the wire: nothing happened.
  refused,       ///< The drive answered with an exception: not executed.
  not_executed,  ///< Failed, and known not to have been executed.
  unknown,       ///< Sent without a reply: it may have been executed.
};

/// Where an error happened; unset parts do not apply.
struct Address {
  std::string bus;                           ///< name of the bus in the YAML
  std::optional<std::uint8_t> node;          ///< Modbus unit or CANopen node-ID
  std::optional<std::uint32_t> object;       ///< Modbus register, or CANopen index << 8 | sub-index
  std::optional<std::uint32_t> native_code;  ///< drive alarm, Modbus exception, SDO abort, errno
};

/// Permitted range in the unit that the request used.
struct Range {
  double minimum = 0;
  double maximum = 0;
  std::string unit;
};

struct Error {
  Reason reason = Reason::internal;
  std::string message;  ///< one line: what happened, with values
  std::string remedy;   ///< one line: what to do
  Outcome outcome = Outcome::not_sent;
  Address where{};
  std::optional<Range> permitted{};
};

/// "register 0x0027"; beyond 16 bits, where only CANopen's are, "object 6041h:00".
std::string object_text(std::uint32_t object);
/// "line-a node 3 register 0x0027: drive refused: value out of range (exception 07); check the value".
std::string to_string(const Error& error);

template <class T>
using Result = std::expected<T, Error>;

inline std::unexpected<Error> fail(Reason reason, std::string message, std::string remedy = {}) {
  return std::unexpected(Error{.reason = reason, .message = std::move(message), .remedy = std::move(remedy)});
}
inline std::unexpected<Error> fail(Error error) { return std::unexpected(std::move(error)); }

}  // namespace axisd
