#include "daemon/core/lease_access_service.hpp"

#include <utility>

namespace axisd::core {

void LeaseAccessService::acquire(LeaseRequest request, std::function<void(Result<LeaseGrant>)> callback) {
  post(executor_, [this, request = std::move(request), callback = std::move(callback)] {
    callback(keeper_->acquire(request));
  });
}

void LeaseAccessService::renew(Requester holder, std::function<void(Result<Lease>)> callback) {
  post(executor_, [this, holder = std::move(holder), callback = std::move(callback)] {
    callback(keeper_->renew(holder));
  });
}

void LeaseAccessService::release(Requester holder, std::function<void(Result<void>)> callback) {
  post(executor_, [this, holder = std::move(holder), callback = std::move(callback)] {
    callback(keeper_->release(holder));
  });
}

void LeaseAccessService::list(std::function<void(std::vector<Lease>)> callback) {
  post(executor_, [this, callback = std::move(callback)] { callback(keeper_->table().list()); });
}

}  // namespace axisd::core
