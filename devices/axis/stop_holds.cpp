#include "devices/axis/stop_holds.hpp"

#include <fmt/chrono.h>
#include <fmt/format.h>

#include <algorithm>
#include <set>
#include <utility>

namespace axisd {

namespace {

/// In one message; the state tells them all.
constexpr std::size_t most_named = 8;

std::string text_of(const StopHold& hold) {
  const auto request = hold.key.request_id.empty() ? "" : fmt::format(" (request {})", hold.key.request_id);
  return fmt::format("{}{} since {:%Y-%m-%dT%H:%M:%S}Z", hold.key.holder, request,
                     std::chrono::floor<std::chrono::seconds>(hold.since));
}

}  // namespace

StopHold* StopHolds::find(const HoldKey& key) {
  const auto found = std::ranges::find(all_, key, &StopHold::key);
  return found == all_.end() ? nullptr : &*found;
}

HoldKey StopHolds::within_bounds(HoldKey key) const {
  const auto own = std::ranges::count(all_, key.holder, [](const auto& each) { return each.key.holder; });
  if (own == 0) {
    std::set<std::string_view> clients;
    for (const auto& each : all_) clients.insert(each.key.holder);
    if (clients.size() >= holders) return {.holder = std::string(more_clients), .request_id = {}};
  }
  const auto by_name = std::ranges::count_if(all_, [&](const StopHold& each) {
    return each.key.holder == key.holder && !each.key.request_id.empty();
  });
  if (!key.request_id.empty() && static_cast<std::size_t>(by_name) >= share) key.request_id = more_requests;
  return key;
}

StopHold& StopHolds::insert(HoldKey key, WallTime since) {
  const auto place = std::ranges::lower_bound(all_, key, {}, &StopHold::key);
  return *all_.insert(place, {.key = std::move(key), .since = since});
}

const StopHold& StopHolds::add(HoldKey key, WallTime since, TimePoint arrived) {
  auto* hold = find(key);
  if (hold == nullptr) {
    key = within_bounds(std::move(key));
    hold = find(key);
  }
  if (hold == nullptr) hold = &insert(std::move(key), since);
  hold->renewed = std::max(hold->renewed, arrived);
  hold->stops = ++stops_;
  return *hold;
}

void StopHolds::restore(HoldKey key, WallTime since) { insert(std::move(key), since).durable = true; }

bool StopHolds::set_durable(const HoldKey& key, bool durable) {
  auto* hold = find(key);
  return hold != nullptr && std::exchange(hold->durable, durable) != durable;
}

std::vector<StopHold> StopHolds::meant_by(const HoldRelease& release) const {
  using Whose = HoldRelease::Whose;
  std::vector<StopHold> meant;
  std::ranges::copy_if(all_, std::back_inserter(meant), [&](const StopHold& hold) {
    if (hold.renewed > release.arrived) return false;
    if (release.whose == Whose::everybody) return true;
    return hold.key.holder == release.client &&
           (release.whose == Whose::mine || hold.key.request_id == release.request_id);
  });
  return meant;
}

bool StopHolds::end(const StopHold& read) {
  const auto found = std::ranges::find(all_, read.key, &StopHold::key);
  if (found == all_.end()) return true;
  if (found->stops != read.stops) return false;
  all_.erase(found);
  return true;
}

std::string text_of(const std::vector<StopHold>& holds) {
  std::string text;
  for (std::size_t i = 0; i < std::min(holds.size(), most_named); ++i)
    text += (i == 0 ? "" : ", ") + text_of(holds[i]);
  if (holds.size() > most_named) text += fmt::format(" and {} more", holds.size() - most_named);
  return text;
}

std::string how_to_release(const std::vector<StopHold>& holds, std::string_view axis,
                           std::string_view client) {
  const auto line = fmt::format("axisctl release-stop {}", axis);
  if (std::ranges::any_of(holds, [&](const StopHold& hold) { return hold.key.holder != client; }))
    return fmt::format(
        "whoever holds it releases it, or somebody who may command the axis does for all: {} "
        "--everybody",
        line);
  if (holds.size() > 1) return fmt::format("release all that are yours: {} --mine", line);
  const auto id = holds.empty() ? std::string() : holds.front().key.request_id;
  if (id == StopHolds::more_requests) return fmt::format("release it: {} --mine", line);
  return fmt::format("release it: {}{}", line, id.empty() ? "" : " --request-id " + id);
}

}  // namespace axisd
