// Emergency messages: consumer with a bounded history per node (CiA 301 7.2.7).
#pragma once

#include <array>
#include <deque>
#include <map>
#include <optional>
#include <string_view>

#include "buses/can/port.hpp"
#include "buses/clock.hpp"

namespace axisd::canopen {

struct Emergency {
  std::uint8_t node = 0;
  std::uint16_t code = 0;                ///< 0000h: an error was reset, or none is left
  std::uint8_t error_register = 0;       ///< object 1001h
  std::array<std::uint8_t, 5> vendor{};  ///< as the manufacturer defines it
  TimePoint at{};
  [[nodiscard]] bool is_reset() const { return code < 0x0100; }
};
/// Nothing: not 8 bytes, or a remote request.
std::optional<Emergency> parse_emergency(std::uint8_t node, const can::Frame& frame, TimePoint at);
/// What CiA 301 table 26 says of the code's class; codes of a drive's own are explained by its model.
std::string_view emergency_text(std::uint16_t code);

/// What each node reported last. Pure. Thread: core.
class EmergencyHistory {
 public:
  explicit EmergencyHistory(std::size_t capacity = 32) : capacity_(capacity) {}
  void add(const Emergency& emergency);
  /// Oldest first; the oldest are forgotten.
  [[nodiscard]] const std::deque<Emergency>& of(std::uint8_t node) const;
  /// The last message that was no reset, if no reset to "no error" (register 0) came since.
  [[nodiscard]] std::optional<Emergency> active(std::uint8_t node) const;
  [[nodiscard]] std::uint64_t total(std::uint8_t node) const;
  /// The node booted: nothing is active, the history stays.
  void on_boot(std::uint8_t node);

 private:
  struct Node {
    std::deque<Emergency> history;
    std::optional<Emergency> active;
    std::uint64_t total = 0;
  };
  [[nodiscard]] const Node* find(std::uint8_t node) const;

  std::size_t capacity_;
  std::map<std::uint8_t, Node> nodes_;
};

}  // namespace axisd::canopen
