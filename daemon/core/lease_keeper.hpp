#pragma once

#include <functional>
#include <string>
#include <vector>

#include "devices/axis/axis.hpp"
#include "devices/event.hpp"
#include "devices/lease/lease_table.hpp"

namespace axisd::core {

/// Lets the lease table be felt: tells the axes' gates who commands them, ends leases in time, and makes an
/// event of each change. Thread: core.
class LeaseKeeper {
 public:
  using Find = std::function<Axis*(std::string_view)>;
  using Tell = std::function<void(const std::string& axis, EventContent)>;
  /// `find`: an axis, or nullptr.
  LeaseKeeper(Clock& clock, LeaseSettings settings, std::uint64_t epoch, Find find, Tell tell);
  LeaseKeeper(const LeaseKeeper&) = delete;

  [[nodiscard]] const LeaseTable& table() const { return table_; }
  void configure(LeaseSettings settings) { table_.configure(settings); }

  // As LeaseAccess describes them.
  Result<LeaseGrant> acquire(const LeaseRequest& request);
  Result<Lease> renew(const Requester& holder);
  Result<void> release(const Requester& holder);

  /// No lease ends by itself any more.
  void close();

 private:
  [[nodiscard]] Result<void> check_axes(const LeaseRequest& request) const;
  void end_expired();
  void end(const EndedLease& over, const Lease* next);
  void prolong(const Lease& lease);
  void arm();

  Clock* clock_;
  LeaseTable table_;
  Find find_;
  Tell tell_;
  Clock::Timer timer_;
  TimePoint armed_ = TimePoint::max();
  bool closed_ = false;
};

}  // namespace axisd::core
