#include "api/web/gateway/login_pauses.hpp"

#include <algorithm>

namespace axisd::web {
namespace {

std::string both(const std::string& address, const std::string& name) { return address + ' ' + name; }

}  // namespace

Duration LoginPauses::left(const std::string& address, const std::string& name, TimePoint now) const {
  return std::max(left_of(addresses_, address, longest_of_address, now),
                  left_of(names_, both(address, name), longest_of_name, now));
}

void LoginPauses::failed(const std::string& address, const std::string& name, TimePoint now) {
  count(addresses_, address, now);
  count(names_, both(address, name), now);
}

void LoginPauses::succeeded(const std::string& address, const std::string& name) {
  addresses_.erase(address);
  names_.erase(both(address, name));
}

Duration LoginPauses::left_of(const Table& table, const std::string& key, Duration longest, TimePoint now) {
  const auto found = table.find(key);
  if (found == table.end() || found->second.count < free_attempts) return Duration::zero();
  const int doublings = std::min(found->second.count - free_attempts, 16);
  const auto pause = std::min<Duration>(first * (1 << doublings), longest);
  return std::max<Duration>(found->second.last + pause - now, Duration::zero());
}

void LoginPauses::count(Table& table, const std::string& key, TimePoint now) {
  std::erase_if(table, [&](const auto& entry) { return entry.second.last + remembered <= now; });
  if (table.size() >= most && !table.contains(key))
    table.erase(std::ranges::min_element(table, {}, [](const auto& entry) { return entry.second.last; }));
  auto& failures = table[key];
  failures = {.count = failures.count + 1, .last = now};
}

}  // namespace axisd::web
