#include "api/transport/stream_budget.hpp"

#include <algorithm>
#include <iterator>
#include <utility>

namespace axisd::transport {
namespace {

/// Looks at a time: a look costs what a few streams do, so that it is worth it for so many that may be there.
constexpr std::int64_t looks_at_least = 16, streams_of_a_look = 64;

}  // namespace

std::int64_t StreamBudget::leave(Id id) {
  const auto found = connections_.find(id);
  if (found == connections_.end()) return 0;
  const auto open = found->second.open;
  connections_.erase(found);
  return open;
}

void StreamBudget::received(Id id, std::uint64_t bytes) {
  const auto found = connections_.find(id);
  if (found != connections_.end()) found->second.bytes = std::max(found->second.bytes, bytes);
}

std::vector<StreamBudget::Id> StreamBudget::doubtful(TimePoint now) const {
  struct Candidate {
    Id id;
    std::int64_t doubt;
    TimePoint looked;
    bool is_crowded;
  };
  std::vector<Candidate> candidates;
  std::int64_t all = 0, doubt = 0;
  for (const auto& [id, each] : connections_) {
    doubt += each.doubt(now);
    all += each.idle + each.doubt(now);
    const bool is_crowded = each.open + each.doubt(now) > limits_.of_one;
    if (is_crowded || each.doubt(now) > 0 || each.idle > 0)
      candidates.push_back(
          {.id = id, .doubt = each.doubt(now), .looked = each.looked, .is_crowded = is_crowded});
  }
  if (all <= limits_.lasting)
    std::erase_if(candidates, [](const Candidate& each) { return !each.is_crowded; });
  const auto most = static_cast<std::size_t>(looks_at_least + doubt / streams_of_a_look);
  std::vector<Id> asked;
  const auto take = [&](std::size_t number, auto&& first) {
    std::ranges::sort(candidates, first);
    number = std::min(number, candidates.size());
    const auto end = candidates.begin() + static_cast<std::ptrdiff_t>(number);
    std::transform(candidates.begin(), end, std::back_inserter(asked),
                   [](const auto& each) { return each.id; });
    candidates.erase(candidates.begin(), end);
  };
  // Half of them in turn: who sends nothing any more may still have what it opened.
  take(most / 2, [](const auto& a, const auto& b) { return a.doubt > b.doubt; });
  take(most / 2, [](const auto& a, const auto& b) { return a.looked < b.looked; });
  return asked;
}

void StreamBudget::seen(Id id, const Seen& seen, std::uint64_t unread, TimePoint now) {
  const auto found = connections_.find(id);
  if (found == connections_.end()) return;
  auto& connection = found->second;
  if (now - connection.late_at >= taken_in_after) connection.late = 0;
  if (const auto late = connection.since_look(); late > 0) {
    connection.late += late;
    connection.late_at = now;
  }
  connection.accounted =
      std::max(connection.accounted, connection.bytes - std::min(unread, connection.bytes));
  connection.looked = now;
  connection.open = seen.started - seen.ended;
  // They are counted one after the other.
  connection.idle = std::max<std::int64_t>(0, connection.open - seen.in_progress);
  const bool far_too_many = connection.open > 2 * limits_.of_one;
  connection.crowded = connection.open <= limits_.of_one ? 0 : connection.crowded + (far_too_many ? 2 : 1);
  connection.lasting = std::min(connection.lasting, connection.idle);
  auto& before = connection.before;
  if (before && now - before->at < lasts_for) return;
  if (before)
    connection.lasting =
        std::clamp<std::int64_t>(before->idle - (seen.ended - before->ended), 0, connection.idle);
  before = {.at = now, .ended = seen.ended, .idle = connection.idle};
}

void StreamBudget::unknown(Id id, TimePoint now) {
  const auto found = connections_.find(id);
  if (found == connections_.end()) return;
  auto& connection = found->second;
  connection.looked = now;
  connection.idle = connection.lasting = 0;
  connection.before.reset();
}

std::vector<StreamBudget::Id> StreamBudget::beyond(TimePoint now) const {
  std::vector<Id> cut;
  for (const auto& [id, each] : connections_)
    if (each.crowded > 1) cut.push_back(id);
  const auto known = [now](const Connection& each) { return now - each.looked <= known_for; };
  shed(cut, limits_.lasting, [&](const auto& each) { return known(each) ? each.lasting : 0; });
  shed(cut, limits_.idle, [&](const auto& each) { return known(each) ? each.idle : 0; });
  return cut;
}

void StreamBudget::shed(std::vector<Id>& cut, std::int64_t most, const Measure& measure) const {
  std::map<std::string, std::vector<std::pair<std::int64_t, Id>>> by_address;
  std::map<std::string, std::int64_t> of_address;
  std::int64_t all = 0;
  for (const auto& [id, each] : connections_) {
    const auto number = measure(each);
    if (number == 0 || std::ranges::find(cut, id) != cut.end()) continue;
    by_address[each.address].emplace_back(number, id);
    of_address[each.address] += number;
    all += number;
  }
  for (auto& [address, connections] : by_address) std::ranges::sort(connections);
  while (all > most) {
    const auto worst = std::ranges::max_element(of_address, {}, [](const auto& each) { return each.second; });
    auto& connections = by_address.at(worst->first);
    const auto [number, id] = connections.back();
    connections.pop_back();
    cut.push_back(id);
    worst->second -= number;
    all -= number;
  }
}

}  // namespace axisd::transport
