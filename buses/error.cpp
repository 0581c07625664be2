#include "buses/error.hpp"

#include <fmt/format.h>

#include <array>
#include <utility>

namespace axisd {

std::string_view to_string(Reason reason) {
  static constexpr auto names = std::to_array<std::string_view>({"invalid_argument",
                                                                 "out_of_range",
                                                                 "unknown_axis",
                                                                 "unknown_command",
                                                                 "not_supported",
                                                                 "offline",
                                                                 "configuring",
                                                                 "wrong_model",
                                                                 "misconfigured",
                                                                 "disabled",
                                                                 "fault",
                                                                 "stopping",
                                                                 "moving",
                                                                 "inhibited",
                                                                 "not_trusted",
                                                                 "soft_limit",
                                                                 "limit_switch",
                                                                 "terminal",
                                                                 "alarm",
                                                                 "did_not_start",
                                                                 "not_reached",
                                                                 "took_too_long",
                                                                 "not_confirmed",
                                                                 "rebooted",
                                                                 "superseded",
                                                                 "expired",
                                                                 "lease_lost",
                                                                 "lease_required",
                                                                 "request_id_conflict",
                                                                 "busy",
                                                                 "refused",
                                                                 "no_reply",
                                                                 "bus_down",
                                                                 "storage",
                                                                 "cancelled",
                                                                 "internal",
                                                                 "reloading",
                                                                 "eeprom_budget",
                                                                 "state_unaccepted",
                                                                 "access_denied",
                                                                 "unauthenticated"});
  static_assert(names.size() == std::to_underlying(last_reason) + 1U);
  return names.at(std::to_underlying(reason));
}

std::string object_text(std::uint32_t object) {
  if (object <= 0xFFFF) return fmt::format("register 0x{:04X}", object);
  return fmt::format("object {:04X}h:{:02X}", object >> 8U, object & 0xFFU);
}

std::string to_string(const Error& error) {
  std::string text;
  if (!error.where.bus.empty()) text += error.where.bus;
  if (error.where.node) text += fmt::format("{}node {}", text.empty() ? "" : " ", *error.where.node);
  if (error.where.object) text += " " + object_text(*error.where.object);
  if (!text.empty()) text += ": ";
  text += error.message.empty() ? std::string(to_string(error.reason)) : error.message;
  if (error.permitted)
    text += fmt::format(" (permitted {} to {}{}{})", error.permitted->minimum, error.permitted->maximum,
                        error.permitted->unit.empty() ? "" : " ", error.permitted->unit);
  if (!error.remedy.empty()) text += "; " + error.remedy;
  return text;
}

}  // namespace axisd
