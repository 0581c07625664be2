// Values and messages as text for people, and as JSON for scripts. Pure.
#pragma once

#include <google/protobuf/duration.pb.h>
#include <google/protobuf/message.h>

#include <cstdint>
#include <string>
#include <string_view>

#include "axisd/v1/types.pb.h"

namespace axisd::axisctl {

/// At most four decimals, no trailing zeros, never "-0". Small values keep three significant digits.
std::string number(double value);
/// "12.5 mm"; the unit may be empty.
std::string with_unit(double value, std::string_view unit);
/// "150 ms", "2.4 s", "3 min 5 s".
std::string duration_text(double seconds);
double seconds(const google::protobuf::Duration& duration);

/// "STATE_DISCRETE_MOTION" -> "DiscreteMotion".
std::string camel_word(std::string_view name, std::string_view prefix);
/// "POSITION_TRUST_HOMED" -> "homed", "REASON_SOFT_LIMIT" -> "soft limit".
std::string lower_word(std::string_view name, std::string_view prefix);

std::string state_text(
    const v1::AxisState& state);  ///< "Standstill"; "Offline" while the node does not answer
std::string command_kind(const v1::Command& command);   ///< "MoveAbsolute"
std::string command_state(const v1::Command& command);  ///< "Active"
bool ended(const v1::Command& command);

/// Granted values that differ from the asked ones: "granted velocity 49.95 mm/s (asked 50 mm/s)"; else empty.
std::string granted_text(const v1::Command& command, std::string_view unit);
/// One line: id, axis, kind, state, granted values, cause, time taken.
std::string command_line(const v1::Command& command, std::string_view unit);

/// "0x0027", a Modbus register; beyond 16 bits, where only CANopen's are, "6041h:00": object and sub-index.
std::string address_text(std::uint32_t address);

/// "5", a number of the maker's list; beyond 8 bits, where CiA 402's are, "8611h"; FFFFh "without a code".
std::string alarm_text(std::uint32_t code);

/// One line of JSON with the names of the proto.
std::string json(const google::protobuf::Message& message);

}  // namespace axisd::axisctl
