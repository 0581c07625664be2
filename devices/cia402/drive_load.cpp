// Moves that are loaded first and triggered later, where drives do not start in one SYNC (M22).
#include <algorithm>
#include <utility>

#include "devices/cia402/drive.hpp"

namespace axisd::cia402 {

namespace {

constexpr int attempts = 3;

}  // namespace

class Cia402Drive::Loaded final : public LoadedMove {
 public:
  /// `own`: StartPdo::guard(), from before the first of it was asked for.
  Loaded(Cia402Drive& drive, MotionGuard guard, MotionGuard own, TimePoint read_at)
      : drive_(&drive),
        block_(drive.canary_.blocks().front()),
        guard_(std::move(guard)),
        own_(std::move(own)),
        read_at_(read_at) {}

  Task<Result<void>> verify() override {
    for (int attempt = 1;; ++attempt) {
      const auto canary = co_await drive_->check_prepared(block_, false, motion());
      if (!canary && canary.error().reason == Reason::no_reply && attempt < attempts) continue;
      if (!canary) {
        auto error = canary.error();
        if (error.outcome == Outcome::unknown) error.outcome = Outcome::not_executed;  // only read
        co_return fail(std::move(error));
      }
      if (may_send(own_, drive_->clock_->now()) != Verdict::send)
        co_return fail(drive_->error_at(Reason::superseded, object::control_word,
                                        "the drive was told something else meanwhile", "repeat the move"));
      read_at_ = *canary;
      co_return Result<void>{};
    }
  }

  Task<Result<TimePoint>> trigger(TimePoint not_after) override {
    const auto latest = std::min(guard_.not_after, not_after);
    for (int attempt = 1;; ++attempt) {
      if (drive_->clock_->now() > read_at_ + drive_->setup_.reboot_guard / 2)
        if (const auto verified = co_await verify(); !verified) co_return fail(verified.error());
      auto fresh = motion();
      fresh.guard.not_after = std::min(latest, read_at_ + drive_->setup_.reboot_guard);
      bool triggered = false;
      const auto pulled = co_await drive_->pull_trigger(
          OperationMode::profile_position, {object::control_word, control::start_word}, fresh, triggered);
      if (pulled) co_return drive_->clock_->now();
      const bool grown_old =
          !triggered && pulled.error().reason == Reason::expired && drive_->clock_->now() < latest;
      if (!grown_old || attempt == attempts) co_return fail(pulled.error());
    }
  }

  Task<> follow_up() override { co_await drive_->acknowledge_set_point(motion()); }

 private:
  [[nodiscard]] SdoOptions motion() const {
    SdoOptions options{.transaction_class = TransactionClass::motion};
    options.guard = guard_;
    return options;
  }

  Cia402Drive* drive_;
  MotionBlock block_;
  MotionGuard guard_, own_;
  TimePoint read_at_;  ///< its canary
};

Task<Result<std::unique_ptr<LoadedMove>>> Cia402Drive::load_move(MoveProfile profile, MotionGuard guard) {
  SdoOptions options{.transaction_class = TransactionClass::motion};
  options.guard = guard;
  const auto block = encode(*model_, setup_.pulses_per_revolution, profile);
  Result<TimePoint> ready;
  for (int attempt = 0; attempt < attempts; ++attempt) {
    give_up_leaving();
    auto own = start_pdo_.guard();
    ready = co_await prepare_start(block, OperationMode::profile_position, std::nullopt, options);
    if (ready) co_return std::make_unique<Loaded>(*this, std::move(guard), std::move(own), *ready);
    if (ready.error().reason != Reason::no_reply) break;
  }
  auto error = ready.error();
  if (error.outcome == Outcome::unknown) error.outcome = Outcome::not_executed;  // only parameters
  co_return fail(std::move(error));
}

}  // namespace axisd::cia402
