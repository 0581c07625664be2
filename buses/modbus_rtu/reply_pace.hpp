#pragma once

#include <array>
#include <cstdint>

#include "buses/clock.hpp"

namespace axisd::modbus_rtu {

/// How a reply was met that took part of the wait in sleep, if it did.
enum class Met : std::uint8_t {
  awake,    ///< the wait was not slept through
  awaited,  ///< at the end of the sleep, part of it or all was still to come
  ready,    ///< at the end of the sleep, all of it lay there, nobody knows since when
};

/// How soon nodes have answered, and so which part of the wait for a reply can be slept through: a terminal
/// hands a reply over in pieces, and each would wake the thread for nothing. Of a line's replies one in three
/// is to lie ready when the sleep ends: to read it takes one wake, where to wait for the rest of it takes
/// two. How long after the soonest reply of its node that is depends on how late the thread wakes, and is
/// learnt from all nodes together. Pure.
class ReplyPace {
 public:
  /// Replies that are measured without a sleep, at first.
  static constexpr int measured = 3;
  /// After so many in a row that lay ready one is measured without a sleep: the node may have become faster.
  static constexpr int suspicious = 8;
  /// Replies after which a node that has become slower is taken for that, if none came as soon as before;
  static constexpr int remembered = 64;
  /// of one that lay ready later than this nobody knows: the thread was woken late.
  static constexpr Duration on_time = std::chrono::microseconds(200);
  /// The sleep ends so long after the soonest reply of its node would be complete: at first; so much sooner
  /// after one that lay ready, and so much later after one that did not;
  static constexpr Duration at_first = -std::chrono::microseconds(20);
  static constexpr Duration sooner = std::chrono::nanoseconds(500), later = std::chrono::nanoseconds(250);
  /// within these: as much before it as a thread wakes late, and little after it, which is lost on some
  /// replies of a node that answers irregularly.
  static constexpr Duration earliest = -std::chrono::microseconds(100);
  static constexpr Duration latest = std::chrono::microseconds(20);
  /// After a longer sleep a thread wakes late, by a clock or by bytes; not so where pieces of the reply have
  /// woken it before: so much of it, at the most, is waited for awake.
  static constexpr Duration long_wait = std::chrono::milliseconds(10);
  static constexpr Duration awake_after_long = std::chrono::milliseconds(4);

  /// How long to sleep from the end of the request to `node`, if its reply is `on_wire` long; zero where too
  /// little is known.
  [[nodiscard]] Duration quiet(std::uint8_t node, Duration on_wire) const;
  /// The reply was complete `took` after the end of the request.
  void complete(std::uint8_t node, Duration on_wire, Duration took, Met met);
  /// No reply came: what answers next may be another drive.
  void forget(std::uint8_t node) { nodes_.at(node) = {}; }

 private:
  /// From the end of the request to the start of the reply; less than nothing where bytes take no time on the
  /// way, as between two ends of a pty.
  struct Pace {
    Duration soonest = Duration::max();
    Duration soonest_lately = Duration::max();  ///< of the last `lately` replies
    int lately = 0;
    int ready_in_a_row = 0;
    int to_measure = measured;
  };
  std::array<Pace, 256> nodes_{};
  Duration after_ = at_first;
};

}  // namespace axisd::modbus_rtu
