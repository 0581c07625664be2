#include "api/server/user_names.hpp"

#include <algorithm>

namespace axisd::server {

std::string UserNames::of(uid_t user, TimePoint now) {
  {
    const std::lock_guard lock(mutex_);
    const auto found = known_.find(user);
    if (found != known_.end() && now - found->second.since < longest) return found->second.name;
  }
  auto name = look_up_(user);
  const std::lock_guard lock(mutex_);
  if (known_.size() >= most && !known_.contains(user))
    known_.erase(std::ranges::min_element(known_, {}, [](const auto& each) { return each.second.since; }));
  known_.insert_or_assign(user, Known{.name = name, .since = now});
  return name;
}

}  // namespace axisd::server
