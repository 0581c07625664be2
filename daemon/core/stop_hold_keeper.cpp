#include "daemon/core/stop_hold_keeper.hpp"

#include <fmt/format.h>
#include <spdlog/spdlog.h>

#include <utility>
#include <vector>

#include "buses/limited_log.hpp"

namespace axisd::core {

namespace {

Error none_meant(const std::string& axis, const StopHolds& holds, const HoldRelease& release) {
  const auto what = release.request_id.empty() ? std::string() : " by request " + release.request_id;
  if (holds.empty())
    return {.reason = Reason::invalid_argument,
            .message = fmt::format("{}: no stop is held", axis),
            .remedy = "nothing needs to be released"};
  return {.reason = Reason::invalid_argument,
          .message = fmt::format("{}: {} holds no stop{}; it is held by {}", axis, release.client, what,
                                 text_of(holds.all())),
          .remedy = how_to_release(holds.all(), axis, release.client)};
}

/// Tells once, whoever comes first.
std::function<void()> once(std::function<void()> tell) {
  return [kept = std::make_shared<std::function<void()>>(std::move(tell))] {
    if (auto now = std::exchange(*kept, nullptr)) now();
  };
}

}  // namespace

StopHoldKeeper::StopHoldKeeper(Clock& clock, Persistence* persistence, Tell tell,
                               std::function<void(std::string_view)> changed)
    : clock_(&clock), persistence_(persistence), tell_(std::move(tell)), changed_(std::move(changed)) {
  if (persistence_ == nullptr) return;
  for (const auto& [axis, record] : persistence_->loaded().axes) {
    for (const auto& [key, since] : record.holds) holds_[axis].restore(key, since);
    if (!record.holds.empty())
      spdlog::warn("{}: a stop is held since before the start: {}", axis, text_of(holds_[axis].all()));
  }
}

void StopHoldKeeper::add(const std::string& axis, HoldKey key, TimePoint arrived,
                         std::function<void()> settled) {
  auto& holds = holds_[axis];
  const auto before = holds.all().size();
  const auto wait = ++last_wait_;
  const auto hold = holds.add(std::move(key), clock_->wall(clock_->now()), arrived);
  const bool fresh = holds.all().size() != before;
  if (fresh)
    tell_(axis, StopHoldChange{.what = StopHoldChange::What::held, .hold = hold.key, .by = hold.key.holder});
  if (persistence_ == nullptr) return settled ? settled() : void();
  auto told = once(settled ? std::move(settled) : [] {});
  waits_.emplace(wait, clock_->call_at(clock_->now() + longest_wait, told));
  persistence_->save_hold(axis, hold.key, hold.since,
                          [this, alive = std::weak_ptr(alive_), axis, key = hold.key, fresh, wait,
                           told](const Result<void>& result) {
                            if (alive.expired()) return;
                            waits_.erase(wait);
                            saved(axis, key, fresh, result);
                            told();
                          });
}

void StopHoldKeeper::saved(const std::string& axis, const HoldKey& key, bool fresh,
                           const Result<void>& result) {
  const bool news = holds_[axis].set_durable(key, result.has_value());
  if (!result && (fresh || news)) {
    log_about(spdlog::level::err, LogKind::storage_failed, {.axis = axis, .client = key.holder},
              fmt::format("{}: the hold of {} would not survive a restart: {}", axis, key.holder,
                          to_string(result.error())));
    tell_(axis, StopHoldChange{.what = StopHoldChange::What::not_durable, .hold = key, .by = std::string()});
  }
  if (news) changed_(axis);
}

void StopHoldKeeper::release(const std::string& axis, const HoldRelease& release, Done done) {
  auto& holds = holds_[axis];
  auto meant = holds.meant_by(release);
  if (meant.empty()) return done(fail(none_meant(axis, holds, release)));
  auto finish = [this, alive = std::weak_ptr(alive_), axis, meant, by = release.client,
                 done = std::move(done)](const Result<void>& saved) {
    if (alive.expired()) return;
    done(saved ? end(axis, meant, by) : saved);
  };
  if (persistence_ == nullptr) return finish({});
  HoldRecords records;
  for (const auto& hold : meant) records.emplace(hold.key, hold.since);
  persistence_->forget_holds(axis, std::move(records), std::move(finish));
}

Result<void> StopHoldKeeper::end(const std::string& axis, const std::vector<StopHold>& meant,
                                 const std::string& by) {
  auto& holds = holds_[axis];
  bool anew = false;
  for (const auto& hold : meant) {
    if (!holds.end(hold)) {
      anew = true;
      continue;
    }
    log_limited(spdlog::level::info, by, "calls",
                fmt::format("{}: releases the hold of {}{}{}", axis, hold.key.holder,
                            hold.key.request_id.empty() ? "" : " by request ", hold.key.request_id),
                LogKind::hold_changed, {.axis = axis, .client = by});
    tell_(axis, StopHoldChange{.what = StopHoldChange::What::released, .hold = hold.key, .by = by});
  }
  changed_(axis);
  if (!anew) return {};
  return fail(
      Error{.reason = Reason::stopping,
            .message = fmt::format("{}: it was held again meanwhile, by {}", axis, text_of(holds.all())),
            .remedy = "release it again if that is right"});
}

}  // namespace axisd::core
