#include "api/axisctl/commission/held_lease.hpp"

#include <chrono>

#include "api/axisctl/duration.hpp"
#include "axisd/v1/lease_service.grpc.pb.h"

namespace axisd::axisctl::commission {
namespace {

using std::chrono::milliseconds;
using Stub = v1::LeaseService::Stub;

/// Renewals per time to live. One may be late by as much again; where the call fails it is repeated soon.
constexpr int renewals = 3;
constexpr int repeats = 10;  // per renewal

}  // namespace

HeldLease::HeldLease(const Client& client, const std::string& axis, const std::string& label)
    : client_(client) {
  v1::AcquireLeaseRequest request;
  request.add_axes(axis);
  request.set_label(label);
  request.set_request_id(random_uuid());
  const auto response = client.call(&Stub::AcquireLease, request, axis);
  token_ = response.lease_token();
  const auto& ttl = response.lease().ttl();
  pause_ =
      std::max(milliseconds((ttl.seconds() * 1000 + ttl.nanos() / 1'000'000) / renewals), milliseconds(1));
  thread_ = std::thread([this] { renew_until_closed(); });
}

HeldLease::~HeldLease() {
  {
    const std::lock_guard lock(mutex_);
    closing_ = true;
  }
  closing_changed_.notify_all();
  thread_.join();
  v1::ReleaseLeaseRequest request;
  request.set_lease_token(token_);
  try {
    client_.call_within(pause_ * renewals, &Stub::ReleaseLease, request, {});
  } catch (const Failure&) {  // NOLINT(bugprone-empty-catch)
    // It ends by itself, when its time is over.
  }
}

std::string HeldLease::lost() const {
  const std::lock_guard lock(mutex_);
  return lost_;
}

void HeldLease::renew_until_closed() {
  v1::RenewLeaseRequest request;
  request.set_lease_token(token_);
  std::unique_lock lock(mutex_);
  auto pause = pause_;
  while (!closing_changed_.wait_for(lock, pause, [this] { return closing_; }) && lost_.empty()) {
    lock.unlock();
    std::string why;
    try {
      client_.call_within(pause_ * (renewals - 1), &Stub::RenewLease, request, {});
      pause = pause_;
    } catch (const Failure& failure) {
      // What was only late is tried again; the daemon knows when it is too late.
      if (failure.code() == ExitCode::refused) why = failure.what();
      pause = std::max(pause_ / repeats, milliseconds(1));
    }
    lock.lock();
    lost_ = why;
  }
}

}  // namespace axisd::axisctl::commission
