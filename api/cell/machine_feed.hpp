#pragma once

#include <cstdint>
#include <map>
#include <memory>
#include <optional>
#include <set>
#include <string>

#include "api/cell/core_stream.hpp"
#include "api/cell/machines.hpp"

namespace axisd::cell {

/// Who watches the machines, and gets those that have changed. Thread: core.
class MachineFeed {
 public:
  /// `machines` outlives this.
  explicit MachineFeed(const Machines& machines) : machines_(machines) {}

  /// These are otherwise than before, or known no more.
  void touched(const std::set<std::string>& names) {
    ++changes_;
    for (const auto& name : names) changed_at_[name] = changes_;
    watchers_.poke();
  }
  void watch(const std::shared_ptr<CoreStream<v1::WatchMachinesResponse>>& stream) {
    watchers_.add(stream);
    stream->serve([this, seen = std::optional<std::uint64_t>()]() mutable { return after(seen); });
  }
  void finish(const grpc::Status& status) { watchers_.finish(status); }

 private:
  std::optional<v1::WatchMachinesResponse> after(std::optional<std::uint64_t>& seen) {
    if (seen == changes_) return std::nullopt;
    v1::WatchMachinesResponse response;
    const auto& entries = machines_.roster().entries();
    for (const auto& [name, entry] : entries)
      if (!seen || changed_at_[name] > *seen) *response.add_machines() = machines_.machine(name);
    for (const auto& [name, change] : changed_at_)
      if (seen && change > *seen && !entries.contains(name)) response.add_forgotten(name);
    seen = changes_;
    return response;
  }

  const Machines& machines_;
  CoreStreams<v1::WatchMachinesResponse> watchers_;
  /// Counts changes of machines; of each machine, and of each that is forgotten, the last one.
  std::uint64_t changes_ = 0;
  std::map<std::string, std::uint64_t> changed_at_;
};

}  // namespace axisd::cell
