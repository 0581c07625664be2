// All machines that are known, and what is known of each. Pure.
#pragma once

#include <map>
#include <optional>
#include <set>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "api/cell/kept.pb.h"
#include "api/cell/peer_machine.hpp"
#include "axisd/cell/v1/cell_service.pb.h"
#include "buses/clock.hpp"

namespace axisd::cell {

/// Thread: core.
class Roster {
 public:
  /// How long a machine is told of that is neither registered nor answers; how many there can be.
  static constexpr Duration remembered = std::chrono::hours(24);
  static constexpr std::size_t most = 1024;

  struct Entry {
    Entry(const std::string& name, PeerMachine::Times times, TimePoint now)
        : peer(name, times, now), since(now) {}
    kept::Registration registration;  ///< as last known
    bool registered = false;          ///< in etcd
    bool by_hand = false;             ///< in the configuration; this machine itself
    PeerMachine peer;
    v1::MachineState state = v1::MACHINE_STATE_UNSPECIFIED;
    TimePoint since;  ///< of state
  };
  /// What has changed since the last take_changes().
  struct Change {
    std::string name;
    v1::MachineState from, to;  ///< unspecified: it was not known, is not known any more
  };

  Roster(std::string own, PeerMachine::Times times) : own_(std::move(own)), times_(times) {}

  /// Of the configuration, before anything else.
  void put_by_hand(const kept::Registration& registration, TimePoint now);
  /// Known from an earlier run: whether it is still there is to be seen.
  void put_remembered(const kept::Registration& registration, TimePoint now);
  /// All that are registered in etcd now.
  void set_registered(const std::map<std::string, kept::Registration, std::less<>>& machines, TimePoint now);
  /// What the machine of this entrance is, which is by hand.
  void set_own(const kept::Registration& registration);

  [[nodiscard]] Entry* find(std::string_view name);
  [[nodiscard]] const std::map<std::string, Entry, std::less<>>& entries() const { return entries_; }
  [[nodiscard]] std::map<std::string, Entry, std::less<>>& entries() { return entries_; }

  /// Looks at all of them again; what came of it is in take_changes().
  void look(TimePoint now);
  [[nodiscard]] std::vector<Change> take_changes() { return std::exchange(changes_, {}); }
  /// Names of those that are otherwise than at the last call: also in what is no state.
  [[nodiscard]] std::set<std::string> take_touched() { return std::exchange(touched_, {}); }
  [[nodiscard]] bool is_touched() const { return !touched_.empty(); }
  void touch(const std::string& name) { touched_.insert(name); }

  /// For the contract, and for the disk. `wall`: turns points in time into those of the wall clock.
  [[nodiscard]] v1::Machine machine(const std::string& name, const Clock& clock) const;
  [[nodiscard]] kept::Registry registry() const;

 private:
  [[nodiscard]] Entry* enter(const kept::Registration& registration, TimePoint now);
  [[nodiscard]] static v1::MachineState state_of(const Entry& entry);

  const std::string own_;
  const PeerMachine::Times times_;
  std::map<std::string, Entry, std::less<>> entries_;
  std::vector<Change> changes_;
  std::set<std::string> touched_;
};

/// What the contract's fields of a time are.
void set_time(google::protobuf::Timestamp& to, WallTime time);
void set_duration(google::protobuf::Duration& to, Duration duration);
/// As somebody else says it: cut to 30 years either way, so that any two can be added.
[[nodiscard]] Duration duration_of(const google::protobuf::Duration& from);

}  // namespace axisd::cell
