#include "devices/lease/lease_table.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <utility>

#include "buses/seconds.hpp"

namespace axisd {

namespace {

/// Ended leases whose late holders are told what became of them.
constexpr std::size_t ended_remembered = 256;
/// Of a token: the rest is the epoch. Clients that count in doubles keep both exact for 2^21 starts.
constexpr int counter_bits = 32;

std::string until(const Lease& lease, TimePoint now) {
  return fmt::format("leased by {} for another {:.1f} s", lease.holder(), in_seconds(lease.expires - now));
}

}  // namespace

LeaseTable::LeaseTable(LeaseSettings settings, std::uint64_t epoch)
    : settings_(settings), last_token_(epoch << counter_bits) {}

Result<Duration> LeaseTable::ttl_of(const LeaseRequest& request) const {
  const auto ttl = request.ttl.value_or(settings_.default_ttl);
  if (ttl >= settings_.shortest_ttl && ttl <= settings_.longest_ttl) return ttl;
  return fail(
      Error{.reason = Reason::out_of_range,
            .message = fmt::format("ttl of {:.6g} s is out of range", in_seconds(ttl)),
            .remedy = "give a duration in the permitted range, or change leases: in the configuration",
            .permitted = Range{.minimum = in_seconds(settings_.shortest_ttl),
                               .maximum = in_seconds(settings_.longest_ttl),
                               .unit = "s"}});
}

Result<Lease*> LeaseTable::find_repeat(const LeaseRequest& request, TimePoint now) {
  if (request.request_id.empty()) return nullptr;
  for (auto& [token, lease] : leases_) {
    if (lease.client != request.client || lease.request_id != request.request_id || now >= lease.expires)
      continue;
    if (lease.axes == request.axes) return &lease;
    return fail(Reason::request_id_conflict,
                fmt::format("request_id '{}' was used before for other axes", request.request_id),
                "use a new request_id for each new request");
  }
  return nullptr;
}

Result<LeaseGrant> LeaseTable::acquire(const LeaseRequest& request, TimePoint now) {
  const auto ttl = ttl_of(request);
  if (!ttl) return fail(ttl.error());
  const auto repeat = find_repeat(request, now);
  if (!repeat) return fail(repeat.error());
  if (auto* known = *repeat; known != nullptr) {
    known->expires = now + known->ttl;
    return LeaseGrant{.lease = *known, .repeated = true};
  }
  if (!request.take)
    for (const auto& axis : request.axes)
      if (const auto* other = living(axis, now)) {
        auto refusal = held(*other, axis, request.client, now);
        refusal.message = fmt::format("{}: {}", axis, refusal.message);
        return fail(std::move(refusal));
      }
  Lease lease{.token = ++last_token_,
              .client = request.client,
              .label = request.label,
              .axes = request.axes,
              .request_id = request.request_id,
              .ttl = *ttl,
              .acquired = now,
              .expires = now + *ttl};
  LeaseGrant grant{.lease = lease};
  for (const auto& axis : request.axes)
    if (const auto other = by_axis_.find(axis); other != by_axis_.end()) {
      const auto known = leases_.find(other->second);
      const bool expired = now >= known->second.expires;
      grant.taken.push_back(end(known, expired ? LeaseEnd::expired : LeaseEnd::taken,
                                expired ? std::string() : lease.holder(), now));
    }
  for (const auto& axis : lease.axes) by_axis_.insert_or_assign(axis, lease.token);
  leases_.emplace(lease.token, std::move(lease));
  return grant;
}

Result<LeaseTable::Leases::iterator> LeaseTable::held_by(const Requester& holder, TimePoint now) {
  const auto found = leases_.find(holder.lease_token);
  if (found == leases_.end()) return fail(lost(holder.lease_token, {}, now));
  if (found->second.client != holder.client)
    return fail(Reason::lease_required, fmt::format("the lease is that of {}", found->second.holder()),
                "acquire one of your own");
  return found;
}

Result<Lease> LeaseTable::renew(const Requester& holder, TimePoint now) {
  const auto found = held_by(holder, now);
  if (!found) return fail(found.error());
  auto& lease = (*found)->second;
  if (now >= lease.expires) return fail(lost(lease.token, {}, now));
  lease.expires = now + lease.ttl;
  return lease;
}

Result<EndedLease> LeaseTable::release(const Requester& holder, TimePoint now) {
  const auto found = held_by(holder, now);
  if (!found) return fail(found.error());
  const bool expired = now >= (*found)->second.expires;
  return end(*found, expired ? LeaseEnd::expired : LeaseEnd::released, {}, now);
}

std::vector<EndedLease> LeaseTable::expire(TimePoint now) {
  std::vector<EndedLease> over;
  for (auto lease = leases_.begin(); lease != leases_.end();) {
    const auto next = std::next(lease);
    if (now >= lease->second.expires) over.push_back(end(lease, LeaseEnd::expired, {}, now));
    lease = next;
  }
  return over;
}

TimePoint LeaseTable::next_expiry() const {
  auto next = TimePoint::max();
  for (const auto& [token, lease] : leases_) next = std::min(next, lease.expires);
  return next;
}

EndedLease LeaseTable::end(Leases::iterator lease, LeaseEnd how, std::string by, TimePoint now) {
  EndedLease over{.lease = std::move(lease->second), .end = how, .by = std::move(by), .at = now};
  leases_.erase(lease);
  for (const auto& axis : over.lease.axes) by_axis_.erase(axis);
  ended_.push_back(over);
  if (ended_.size() > ended_remembered) ended_.pop_front();
  return over;
}

const Lease* LeaseTable::find(std::string_view axis) const {
  const auto token = by_axis_.find(axis);
  return token == by_axis_.end() ? nullptr : &leases_.at(token->second);
}

const Lease* LeaseTable::living(std::string_view axis, TimePoint now) const {
  const auto* lease = find(axis);
  return lease != nullptr && now < lease->expires ? lease : nullptr;
}

std::vector<Lease> LeaseTable::list() const {
  std::vector<Lease> all;
  all.reserve(leases_.size());
  for (const auto& [token, lease] : leases_) all.push_back(lease);
  return all;
}

Error LeaseTable::held(const Lease& lease, std::string_view axis, const std::string& client, TimePoint now) {
  const bool its_own = lease.client == client && !client.empty();
  return {.reason = Reason::lease_required,
          .message = until(lease, now),
          .remedy = fmt::format(
              "{}, wait, or take it over: axisctl lease acquire {} --take",
              its_own ? "give its token (axisctl: --lease TOKEN or AXISD_LEASE)" : "ask its holder", axis)};
}

/// What became of a lease, and who has `axis` (or the first of its axes) now.
Error LeaseTable::lost(std::uint64_t token, std::string_view axis, TimePoint now) const {
  std::string text = "there is no lease with this token (any more)";
  const auto known =
      std::ranges::find(ended_, token, [](const EndedLease& over) { return over.lease.token; });
  if (known != ended_.end()) {
    const auto ago = in_seconds(now - known->at);
    if (known->end == LeaseEnd::released) text = fmt::format("the lease was released {:.1f} s ago", ago);
    if (known->end == LeaseEnd::expired) text = fmt::format("the lease expired {:.1f} s ago", ago);
    if (known->end == LeaseEnd::taken) text = fmt::format("{} took the lease {:.1f} s ago", known->by, ago);
    if (axis.empty()) axis = known->lease.axes.front();
  } else if (leases_.contains(token)) {
    text = "the lease has expired";
  }
  if (const auto* now_held = axis.empty() ? nullptr : living(axis, now))
    text += fmt::format("; {} is {}", axis, until(*now_held, now));
  return {.reason = Reason::lease_lost,
          .message = std::move(text),
          .remedy = axis.empty() ? std::string("acquire a lease again")
                                 : fmt::format("acquire a lease again: axisctl lease acquire {}", axis)};
}

Result<void> LeaseTable::check(std::string_view axis, const Requester& requester, TimePoint now) const {
  const auto* lease = living(axis, now);
  if (requester.lease_token == 0) {
    if (lease != nullptr) return fail(held(*lease, axis, requester.client, now));
    if (!settings_.required) return {};
    return fail(Reason::lease_required, "this machine is commanded under leases only (control: leased)",
                fmt::format("acquire one: axisctl lease acquire {}, and give its token", axis));
  }
  const bool its_own = lease != nullptr && lease->token == requester.lease_token;
  if (its_own && lease->client == requester.client) return {};
  if (its_own) return fail(held(*lease, axis, requester.client, now));
  const auto other = leases_.find(requester.lease_token);
  if (other == leases_.end() || other->second.client != requester.client || now >= other->second.expires)
    return fail(lost(requester.lease_token, axis, now));
  return fail(Reason::lease_required,
              fmt::format("the lease with this token is of {}{}", fmt::join(other->second.axes, ", "),
                          lease == nullptr ? std::string() : "; the axis is " + until(*lease, now)),
              "lease this axis as well, or leave the token out");
}

}  // namespace axisd
