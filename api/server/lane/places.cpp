#include "api/server/lane/places.hpp"

#include <algorithm>
#include <functional>
#include <tuple>
#include <utility>

namespace axisd::server::lane {

namespace {

constexpr auto anybody = [](const auto& /*place*/) { return true; };

std::string most_of(const std::map<std::string, int>& counts) {
  const auto most = std::ranges::max_element(counts, {}, [](const auto& each) { return each.second; });
  return most == counts.end() ? std::string() : most->first;
}

int total(const std::map<std::string, int>& counts) {
  int sum = 0;
  for (const auto& [key, number] : counts) sum += number;
  return sum;
}

}  // namespace

template <class Of>
std::map<std::string, int> Places::count(bool known, Of of) const {
  std::map<std::string, int> counts;
  for (const auto& [id, place] : all_)
    if (place.known == known) ++counts[std::invoke(of, place)];
  return counts;
}

template <class May>
std::optional<Places::Id> Places::least_of_strangers(Id but, May may) const {
  const Entry* least = nullptr;
  const auto order = [](const Place& place) { return std::tuple(place.greeted, place.since); };
  for (const auto& entry : all_) {
    if (entry.first == but || entry.second.known || !may(entry.second)) continue;
    if (least == nullptr || order(entry.second) < order(least->second)) least = &entry;
  }
  return least == nullptr ? std::nullopt : std::optional(least->first);
}

std::optional<Places::Id> Places::oldest_stranger() const {
  const Entry* oldest = nullptr;
  for (const auto& entry : all_)
    if (!entry.second.known && (oldest == nullptr || entry.second.since < oldest->second.since))
      oldest = &entry;
  return oldest == nullptr ? std::nullopt : std::optional(oldest->first);
}

std::optional<Places::Id> Places::idlest(const std::string& identity, Id but) const {
  const Entry* idlest = nullptr;
  const auto order = [](const Place& place) {
    return std::tuple(place.waiting > 0, place.asked, place.used);
  };
  for (const auto& entry : all_) {
    if (entry.first == but || !entry.second.known || entry.second.identity != identity) continue;
    if (idlest == nullptr || order(entry.second) < order(idlest->second)) idlest = &entry;
  }
  return idlest == nullptr ? std::nullopt : std::optional(idlest->first);
}

std::optional<Places::Id> Places::enter(Id id, Origin origin, TimePoint now) {
  all_[id] = {.address = origin.address,
              .network = std::move(origin.network),
              .identity = {},
              .since = now,
              .used = now};
  if (count(false, &Place::address).at(origin.address) > limits_.strangers_per_address)
    return least_of_strangers(id, [&](const Place& place) { return place.address == origin.address; });
  const auto strangers = count(false, &Place::network);
  if (total(strangers) > limits_.strangers) {
    // Where each network has one, the oldest goes, whatever its network is.
    const auto most = most_of(strangers);
    const bool any = strangers.at(most) == 1;
    return least_of_strangers(id, [&](const Place& place) { return any || place.network == most; });
  }
  if (std::cmp_less_equal(all_.size(), limits_.connections)) return std::nullopt;
  return idlest(most_of(count(true, &Place::identity)), id);
}

std::optional<Places::Id> Places::identify(Id id, const std::string& identity, bool local, TimePoint now) {
  auto& place = all_.at(id);
  place.identity = identity;
  place.known = true;
  place.used = now;
  if (count(true, &Place::identity).at(identity) <= (local ? limits_.local : limits_.per_identity))
    return std::nullopt;
  return idlest(identity, id);
}

void Places::used(Id id, TimePoint now, int waiting) {
  auto& place = all_.at(id);
  place.used = now;
  place.waiting = waiting;
}

std::optional<Places::Id> Places::overdue(TimePoint now) const {
  const auto oldest = oldest_stranger();
  if (!oldest || all_.at(*oldest).since + limits_.introduction > now) return std::nullopt;
  return oldest;
}

std::optional<Places::Id> Places::least_needed() const {
  if (const auto stranger = least_of_strangers(Id{}, anybody)) return stranger;
  return idlest(most_of(count(true, &Place::identity)), Id{});
}

TimePoint Places::next_due() const {
  const auto oldest = oldest_stranger();
  return oldest ? all_.at(*oldest).since + limits_.introduction : TimePoint::max();
}

}  // namespace axisd::server::lane
