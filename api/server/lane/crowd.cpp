#include "api/server/lane/crowd.hpp"

#include <algorithm>
#include <functional>
#include <utility>

namespace axisd::server::lane {

namespace {

/// The one with most; of those with as many the one whose oldest is the oldest. Precondition: there is one.
template <class Groups, class Ids>
const auto& fullest(const Groups& groups, Ids ids) {
  const auto order = [&](const auto& group) {
    const auto& own = std::invoke(ids, group.second);
    return std::pair(own.size(), ~*own.begin());
  };
  return std::ranges::max_element(groups, {}, order)->second;
}

}  // namespace

std::optional<Crowd::Id> Crowd::enter(Id id, Origin origin, TimePoint now) {
  auto& network = networks_[origin.network];
  network.all.insert(id);
  network.by_address[origin.address].insert(id);
  all_.emplace(id, One{.origin = std::move(origin), .since = now});
  return all_.size() > std::max<std::size_t>(limits_.most, 1) ? least_needed() : std::nullopt;
}

void Crowd::leave(Id id) {
  const auto found = all_.find(id);
  if (found == all_.end()) return;
  const auto& origin = found->second.origin;
  const auto network = networks_.find(origin.network);
  const auto address = network->second.by_address.find(origin.address);
  address->second.erase(id);
  if (address->second.empty()) network->second.by_address.erase(address);
  network->second.all.erase(id);
  if (network->second.all.empty()) networks_.erase(network);
  all_.erase(found);
}

std::optional<Crowd::Id> Crowd::overdue(TimePoint now) const {
  return next_due() <= now ? std::optional(all_.begin()->first) : std::nullopt;
}

TimePoint Crowd::next_due() const {
  return all_.empty() ? TimePoint::max() : all_.begin()->second.since + limits_.patience;
}

std::optional<Crowd::Id> Crowd::least_needed() const {
  if (all_.empty()) return std::nullopt;
  const auto& network = fullest(networks_, &Network::all);
  return *fullest(network.by_address, std::identity()).begin();
}

}  // namespace axisd::server::lane
