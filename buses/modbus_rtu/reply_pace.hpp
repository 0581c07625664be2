#pragma once

#include <array>
#include <cstdint>

#include "buses/clock.hpp"

namespace axisd::modbus_rtu {

/// How soon nodes have answered, and so which part of the wait for a reply can be slept through: a terminal
/// hands a reply over in pieces, and each would wake the thread for nothing. Keeps to the soonest of the last
/// replies; where a sleep was too long, the next ones are measured without. Most sleeps end when the soonest
/// reply would be complete: then one that is about as soon costs one waking, and not a second one for its
/// last piece. Pure.
class ReplyPace {
 public:
  /// Woken so long before the reply is expected to be complete, where its time is checked: more than the
  /// waking takes.
  static constexpr Duration margin = std::chrono::microseconds(150);
  /// One of so many sleeps ends soon enough to see when the reply is complete.
  static constexpr int check_every = 8;
  /// Replies that are measured without a sleep, at first and after one that was too long.
  static constexpr int measured = 3;
  /// Replies after which a node that has become slower is taken for that.
  static constexpr int remembered = 64;

  /// From the end of the request until about when its reply, `on_wire` long, can be complete; zero where too
  /// little is known.
  [[nodiscard]] Duration quiet(std::uint8_t node, Duration on_wire) const;
  /// The reply was complete `took` after the end of the request. `awaited`: not yet when quiet() had passed.
  void complete(std::uint8_t node, Duration on_wire, Duration took, bool awaited);
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
    int unchecked = 0;  ///< sleeps since one was checked
  };
  std::array<Pace, 256> nodes_{};
};

}  // namespace axisd::modbus_rtu
