// Who keeps an axis in Stopping (MC_Stop with Execute held): everybody's stop counts (M14).
#pragma once

#include <compare>
#include <cstddef>
#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include "buses/clock.hpp"

namespace axisd {

/// Whose hold it is, and by which request.
struct HoldKey {
  std::string holder;      ///< identity of the client
  std::string request_id;  ///< of its stop; empty: of all its stops without one
  auto operator<=>(const HoldKey&) const = default;
};

struct StopHold {
  HoldKey key;
  WallTime since{};         ///< when the first stop of this key arrived
  bool durable = false;     ///< it outlives a restart of the daemon
  TimePoint renewed{};      ///< when the newest stop of this key arrived
  std::uint64_t stops = 0;  ///< tells one of another that came while it was being released
};

/// Which holds of an axis are to end, and who wants that.
struct HoldRelease {
  enum class Whose : std::uint8_t {
    one,        ///< that of the client with `request_id`
    mine,       ///< all of the client, also those of other programs with its identity
    everybody,  ///< all there are: for whoever may command the axis
  };
  std::string client;
  std::string request_id{};
  Whose whose = Whose::one;
  std::uint64_t lease_token = 0;         ///< under which lease `everybody` is asked for; 0: under none
  TimePoint arrived = TimePoint::max();  ///< a hold that arrived later is not meant
};

/// The holds of one axis. Bounded without ever refusing one: what is beyond a client's share is one hold of
/// that client, what is beyond the number of clients is one hold of them all. Pure. Thread: core.
class StopHolds {
 public:
  static constexpr std::size_t share = 16;    ///< of one client, by name
  static constexpr std::size_t holders = 32;  ///< clients
  /// In the place of a request_id, which has no spaces, so that no name releases it.
  static constexpr std::string_view more_requests = "(several more)";
  /// In the place of a holder.
  static constexpr std::string_view more_clients = "(several more clients)";

  /// Enters a hold, or renews the one that there is. The hold as it stands now, which may stand for more than
  /// that request.
  const StopHold& add(HoldKey key, WallTime since, TimePoint arrived);
  /// From an earlier run of the daemon: durable.
  void restore(HoldKey key, WallTime since);
  /// The hold is (or is not) on the disk. Nothing where it has ended. True: that is news.
  bool set_durable(const HoldKey& key, bool durable);
  /// Those that are meant, as they stand now.
  [[nodiscard]] std::vector<StopHold> meant_by(const HoldRelease& release) const;
  /// Ends a hold unless it was renewed since it was read. False: it was.
  bool end(const StopHold& read);

  /// In the order of their keys.
  [[nodiscard]] const std::vector<StopHold>& all() const { return all_; }
  [[nodiscard]] bool empty() const { return all_.empty(); }

 private:
  [[nodiscard]] StopHold* find(const HoldKey& key);
  [[nodiscard]] HoldKey within_bounds(HoldKey key) const;
  StopHold& insert(HoldKey key, WallTime since);

  std::vector<StopHold> all_;
  std::uint64_t stops_ = 0;
};

/// "hmi-1 (request r7) since 2026-11-24T03:40:02Z, ...": for an error's message.
[[nodiscard]] std::string text_of(const std::vector<StopHold>& holds);

/// What `client` can do so that the axis is held no longer: lines for a shell.
[[nodiscard]] std::string how_to_release(const std::vector<StopHold>& holds, std::string_view axis,
                                         std::string_view client);

}  // namespace axisd
