#include "daemon/core/tallies.hpp"

namespace axisd::core {

void Tallies::add(const std::string& axis, const EventContent& content) {
  if (const auto* change = std::get_if<CommandChange>(&content)) {
    const auto& command = *change->command;
    ++commands_.at(static_cast<std::size_t>(command.kind)).at(static_cast<std::size_t>(command.state));
  } else if (const auto* lease = std::get_if<LeaseChange>(&content)) {
    ++leases_.at(static_cast<std::size_t>(lease->what));
  } else if (const auto* inhibit = std::get_if<InhibitChange>(&content)) {
    if (inhibit->what == InhibitChange::What::latched) ++stop_alls_;
  } else if (const auto* link = std::get_if<LinkChange>(&content)) {
    if (link->to == LinkState::offline) ++axes_[axis].link_losses;
  } else if (std::holds_alternative<AxisFault>(content)) {
    ++axes_[axis].faults;
  } else if (std::holds_alternative<FlightRecordWritten>(content)) {
    ++flight_records_;
  } else if (std::holds_alternative<ConfigurationReloaded>(content)) {
    ++reloads_;
  }
}

Tallies::OfAxis Tallies::of(const std::string& axis) const {
  const auto found = axes_.find(axis);
  return found == axes_.end() ? OfAxis{} : found->second;
}

}  // namespace axisd::core
