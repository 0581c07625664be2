#include "daemon/link/links.hpp"

#include <fmt/format.h>

#include <cstdio>
#include <utility>

namespace axisd::link {

Result<void> Links::serve(const Request& request) {
  const auto links = read_links(file_);
  if (!links) return fail(links.error());
  if (const auto allowed = permitted(request.interface, *links, file_); !allowed) return allowed;
  return request.verb == Verb::check ? Result<void>{} : cycle(request.interface);
}

Result<void> Links::cycle(const std::string& interface) {
  const auto link = netlink_.find(interface);
  if (!link) return fail(link.error());
  if (link->gone)
    return fail(Reason::bus_down, fmt::format("there is no interface {}", interface), "connect the adapter");
  if (!link->is_can)
    return fail(Reason::misconfigured, fmt::format("{} is no CAN interface", interface), "correct its name");
  if (link->up) {
    owed_.erase(interface);
    if (const auto down = netlink_.set_up(*link, false); !down) return down;
  } else if (!owed_.contains(interface)) {
    // Whoever set it down may work at it.
    return fail(Reason::bus_down, fmt::format("{} is down already", interface), "set it up by hand");
  }
  return set_up_again(*link);
}

Result<void> Links::set_up_again(const can::LinkReport& link) {
  auto up = netlink_.set_up(link, true);
  if (up)
    owed_.erase(link.name);
  else
    owed_.insert(link.name);
  return up;
}

void Links::retry() {
  for (const auto& interface : std::set(owed_)) {
    const auto link = netlink_.find(interface);
    if (!link) continue;
    if (link->gone || link->up) {
      owed_.erase(interface);
    } else if (set_up_again(*link)) {
      fmt::print(stderr, "{} is up again\n", interface);
    }
  }
}

}  // namespace axisd::link
