#include "api/server/lease_service.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <utility>

#include "api/server/convert.hpp"
#include "api/server/pending_call.hpp"
#include "api/server/status.hpp"
#include "api/server/stop_requests.hpp"
#include "api/server/validate.hpp"
#include "api/server/value_reply.hpp"

namespace axisd::server {
namespace {

constexpr std::size_t longest_label = 64;

/// Labels appear in the log and in errors for others: they must not be able to forge lines there.
bool usable_label(std::string_view label) {
  return label.size() <= longest_label &&
         std::ranges::all_of(label, [](char c) { return c >= ' ' && c <= '~'; });
}

/// No group has the name of an axis: the loader sees to that.
Result<std::vector<std::string>> axes_of(const v1::AcquireLeaseRequest& from, Machine& machine) {
  if (from.axes().empty())
    return fail(Reason::invalid_argument, "axes is empty", "name the axes to lease; see ListAxes");
  std::vector<std::string> axes;
  const auto add = [&axes](const std::string& axis) {
    if (std::ranges::find(axes, axis) == axes.end()) axes.push_back(axis);
  };
  const auto groups = machine.group_access().groups();
  for (const auto& name : from.axes()) {
    const auto group = std::ranges::find(groups, name, &GroupSettings::name);
    if (group != groups.end()) {
      std::ranges::for_each(group->axes, add);
    } else if (auto known = find_axis(machine, name); known) {
      add(name);
    } else {
      return fail(known.error());
    }
  }
  return axes;
}

Result<LeaseRequest> lease_request(const v1::AcquireLeaseRequest& from, std::string client,
                                   Machine& machine) {
  auto axes = axes_of(from, machine);
  if (!axes) return fail(axes.error());
  LeaseRequest request{.client = std::move(client),
                       .label = from.label(),
                       .axes = *std::move(axes),
                       .take = from.take(),
                       .request_id = from.request_id()};
  if (!usable_label(from.label()))
    return fail(Reason::invalid_argument, "label is not usable",
                fmt::format("use up to {} printable ASCII characters", longest_label));
  if (!from.request_id().empty())
    if (auto usable = check_request_id(from.request_id(), "request_id"); !usable) return fail(usable.error());
  if (from.has_ttl()) {
    request.ttl = from_proto(from.ttl());
    if (!request.ttl)
      return fail(Reason::invalid_argument, "ttl is not a valid duration",
                  "seconds and nanos must have the same sign and |nanos| be below 10^9");
  }
  return request;
}

}  // namespace

LeaseServiceImpl::LeaseServiceImpl(const Services& services) : BoundedService(services), services_(services) {
  begin_within_bounds(&LeaseServiceImpl::AcquireLease, &LeaseServiceImpl::RenewLease,
                      &LeaseServiceImpl::ReleaseLease, &LeaseServiceImpl::ListLeases);
}

LeaseServiceImpl::Reactor* LeaseServiceImpl::AcquireLease(Context* context,
                                                          const v1::AcquireLeaseRequest* request,
                                                          v1::AcquireLeaseResponse* response) {
  const auto client = client_of(*context);
  auto wanted = lease_request(*request, client, services_.machine);
  if (!wanted) return answer(context, to_status(wanted.error()));
  auto ticket = services_.admission.admit(client, Admission::Kind::motion);
  if (!ticket) return answer(context, to_status(ticket.error()));
  return PendingCall::start(
      services_, context, *std::move(ticket), [&](const std::shared_ptr<PendingCall>& call) {
        auto what = fmt::format("{}: acquire_lease {}", client, fmt::join(wanted->axes, " "));
        services_.machine.lease_access().acquire(
            *std::move(wanted), reply_with_value<LeaseGrant>(
                                    call,
                                    [response, &machine = services_.machine](const LeaseGrant& grant) {
                                      to_proto(grant.lease, machine, *response->mutable_lease());
                                      response->set_lease_token(grant.lease.token);
                                      for (const auto& over : grant.taken)
                                        if (over.end == LeaseEnd::taken)
                                          to_proto(over.lease, machine, *response->add_taken());
                                    },
                                    std::move(what)));
      });
}

LeaseServiceImpl::Reactor* LeaseServiceImpl::RenewLease(Context* context,
                                                        const v1::RenewLeaseRequest* request,
                                                        v1::RenewLeaseResponse* response) {
  return PendingCall::start(services_, context, {}, [&](const std::shared_ptr<PendingCall>& call) {
    handle(services_.machine, *request, who_asks(*context, *request), call, response);
  });
}

LeaseServiceImpl::Reactor* LeaseServiceImpl::ReleaseLease(Context* context,
                                                          const v1::ReleaseLeaseRequest* request,
                                                          v1::ReleaseLeaseResponse*) {
  return PendingCall::start(services_, context, {}, [&](const std::shared_ptr<PendingCall>& call) {
    services_.machine.lease_access().release(
        {.client = client_of(*context), .lease_token = request->lease_token()},
        reply_with_value<void>(call, [] {}));
  });
}

LeaseServiceImpl::Reactor* LeaseServiceImpl::ListLeases(Context* context, const v1::ListLeasesRequest*,
                                                        v1::ListLeasesResponse* response) {
  auto ticket = services_.admission.admit(client_of(*context), Admission::Kind::read);
  if (!ticket) return answer(context, to_status(ticket.error()));
  return PendingCall::start(services_, context, *std::move(ticket),
                            [&](const std::shared_ptr<PendingCall>& call) {
                              services_.machine.lease_access().list(
                                  [call, response, &machine = services_.machine](std::vector<Lease> leases) {
                                    call->complete([response, &machine, leases = std::move(leases)] {
                                      for (const auto& lease : leases)
                                        to_proto(lease, machine, *response->add_leases());
                                      return grpc::Status::OK;
                                    });
                                  });
                            });
}

}  // namespace axisd::server
