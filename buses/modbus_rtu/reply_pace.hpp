#pragma once

#include <array>
#include <cstdint>
#include <optional>

#include "buses/clock.hpp"

namespace axisd::modbus_rtu {

/// How soon nodes have answered, and so which part of the wait for a reply can be slept through: a terminal
/// hands a reply over in pieces, and each would wake the thread for nothing. Keeps to the soonest of the last
/// replies, and to a moment before it: a thread that waits for bytes is woken by them sooner than one that
/// sleeps until they must be there. Pure.
class ReplyPace {
 public:
  /// Woken so long before the soonest reply would be complete.
  static constexpr Duration margin = std::chrono::microseconds(20);
  /// Replies that are measured without a sleep, at first.
  static constexpr int measured = 3;
  /// A reply that is complete so soon after the sleep may have lain ready before, nobody knows for how long;
  static constexpr Duration prompt = std::chrono::microseconds(10);
  /// after so many of them in a row one is measured without a sleep.
  static constexpr int suspicious = 4;
  /// Replies after which a node that has become slower is taken for that, and one is measured in any case:
  /// where it takes long from the end of a sleep to reading what lies ready, that looks like a reply that was
  /// waited for.
  static constexpr int remembered = 64;

  /// From the end of the request until about when its reply, `on_wire` long, can be complete; zero where too
  /// little is known.
  [[nodiscard]] Duration quiet(std::uint8_t node, Duration on_wire) const;
  /// The reply was complete `took` after the end of the request. `slept`: nobody looked before that.
  void complete(std::uint8_t node, Duration on_wire, Duration took, std::optional<Duration> slept);
  /// No reply came: what answers next may be another drive.
  void forget(std::uint8_t node) { nodes_.at(node) = {}; }

 private:
  /// From the end of the request to the start of the reply; less than nothing where bytes take no time on the
  /// way, as between two ends of a pty.
  struct Pace {
    Duration soonest = Duration::max();
    Duration soonest_lately = Duration::max();  ///< of the last `lately` replies
    int lately = 0;
    int to_measure = measured;
    int prompt_in_a_row = 0;
  };
  std::array<Pace, 256> nodes_{};
};

}  // namespace axisd::modbus_rtu
