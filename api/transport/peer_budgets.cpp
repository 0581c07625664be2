#include "api/transport/peer_budgets.hpp"

#include <algorithm>
#include <utility>

namespace axisd::transport {

double PeerBudgets::level_of(const Bucket& bucket, TimePoint now) const {
  const auto seconds = std::chrono::duration<double>(now - bucket.since).count();
  return std::max(0.0, bucket.level - seconds * limits_.rate);
}

void PeerBudgets::fill(Bucket& bucket, double more, TimePoint now) const {
  bucket = {.level = std::max(0.0, level_of(bucket, now) + more), .since = now};
}

void PeerBudgets::forget_idle(TimePoint now) {
  std::erase_if(addresses_, [&](const auto& entry) {
    const auto& [connections, bucket, kept_out_until] = entry.second;
    return connections == 0 && level_of(bucket, now) <= 0 && now >= kept_out_until;
  });
}

int PeerBudgets::most_of_one() const { return std::max(1, limits_.connections * 3 / 4); }

PeerBudgets::Entry PeerBudgets::enter(Id id, const std::string& address, TimePoint now, bool counted) {
  forget_idle(now);
  auto& from = addresses_.try_emplace(address, Address{.bucket = {.since = now}}).first->second;
  // First: who floods must not take the places of others.
  if (now < from.kept_out_until || level_of(from.bucket, now) > limits_.burst / 2)
    return Entry::address_floods;
  if (std::cmp_greater_equal(connections_.size(), limits_.connections)) return Entry::full;
  if (from.connections >= most_of_one()) return Entry::address_full;
  ++from.connections;
  connections_.emplace(
      id, Connection{
              .address = address, .may_go = counted, .bucket = {.since = now}, .begun = now, .active = now});
  return Entry::granted;
}

std::optional<PeerBudgets::Id> PeerBudgets::gives_way(const std::string& address, TimePoint now) const {
  const auto own = addresses_.find(address);
  const bool has_all = own != addresses_.end() && own->second.connections >= most_of_one();
  const auto most =
      std::ranges::max_element(addresses_, {}, [](const auto& entry) { return entry.second.connections; });
  const auto& from = has_all || most == addresses_.end() ? address : most->first;
  // Silent ones first, the oldest of them; then the one that has been idle for longest.
  const auto rank = [](const Connection& connection) {
    return std::pair(connection.said_hello, connection.said_hello ? connection.active : connection.begun);
  };
  const std::pair<const Id, Connection>* found = nullptr;
  for (const auto& entry : connections_) {
    const auto& [id, connection] = entry;
    if (connection.address != from || !connection.may_go) continue;
    if (connection.said_hello && now - connection.active < limits_.idle) continue;
    if (found == nullptr || rank(connection) < rank(found->second)) found = &entry;
  }
  return found == nullptr ? std::nullopt : std::optional(found->first);
}

void PeerBudgets::look(Connection& connection, const Traffic& total, TimePoint now) {
  const auto& before = connection.noted;
  const bool goes_on = total.received - before.received + total.sent - before.sent > quiet;
  if (goes_on) connection.active = now;
  if (goes_on || now - connection.noted_at >= quiet_for) {
    connection.noted = total;
    connection.noted_at = now;
  }
  connection.said_hello = total.received >= hello;
}

bool PeerBudgets::still_gives_way(Id id, const Traffic& total, TimePoint now) {
  const auto found = connections_.find(id);
  if (found == connections_.end()) return false;
  auto& connection = found->second;
  look(connection, total, now);
  return !connection.said_hello || now - connection.active >= limits_.idle;
}

void PeerBudgets::leave(Id id) {
  const auto connection = connections_.find(id);
  if (connection == connections_.end()) return;
  --addresses_.at(connection->second.address).connections;
  connections_.erase(connection);
}

void PeerBudgets::keep_out(Address& address, double level, TimePoint now) const {
  const auto much = std::min(level, limits_.rate * limits_.longest_penalty) - limits_.burst / 2;
  const auto time = std::chrono::duration_cast<Duration>(std::chrono::duration<double>(much / limits_.rate));
  address.kept_out_until = std::max(address.kept_out_until, now + time);
}

void PeerBudgets::blame(Id id, TimePoint now) {
  const auto found = connections_.find(id);
  if (found != connections_.end()) keep_out(addresses_.at(found->second.address), limits_.burst, now);
}

std::optional<PeerBudgets::Id> PeerBudgets::most_one_sided() const {
  const auto most =
      std::ranges::max_element(connections_, {}, [](const auto& entry) { return entry.second.one_sided; });
  if (most == connections_.end() || most->second.one_sided <= limits_.suspect) return std::nullopt;
  return most->first;
}

std::vector<PeerBudgets::Id> PeerBudgets::count(const std::map<Id, Traffic>& traffic, TimePoint now) {
  std::map<std::string, std::vector<std::pair<double, Id>>> by_address;
  for (const auto& [id, total] : traffic) {
    const auto found = connections_.find(id);
    if (found == connections_.end()) continue;
    auto& connection = found->second;
    auto& address = addresses_.at(connection.address);
    look(connection, total, now);
    const auto before = std::exchange(connection.counted, total);
    const auto one_sided = static_cast<double>(total.received - before.received) -
                           limits_.proportion * static_cast<double>(total.sent - before.sent);
    // An answer may come later than its request was counted. What one connection gets excuses no other.
    fill(connection.bucket, one_sided, now);
    connection.one_sided = std::max(0.0, connection.one_sided + one_sided);
    fill(address.bucket, std::max(0.0, one_sided), now);
    by_address[connection.address].emplace_back(connection.bucket.level, id);
  }
  std::vector<Id> cut;
  for (auto& [name, connections] : by_address) {
    auto& address = addresses_.at(name);
    auto& level = address.bucket.level;
    if (level <= limits_.burst) continue;
    keep_out(address, level, now);
    std::ranges::sort(connections, std::greater{});
    for (const auto& [own, id] : connections) {
      if (level <= limits_.burst || own <= 0) break;
      cut.push_back(id);
      level -= own;
    }
    // What is left above it was brought by others that are gone.
    level = std::clamp(level, 0.0, limits_.burst);
  }
  return cut;
}

}  // namespace axisd::transport
