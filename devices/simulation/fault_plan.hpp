// What goes wrong on a simulated line or network, and when: deterministic, by counting the requests that
// match.
#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "buses/can/port.hpp"
#include "buses/clock.hpp"
#include "buses/error.hpp"

namespace axisd::simulation {

enum class FaultKind : std::uint8_t {
  drop_request,       ///< the node never sees the request
  corrupt_request,    ///< one bit of the request is wrong when it reaches the node
  drop_reply,         ///< the node executes the request, its reply is lost
  delay_reply,        ///< the reply comes `delay` later
  corrupt_reply,      ///< one bit of the reply is wrong
  truncate_reply,     ///< the last byte of the reply is missing
  echo,               ///< the adapter returns the request before the reply
  drip,               ///< the bytes of the reply come `delay` apart
  duplicate_request,  ///< the node hears the request twice, one right after the other
  duplicate_reply,    ///< the reply comes again, `delay` after its end
  foreign_frame,      ///< `bytes` come before the reply (default: a sound reply of node 247)
  hang_up,            ///< the adapter is pulled out instead of passing the request on
  reboot_before,      ///< the supply fails for `delay` just before the request arrives
  reboot_after,       ///< the request is executed, then the supply fails for `delay`; the reply is lost
  // On CAN only. `silence` to `reboot` strike at once, unless `cob`, `object` or `skip` names a frame.
  abort,           ///< an SDO request is not executed but aborted with `code` (default 08000000h)
  wrong_toggle,    ///< an upload is answered in segments with a wrong toggle bit
  endless_upload,  ///< an upload is answered in segments without end
  silence,         ///< the node neither hears nor sends for `delay`; 0: until cleared
  flood,           ///< the node sends frames with `cob` (default 180h + node) at full rate for `delay`
  emcy,            ///< the node sends EMCY `code` (default 1000h); `bytes`: error register and the vendor's
  reboot,          ///< the supply fails for `delay`
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
  // On CAN, in place of function and register:
  std::optional<std::uint16_t> cob{};     ///< identifier of the frame
  std::optional<std::uint16_t> object{};  ///< index of an SDO request
  std::optional<std::uint32_t> code{};

  /// No frame is waited for.
  [[nodiscard]] bool strikes_at_once() const;
};

/// "drop_reply node=1 function=6 register=0x0027 count=1 skip=0 delay_ms=5 bytes=0103...". Error: what is
/// wrong, or of no use on an RS-485 line.
Result<Fault> parse_fault(std::string_view text);
/// "abort node=1 object=0x6040 code=0x06090030 count=1 skip=0": likewise on a CAN network, with cob=, object=
/// and code= instead of function= and register=.
Result<Fault> parse_can_fault(std::string_view text);

/// The faults that still wait for their requests. Thread: that of its line.
class FaultPlan {
 public:
  void add(Fault fault);
  void clear() { faults_.clear(); }
  [[nodiscard]] std::size_t pending() const { return faults_.size(); }
  /// The faults that strike `request` (a sound frame); counts it.
  std::vector<Fault> strike(std::span<const std::uint8_t> request);
  /// The faults that strike `frame` on its way to `node`: its SDO requests, the RPDOs of the predefined
  /// connection set, NMT, SYNC. Counts it once per node.
  std::vector<Fault> strike(std::uint8_t node, const can::Frame& frame);

 private:
  template <class Matches>
  std::vector<Fault> strike_if(Matches matches);

  std::vector<Fault> faults_;
};

}  // namespace axisd::simulation
