#include "daemon/core/state_gate.hpp"

#include <fmt/format.h>
#include <spdlog/spdlog.h>

#include <boost/smart_ptr/make_shared.hpp>
#include <utility>

#include "buses/log_about.hpp"

namespace axisd::core {

StateGate::StateGate(Persistence* persistence, std::function<void(KeptStateChange)> tell,
                     std::function<void()> changed)
    : persistence_(persistence), tell_(std::move(tell)), changed_(std::move(changed)) {
  if (persistence_ != nullptr) set(persistence_->loaded().convictions);
}

void StateGate::set(std::vector<Conviction> convictions) {
  convictions_ = std::move(convictions);
  refusal_.reset();
  if (!convictions_.empty()) refusal_ = state_unaccepted(convictions_);
  unaccepted_.store(convictions_.empty() ? nullptr
                                         : boost::make_shared<const std::string>(to_string(convictions_)));
}

void StateGate::start() {
  if (convictions_.empty()) return;
  log_about(spdlog::level::err, LogKind::state_convicted, {},
            fmt::format("motion waits until the state is accepted (axisctl state accept): {}",
                        to_string(convictions_)));
  tell_({.convictions = convictions_, .accepted_by = {}});
}

KeptStateReport StateGate::report() const {
  KeptStateReport report{.convictions = convictions_};
  if (persistence_ == nullptr) return report;
  report.seen = persistence_->seen();
  report.start_count = persistence_->loaded().start_count;
  return report;
}

void StateGate::accept(const std::string& client, const Done& done) {
  if (convictions_.empty()) return done(std::vector<Conviction>{});
  persistence_->accept_state([this, alive = std::weak_ptr(alive_), client, done](const Result<void>& saved) {
    if (alive.expired()) return;
    if (!saved) return done(fail(saved.error()));
    // Somebody else may have been first.
    auto accepted = std::exchange(convictions_, {});
    set({});
    if (!accepted.empty()) {
      log_about(spdlog::level::warn, LogKind::state_accepted, {.client = client},
                fmt::format("{} accepts the state as it is: {}", client, to_string(accepted)));
      tell_({.convictions = accepted, .accepted_by = client});
      changed_();
    }
    done(std::move(accepted));
  });
}

}  // namespace axisd::core
