// A lease: one client's exclusive, expiring right to command some axes.
#pragma once

#include <cstdint>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "buses/clock.hpp"
#include "buses/error.hpp"
#include "devices/access.hpp"

namespace axisd {

/// What the configuration says of leases: `control:` and `leases:`.
struct LeaseSettings {
  bool required = false;  ///< `control: leased`: nothing moves without one
  Duration shortest_ttl = std::chrono::milliseconds(100);
  Duration default_ttl = std::chrono::seconds(2);
  Duration longest_ttl = std::chrono::seconds(60);
};

struct Lease {
  std::uint64_t token = 0;  ///< fencing token; never 0, and greater than all before it, also over restarts
  std::string client;       ///< identity of its holder
  std::string label;        ///< the holder's own words
  std::vector<std::string> axes;
  std::string request_id;  ///< of the request that acquired it; may be empty
  Duration ttl{};
  TimePoint acquired{}, expires{};

  /// "operator (panel 2)".
  [[nodiscard]] std::string holder() const { return label.empty() ? client : client + " (" + label + ")"; }
};

/// Who asks for something that a lease may be needed for, and under which one.
struct Requester {
  std::string client;
  std::uint64_t lease_token = 0;  ///< 0: under none
  CallOriginPtr origin{};         ///< nullptr: not known
};

struct LeaseRequest {
  std::string client, label;
  std::vector<std::string> axes;  ///< at least one, each once
  std::optional<Duration> ttl{};
  bool take = false;         ///< from whoever has them now
  std::string request_id{};  ///< a repeat gets the lease that the first one got; may be empty
};

enum class LeaseEnd : std::uint8_t { released, expired, taken };

/// A lease that is over.
struct EndedLease {
  Lease lease;
  LeaseEnd end = LeaseEnd::released;
  std::string by;  ///< who took it
  TimePoint at{};
};

struct LeaseGrant {
  Lease lease;
  std::vector<EndedLease> taken{};  ///< from others
  bool repeated = false;            ///< it was there already: an earlier request of this id
};

/// Part of Machine. Thread: any; callbacks arrive on the core thread, exactly once.
class LeaseAccess {
 public:
  virtual ~LeaseAccess() = default;

  /// All axes or none. Errors: unknown_axis, out_of_range (ttl), lease_required (held by another: says who
  /// and how long still), busy (an axis executes a command that was given without a lease),
  /// request_id_conflict.
  virtual void acquire(LeaseRequest request, std::function<void(Result<LeaseGrant>)> callback) = 0;
  /// Its ttl counts anew. Errors: lease_lost (says how, and who has the axes now), lease_required (it is
  /// another client's).
  virtual void renew(Requester holder, std::function<void(Result<Lease>)> callback) = 0;
  /// Errors: as renew().
  virtual void release(Requester holder, std::function<void(Result<void>)> callback) = 0;
  /// Oldest first.
  virtual void list(std::function<void(std::vector<Lease>)> callback) = 0;
};

}  // namespace axisd
