#pragma once

#include <array>
#include <cstdint>
#include <map>
#include <string>

#include "devices/event.hpp"

namespace axisd::core {

/// What happened since the start, as numbers: of the events, also of those that are no longer kept. Pure. As
/// large as the configuration makes it, whatever clients do.
class Tallies {
 public:
  static constexpr std::size_t command_kinds = static_cast<std::size_t>(CommandKind::move_group) + 1;
  static constexpr std::size_t command_states = static_cast<std::size_t>(CommandState::unknown) + 1;
  static constexpr std::size_t lease_changes = static_cast<std::size_t>(LeaseChange::What::taken) + 1;

  struct OfAxis {
    std::uint64_t faults = 0;       ///< it went into ErrorStop, or another cause took the place of the first
    std::uint64_t link_losses = 0;  ///< its drive ceased to answer
  };

  /// `axis`: of the configuration; empty: it concerns none.
  void add(const std::string& axis, const EventContent& content);

  /// How many commands of a kind were accepted, or have ended so.
  [[nodiscard]] std::uint64_t commands(CommandKind kind, CommandState state) const {
    return commands_.at(static_cast<std::size_t>(kind)).at(static_cast<std::size_t>(state));
  }
  [[nodiscard]] std::uint64_t leases(LeaseChange::What what) const {
    return leases_.at(static_cast<std::size_t>(what));
  }
  [[nodiscard]] std::uint64_t stop_alls() const { return stop_alls_; }
  [[nodiscard]] std::uint64_t flight_records() const { return flight_records_; }
  [[nodiscard]] std::uint64_t reloads() const { return reloads_; }
  [[nodiscard]] OfAxis of(const std::string& axis) const;

 private:
  std::array<std::array<std::uint64_t, command_states>, command_kinds> commands_{};
  std::array<std::uint64_t, lease_changes> leases_{};
  std::uint64_t stop_alls_ = 0, flight_records_ = 0, reloads_ = 0;
  std::map<std::string, OfAxis> axes_;
};

}  // namespace axisd::core
