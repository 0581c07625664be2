#include "api/server/hold_validate.hpp"

#include <utility>

#include "api/server/validate.hpp"

namespace axisd::server {

namespace {

template <class Request>
Result<HoldRelease> hold_release(const Request& from, std::string&& client) {
  using Whose = HoldRelease::Whose;
  const bool named = !from.request_id().empty();
  if (int{from.mine()} + int{from.everybody()} + int{named} > 1)
    return fail(Reason::invalid_argument, "more than one of request_id, mine and everybody is given",
                "say by one of them which holds are to end");
  if (named)
    if (auto usable = check_request_id(from.request_id(), "request_id"); !usable) return fail(usable.error());
  const auto own = from.mine() ? Whose::mine : Whose::one;
  return HoldRelease{.client = std::move(client),
                     .request_id = from.request_id(),
                     .whose = from.everybody() ? Whose::everybody : own,
                     .lease_token = from.lease_token()};
}

}  // namespace

std::string hold_id(const std::string& request_id) {
  return check_request_id(request_id, "request_id") ? request_id : std::string();
}

Result<HoldRelease> release_of(const v1::ReleaseStopRequest& from, std::string client) {
  return hold_release(from, std::move(client));
}

Result<HoldRelease> release_of(const v1::GroupReleaseStopRequest& from, std::string client) {
  return hold_release(from, std::move(client));
}

}  // namespace axisd::server
