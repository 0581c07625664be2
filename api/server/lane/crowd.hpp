// Who goes of those that say nothing when they are too many. Pure.
#pragma once

#include <chrono>
#include <cstddef>
#include <cstdint>
#include <map>
#include <optional>
#include <set>
#include <string>

#include "buses/clock.hpp"

namespace axisd::server::lane {

/// Whoever has just connected cannot be told from whoever never says a word, and may need some milliseconds
/// for his first one. So the newest always gets a place, and the oldest goes: of the network that has most
/// of them, and there of the address that has most. Who floods takes the places of nobody but his
/// neighbours, and theirs only after `most` connections. Thread: one at a time.
class Crowd {
 public:
  using Id = std::uint64_t;
  struct Limits {
    /// 0.1 s for the first word where one computer makes 20,000 connections a second.
    std::size_t most = 2048;
    Duration patience = std::chrono::seconds(3);  ///< with one that says nothing
  };
  struct Origin {
    std::string address, network;  ///< as of Places
  };

  explicit Crowd(Limits limits) : limits_(limits) {}

  /// A new one, whose id is above all that were. The one to close for it, which is to leave then, if any.
  [[nodiscard]] std::optional<Id> enter(Id id, Origin origin, TimePoint now);
  /// It has spoken, or is gone.
  void leave(Id id);
  void clear() { all_.clear(), networks_.clear(); }
  /// One whose time is over.
  [[nodiscard]] std::optional<Id> overdue(TimePoint now) const;
  /// When overdue() has to be asked next; TimePoint::max(): there is nobody.
  [[nodiscard]] TimePoint next_due() const;
  /// Who makes room when there is none for other reasons; nobody: there is nobody.
  [[nodiscard]] std::optional<Id> least_needed() const;
  [[nodiscard]] std::size_t size() const { return all_.size(); }

 private:
  using Ids = std::set<Id>;  ///< the oldest first
  struct One {
    Origin origin;
    TimePoint since{};
  };
  struct Network {
    Ids all;
    std::map<std::string, Ids> by_address{};
  };
  Limits limits_;
  std::map<Id, One> all_;
  std::map<std::string, Network> networks_;
};

}  // namespace axisd::server::lane
