// Who may keep a connection to the stop lane when more want one than there is room for. Pure.
#pragma once

#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <utility>

#include "buses/clock.hpp"

namespace axisd::server::lane {

/// The newest connection always gets a place: whoever wants to stop connects now. What makes room is a
/// stranger (not identified yet) from an address that has too many of them, or from the network with most,
/// one that has not begun to identify itself before one that has; or a connection of the identity with most
/// of them: first one on which nothing was ever asked, then the one that is idle for longest. So an identity
/// with one connection loses it last of all, and nobody takes another's place by opening many. Thread: one at
/// a time.
class Places {
 public:
  using Id = std::uint64_t;
  struct Limits {
    int connections = 128;  ///< in all
    int strangers = 32;     ///< of them, not identified yet
    int strangers_per_address = 8;
    int per_identity = 16;
    int local = 96;  ///< in place of it without TLS, where all clients of a computer have one identity
    Duration introduction = std::chrono::seconds(3);  ///< time for a stranger to identify himself
  };

  explicit Places(Limits limits) : limits_(limits) {}

  /// Where a stranger comes from. One computer may have all addresses of its network, but as a rule has one.
  struct Origin {
    std::string address, network;
  };

  /// A new connection, which nobody has identified yet. The connection to close for it, if any.
  [[nodiscard]] std::optional<Id> enter(Id id, Origin origin, TimePoint now);
  /// It is this client's; `local`: of whoever is on this computer. The connection to close for it, if any.
  [[nodiscard]] std::optional<Id> identify(Id id, const std::string& identity, bool local, TimePoint now);
  /// It carried a complete request.
  void asked(Id id) { all_.at(id).asked = true; }
  /// It has begun to identify itself.
  void greeted(Id id) { all_.at(id).greeted = true; }
  /// It carried something. `waiting`: calls on it that wait for their answers; such a one goes last.
  void used(Id id, TimePoint now, int waiting);
  void leave(Id id) { all_.erase(id); }
  void clear() { all_.clear(); }
  /// A stranger whose time is over.
  [[nodiscard]] std::optional<Id> overdue(TimePoint now) const;
  /// When overdue() has to be asked next; TimePoint::max(): there is no stranger.
  [[nodiscard]] TimePoint next_due() const;
  /// Who makes room when there is none for other reasons; nobody: there is no connection.
  [[nodiscard]] std::optional<Id> least_needed() const;
  [[nodiscard]] std::size_t size() const { return all_.size(); }

 private:
  struct Place {
    std::string address, network, identity;
    bool known = false, greeted = false, asked = false;
    TimePoint since{}, used{};
    int waiting = 0;
  };
  using Entry = std::pair<const Id, Place>;
  template <class Of>
  [[nodiscard]] std::map<std::string, int> count(bool known, Of of) const;
  template <class May>
  [[nodiscard]] std::optional<Id> least_of_strangers(Id but, May may) const;
  [[nodiscard]] std::optional<Id> oldest_stranger() const;
  [[nodiscard]] std::optional<Id> idlest(const std::string& identity, Id but) const;

  Limits limits_;
  std::map<Id, Place> all_;
};

}  // namespace axisd::server::lane
