#pragma once

#include <chrono>
#include <cstdint>
#include <optional>

#include "buses/clock.hpp"
#include "buses/modbus_rtu/node_table.hpp"

namespace axisd::modbus_rtu {

/// Requests in vain in a row that put a node into quarantine; one is enough for a node that never answered.
inline constexpr int quarantine_after = 3;
/// Of the time of its line, a node in quarantine may cost the others one part in so many (2 %).
inline constexpr int quarantine_share = 50;
/// Longest wait between two probes, where that costs the line no more than one part in so many (4 %) for all
/// such nodes together: a drive that is switched on again is to be found soon also where a wait for a silent
/// one takes long.
inline constexpr Duration quarantine_longest_hold = std::chrono::seconds(2);
inline constexpr int quarantine_common_share = 25;
/// A drive to which a stop is owed may be turning its motor: it is probed so often that this costs the line
/// no more than one part in so many (12.5 %) for all such nodes together, or what each costs as any other,
/// for so long after the first of its stops was lost. Whoever is gone for good then costs as little as any
/// other.
inline constexpr int quarantine_owed_share = 8;
inline constexpr Duration quarantine_owed_time = std::chrono::seconds(30);
/// First wait between two probes; it doubles up to what the share demands.
inline constexpr Duration quarantine_first_hold = std::chrono::milliseconds(100);
/// Replies in a row that end the suspicion: until then one more request in vain is enough.
inline constexpr int quarantine_trust_after = 4;

/// What a node did not answer.
enum class Unanswered : std::uint8_t {
  request,
  stop,       ///< one that does not wait for its turn
  owed_stop,  ///< one that is repeated until it comes through, and waits for its turn
};

/// Holds requests to nodes that do not answer back, so that waiting for them costs their neighbours a bounded
/// share of the line. Stops are never held (M15), but for the repetitions of one that is owed. Pure.
class Quarantine {
 public:
  struct Node {
    int silent = 0;             ///< requests in vain in a row
    int level = 0;              ///< 0: trusted; else how often the wait was doubled, plus 1
    int good = 0;               ///< replies in a row
    TimePoint next{};           ///< not before
    TimePoint since{};          ///< when it was put into quarantine, if it is there
    std::uint64_t probes = 0;   ///< requests in vain since then
    std::uint64_t entered = 0;  ///< times that it was put there; kept by forget()
    bool answered_once = false;
    bool stop_in_vain = false;              ///< a stop was not answered, and nothing was since
    std::optional<TimePoint> owed_since{};  ///< the first of these stops was lost then
    [[nodiscard]] bool quarantined() const { return level > 0 && silent > 0; }
  };

  /// A request ended in vain at `now`, after the line was kept from others for `cost`.
  void silent(std::uint8_t node, TimePoint now, Duration cost, Unanswered what);
  void answered(std::uint8_t node);
  /// The port was lost, or is there again: everybody is trusted once more.
  void forget();
  /// No request but a new stop before this.
  [[nodiscard]] TimePoint ready_at(std::uint8_t node) const;
  /// A stop to it is less likely to be heard than one to another: it did not answer the last, or is in
  /// quarantine.
  [[nodiscard]] bool doubtful(std::uint8_t node) const;
  /// By address; only those that were asked something.
  [[nodiscard]] const NodeTable<Node>& nodes() const { return nodes_; }

 private:
  [[nodiscard]] Duration longest_hold(Duration cost) const;
  [[nodiscard]] Duration longest_owed_hold(TimePoint now, Duration cost) const;

  NodeTable<Node> nodes_;
};

}  // namespace axisd::modbus_rtu
