// What goes wrong on a simulated line, and when: deterministic, by counting the requests that match.
#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "buses/clock.hpp"
#include "buses/error.hpp"

namespace axisd::simulation {

enum class FaultKind : std::uint8_t {
  drop_request,     ///< the node never sees the request
  corrupt_request,  ///< one bit of the request is wrong when it reaches the node
  drop_reply,       ///< the node executes the request, its reply is lost
  delay_reply,      ///< the reply comes `delay` later
  corrupt_reply,    ///< one bit of the reply is wrong
  truncate_reply,   ///< the last byte of the reply is missing
  echo,             ///< the adapter returns the request before the reply
  drip,             ///< the bytes of the reply come `delay` apart
  foreign_frame,    ///< `bytes` come before the reply (default: a sound reply of node 247)
  hang_up,          ///< the adapter is pulled out instead of passing the request on
  reboot_before,    ///< the supply fails for `delay` just before the request arrives
  reboot_after,     ///< the request is executed, then the supply fails for `delay`; the reply is lost
};

std::string_view to_string(FaultKind kind);
std::optional<FaultKind> fault_kind(std::string_view name);

/// One fault and the requests it strikes. Unset filters match everything.
struct Fault {
  FaultKind kind = FaultKind::drop_reply;
  std::optional<std::uint8_t> node{};
  std::optional<std::uint8_t> function{};
  std::optional<std::uint16_t> register_address{};  ///< any register of the request
  int skip = 0;                                     ///< matching requests that pass unharmed first
  int count = 1;                                    ///< requests that it strikes; negative: until cleared
  Duration delay{};
  std::vector<std::uint8_t> bytes{};
};

/// "drop_reply node=1 function=6 register=0x0027 count=1 skip=0 delay_ms=5 bytes=0103...". Error: what is
/// wrong.
Result<Fault> parse_fault(std::string_view text);

/// The faults that still wait for their requests. Thread: that of its line.
class FaultPlan {
 public:
  void add(Fault fault);
  void clear() { faults_.clear(); }
  [[nodiscard]] std::size_t pending() const { return faults_.size(); }
  /// The faults that strike `request` (a sound frame); counts it.
  std::vector<Fault> strike(std::span<const std::uint8_t> request);

 private:
  std::vector<Fault> faults_;
};

}  // namespace axisd::simulation
