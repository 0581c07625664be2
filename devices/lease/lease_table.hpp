#pragma once

#include <deque>
#include <map>
#include <string>
#include <string_view>
#include <vector>

#include "devices/lease/lease.hpp"

namespace axisd {

/// Who may command which axis. Pure: time comes with each call, and nothing happens between them; whoever
/// owns the table calls expire() in time. A lease that has run out grants nothing, also before that. Thread:
/// core.
class LeaseTable {
 public:
  /// `epoch`: rises with every start of the daemon, so that tokens of an earlier one are stale for ever.
  LeaseTable(LeaseSettings settings, std::uint64_t epoch);

  /// From now on; leases that were granted keep their time.
  void configure(LeaseSettings settings) { settings_ = settings; }

  /// As LeaseAccess::acquire(), except unknown_axis and busy. A lease is one thing: whoever takes one of its
  /// axes ends it for all of them.
  Result<LeaseGrant> acquire(const LeaseRequest& request, TimePoint now);
  Result<Lease> renew(const Requester& holder, TimePoint now);
  Result<EndedLease> release(const Requester& holder, TimePoint now);
  /// Ends what has run out.
  std::vector<EndedLease> expire(TimePoint now);
  /// When there is something to expire() next; TimePoint::max(): nothing.
  [[nodiscard]] TimePoint next_expiry() const;

  /// Whether `requester` may command the axis. Errors, without the axis's name: lease_required (nobody may
  /// without a lease, it is another's, or the token is of a lease of other axes), lease_lost (it is over).
  [[nodiscard]] Result<void> check(std::string_view axis, const Requester& requester, TimePoint now) const;

  /// Whoever leases the axis; nullptr: nobody.
  [[nodiscard]] const Lease* find(std::string_view axis) const;
  /// Oldest first.
  [[nodiscard]] std::vector<Lease> list() const;

 private:
  using Leases = std::map<std::uint64_t, Lease>;
  [[nodiscard]] const Lease* living(std::string_view axis, TimePoint now) const;
  [[nodiscard]] Result<Duration> ttl_of(const LeaseRequest& request) const;
  /// The lease that an earlier request with this id got; nullptr: there was none, or it is over.
  Result<Lease*> find_repeat(const LeaseRequest& request, TimePoint now);
  Result<Leases::iterator> held_by(const Requester& holder, TimePoint now);
  EndedLease end(Leases::iterator lease, LeaseEnd how, std::string by, TimePoint now);
  [[nodiscard]] Error lost(std::uint64_t token, std::string_view axis, TimePoint now) const;
  [[nodiscard]] static Error held(const Lease& lease, std::string_view axis, const std::string& client,
                                  TimePoint now);

  LeaseSettings settings_;
  std::uint64_t last_token_;
  Leases leases_;  ///< by token, so oldest first
  std::map<std::string, std::uint64_t, std::less<>> by_axis_;
  std::deque<EndedLease> ended_;  ///< the newest, to say what became of them
};

}  // namespace axisd
