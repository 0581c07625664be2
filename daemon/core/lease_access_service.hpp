#pragma once

#include <functional>
#include <vector>

#include "buses/task.hpp"
#include "daemon/core/lease_keeper.hpp"

namespace axisd::core {

/// What the API can ask of the leases: hands it to the core thread. Thread: any, from construction (before
/// the core runs) to destruction (after it ended).
class LeaseAccessService final : public LeaseAccess {
 public:
  /// `keeper` outlives it.
  LeaseAccessService(Executor executor, LeaseKeeper& keeper)
      : executor_(std::move(executor)), keeper_(&keeper) {}

  void acquire(LeaseRequest request, std::function<void(Result<LeaseGrant>)> callback) override;
  void renew(Requester holder, std::function<void(Result<Lease>)> callback) override;
  void release(Requester holder, std::function<void(Result<void>)> callback) override;
  void list(std::function<void(std::vector<Lease>)> callback) override;

 private:
  Executor executor_;
  LeaseKeeper* keeper_;
};

}  // namespace axisd::core
