// Network management: commands to single nodes, boot-up and heartbeat consumer (CiA 301 7.2.8).
#pragma once

#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <string_view>
#include <utility>

#include "buses/can/port.hpp"
#include "buses/canopen/object.hpp"
#include "buses/clock.hpp"

namespace axisd::canopen {

/// Command specifiers of the NMT services.
enum class NmtCommand : std::uint8_t {
  start = 0x01,
  stop = 0x02,
  enter_pre_operational = 0x80,
  reset_node = 0x81,           ///< only on explicit request (M25)
  reset_communication = 0x82,  ///< only on explicit request (M25)
};
std::string_view to_string(NmtCommand command);

/// The command frame. Node 0 (everybody) is refused: others may share the wire (M25).
Result<can::Frame> nmt_frame(NmtCommand command, std::uint8_t node);

enum class NmtState : std::uint8_t { unknown, stopped, operational, pre_operational };
std::string_view to_string(NmtState state);

/// What a frame with a heartbeat identifier says.
struct Heartbeat {
  bool boot_up = false;
  NmtState state = NmtState::unknown;  ///< after boot-up pre-operational: the node goes there by itself
};
/// Nothing: not one byte, a remote request, or a state that CiA 301 does not know. Bit 7 (the toggle bit of
/// node guarding) is ignored.
std::optional<Heartbeat> parse_heartbeat(const can::Frame& frame);

struct NodeEvent {
  enum class Kind : std::uint8_t {
    booted,           ///< boot-up message: the node has forgotten its RAM. `from` tells what it was before.
    state_changed,    ///< the heartbeat reports another state
    heartbeat_lost,   ///< no heartbeat for the node's timeout
    heartbeat_again,  ///< after it was lost
  };
  Kind kind = Kind::booted;
  std::uint8_t node = 0;
  NmtState from = NmtState::unknown, to = NmtState::unknown;
  bool requested = false;  ///< `booted`: after a reset that expect_boot() announced
  TimePoint at{};
};

/// State of every node by what it says itself. Pure but for its clock. Thread: core.
///
///   unknown --heartbeat--> reported state      any --boot-up--> pre_operational (event: booted)
///   any --no heartbeat for the timeout--> unknown (heartbeat_lost) --heartbeat--> reported state
///
/// A heartbeat is awaited from the first one that came (as CiA 301 1016h says of consumers): a node that
/// sends none is never lost by this.
class NmtMonitor {
 public:
  using Handler = std::function<void(const NodeEvent&)>;
  struct NodeStatus {
    NmtState state = NmtState::unknown;
    std::optional<TimePoint> last_heard;  ///< last boot-up or heartbeat
    bool heartbeat_lost = false;
    std::uint64_t boots = 0, heartbeats = 0;
  };

  NmtMonitor(Clock& clock, Handler handler) : clock_(&clock), handler_(std::move(handler)) {}

  /// Longest time between two heartbeats of `node`, from now on; 0: not watched. Should be at least 1.5 times
  /// what 1017h says.
  void watch(std::uint8_t node, Duration timeout);
  void on_heartbeat(std::uint8_t node, const Heartbeat& heartbeat, TimePoint at);
  /// A reset is being sent on purpose (or was not, after all): the next boot-up of `node` is `requested`.
  void expect_boot(std::uint8_t node, bool expected);
  /// The link is gone: what nodes do is unknown, and their silence says nothing.
  void forget_states();
  [[nodiscard]] NodeStatus status(std::uint8_t node) const;

 private:
  struct Node {
    NodeStatus status;
    Duration timeout{};
    bool boot_expected = false;
    Clock::Timer timer;
  };
  void arm(std::uint8_t id, Node& node);
  void on_timer(std::uint8_t id, Node& node);

  Clock* clock_;
  Handler handler_;
  std::map<std::uint8_t, std::unique_ptr<Node>> nodes_;
};

}  // namespace axisd::canopen
