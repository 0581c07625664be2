#include "daemon/core/lease_keeper.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <utility>

#include "buses/limited_log.hpp"

namespace axisd::core {

namespace {

Error cause_of(const EndedLease& over) {
  std::string text = fmt::format("the lease of {} was released", over.lease.holder());
  if (over.end == LeaseEnd::expired)
    text = fmt::format("the lease of {} was not renewed in time", over.lease.holder());
  if (over.end == LeaseEnd::taken)
    text = fmt::format("{} took the lease of {}", over.by, over.lease.holder());
  return {.reason = Reason::lease_lost, .message = std::move(text), .remedy = "acquire a lease again"};
}

LeaseChange::What change_of(LeaseEnd end) {
  switch (end) {
    case LeaseEnd::released:
      return LeaseChange::What::released;
    case LeaseEnd::expired:
      return LeaseChange::What::expired;
    case LeaseEnd::taken:
      return LeaseChange::What::taken;
  }
  return LeaseChange::What::released;
}

}  // namespace

LeaseKeeper::LeaseKeeper(Clock& clock, LeaseSettings settings, std::uint64_t epoch, Find find, Tell tell)
    : clock_(&clock), table_(settings, epoch), find_(std::move(find)), tell_(std::move(tell)) {}

/// What somebody does without a lease is only ended by a `take`.
Result<void> LeaseKeeper::check_axes(const LeaseRequest& request) const {
  for (const auto& name : request.axes) {
    const auto* axis = find_(name);
    if (axis == nullptr)
      return fail(Reason::unknown_axis, fmt::format("there is no axis '{}'", name),
                  "list them: axisctl list");
    if (axis->retired())
      return fail(Reason::reloading, fmt::format("{}: its configuration is being reloaded", name),
                  "repeat it in a moment");
    const auto* command = request.take ? nullptr : axis->commanded_without_lease();
    if (command != nullptr)
      return fail(Reason::busy,
                  fmt::format("{}: executes {} {} of {}, given without a lease", name,
                              to_string(command->kind), command->id, command->client),
                  "wait for it, or take the axis over: axisctl lease acquire --take");
  }
  return {};
}

Result<LeaseGrant> LeaseKeeper::acquire(const LeaseRequest& request) {
  if (auto allowed = check_axes(request); !allowed) return fail(allowed.error());
  auto grant = table_.acquire(request, clock_->now());
  if (!grant) return grant;
  const auto& lease = grant->lease;
  for (const auto& over : grant->taken) end(over, &lease);
  prolong(lease);
  if (!grant->repeated) {
    log_limited(spdlog::level::info, lease.client, "leases",
                fmt::format("{} leases {}", lease.holder(), fmt::join(lease.axes, ", ")),
                LogKind::lease_changed, {.client = lease.client});
    for (const auto& name : lease.axes) {
      const bool was_taken = std::ranges::any_of(grant->taken, [&](const EndedLease& over) {
        return over.end == LeaseEnd::taken &&
               std::ranges::find(over.lease.axes, name) != over.lease.axes.end();
      });
      auto change = LeaseChange{.what = LeaseChange::What::acquired, .holder = lease.holder()};
      auto* axis = find_(name);
      if (axis == nullptr) continue;
      if (const auto* command = axis->commanded_without_lease(); command != nullptr) {
        change.what = LeaseChange::What::taken;
        change.before = command->client;
        log_limited(spdlog::level::warn, lease.client, "leases",
                    fmt::format("{}: {} takes the axis over from {} {} of {}", name, lease.holder(),
                                to_string(command->kind), command->id, command->client),
                    LogKind::lease_changed, {.axis = name, .client = lease.client});
        axis->lease_lost({.reason = Reason::lease_lost,
                          .message = fmt::format("{} took the axis over", lease.holder()),
                          .remedy = "acquire a lease"});
      }
      if (!was_taken) tell_(name, std::move(change));
      axis->refresh();
    }
  }
  arm();
  return grant;
}

Result<Lease> LeaseKeeper::renew(const Requester& holder) {
  auto lease = table_.renew(holder, clock_->now());
  if (lease) prolong(*lease);
  return lease;
}

Result<void> LeaseKeeper::release(const Requester& holder) {
  const auto over = table_.release(holder, clock_->now());
  if (!over) return fail(over.error());
  end(*over, nullptr);
  return {};
}

void LeaseKeeper::prolong(const Lease& lease) {
  for (const auto& name : lease.axes)
    if (const auto* axis = find_(name)) axis->gate()->set_fencing_token(lease.token, lease.expires);
}

/// First the gates, so that nothing prepared under it is sent; then each axis does what its policy is.
/// `next`: who has some of the axes from now on, or nullptr.
void LeaseKeeper::end(const EndedLease& over, const Lease* next) {
  const auto cause = cause_of(over);
  const auto level = over.end == LeaseEnd::released ? spdlog::level::info : spdlog::level::warn;
  // Whoever takes leases in a row must not fill the log as somebody else.
  log_limited(level, over.end == LeaseEnd::taken && next != nullptr ? next->client : over.lease.client,
              "leases", fmt::format("{}: {}", fmt::join(over.lease.axes, ", "), cause.message),
              LogKind::lease_changed, {.client = over.lease.client});
  const auto follows = [&](const std::string& axis) {
    return next != nullptr && std::ranges::find(next->axes, axis) != next->axes.end();
  };
  for (const auto& name : over.lease.axes)
    if (const auto* axis = find_(name))
      axis->gate()->set_fencing_token(follows(name) ? next->token : 0,
                                      follows(name) ? next->expires : TimePoint::max());
  for (const auto& name : over.lease.axes) {
    auto* axis = find_(name);
    if (axis == nullptr) continue;  // it ran out just before a reload removed the axis
    axis->lease_lost(cause);
    const bool taken = over.end == LeaseEnd::taken && follows(name);
    tell_(name, LeaseChange{.what = change_of(over.end),
                            .holder = taken ? next->holder() : std::string(),
                            .before = over.lease.holder()});
    axis->refresh();
  }
}

void LeaseKeeper::end_expired() {
  armed_ = TimePoint::max();
  for (const auto& over : table_.expire(clock_->now())) end(over, nullptr);
  arm();
}

/// A renewal only makes it later: the timer then finds nothing to do and is armed anew, which costs less than
/// moving it each time.
void LeaseKeeper::arm() {
  const auto next = table_.next_expiry();
  if (closed_ || next >= armed_) return;
  armed_ = next;
  timer_ = clock_->call_at(next, [this] { end_expired(); });
}

void LeaseKeeper::close() {
  closed_ = true;
  timer_.reset();
}

}  // namespace axisd::core
