#include "daemon/core/motion_inhibit.hpp"

#include <fmt/format.h>

#include <boost/smart_ptr/make_shared.hpp>
#include <utility>

#include "buses/log_about.hpp"
#include "daemon/core/stop_hold_keeper.hpp"

namespace axisd::core {

MotionInhibit::MotionInhibit(Clock& clock, Persistence* persistence, std::function<void(InhibitChange)> tell)
    : clock_(&clock), persistence_(persistence), tell_(std::move(tell)) {
  if (persistence_ == nullptr) return;
  const auto& kept = persistence_->loaded().inhibit;
  set(kept.active, kept.by);
}

void MotionInhibit::set(bool latched, const std::string& by) {
  latched_ = latched;
  by_.store(latched ? boost::make_shared<const std::string>(by) : nullptr);
}

InhibitRecord MotionInhibit::record(bool active, const std::string& by) const {
  return {.active = active, .by = by, .since = clock_->wall(clock_->now())};
}

void MotionInhibit::start() {
  if (latched_) tell_({.what = InhibitChange::What::stands, .by = *by()});
}

void MotionInhibit::latch(const std::string& client, std::function<void(std::optional<Error>)> latched) {
  ++latches_;
  set(true, client);
  if (persistence_ == nullptr) return latched ? latched(std::nullopt) : void();
  // Once, whoever comes first: the disk, or the time.
  auto tell = [kept = std::make_shared<std::function<void(std::optional<Error>)>>(std::move(latched))](
                  std::optional<Error> error) {
    if (auto now = std::exchange(*kept, nullptr)) now(std::move(error));
  };
  waits_.insert_or_assign(latches_, clock_->call_at(clock_->now() + StopHoldKeeper::longest_wait, [tell] {
    tell(Error{.reason = Reason::storage,
               .message = "the latch of StopAll is not on the disk yet",
               .remedy = "keep the machine from moving by other means before the daemon is restarted; "
                         "check the disk"});
  }));
  persistence_->save_inhibit(record(true, client), [this, client, alive = std::weak_ptr(alive_),
                                                    latch = latches_, tell](const Result<void>& saved) {
    if (!saved)
      log_about(spdlog::level::err, LogKind::storage_failed, {.client = client},
                fmt::format("the inhibit would not survive a restart: {}", to_string(saved.error())));
    if (alive.expired()) return;
    waits_.erase(latch);
    if (saved) return tell(std::nullopt);
    tell_({.what = InhibitChange::What::not_durable, .by = client});
    auto error = saved.error();
    error.message = "the latch of StopAll would not outlive a restart of the daemon: " + error.message;
    tell(std::move(error));
  });
}

void MotionInhibit::release(const std::string& client, std::function<void(Result<void>)> done) {
  auto release = [this, client, alive = std::weak_ptr(alive_), latch = latches_,
                  done = std::move(done)](const Result<void>& saved) {
    if (alive.expired()) return;
    // A latch that came while this was being saved is nobody's to release but by a release of its own.
    if (latch != latches_)
      return done(fail(Reason::inhibited, fmt::format("StopAll was called again by {}", *by()),
                       "release it again if that is right"));
    if (saved) set(false, client);
    done(saved);
  };
  if (persistence_ == nullptr) return release({});
  persistence_->save_inhibit(record(false, client), std::move(release));
}

}  // namespace axisd::core
