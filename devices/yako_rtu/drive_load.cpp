// Moves that are loaded first and triggered later, back to back with those of other drives (M22).
#include <algorithm>
#include <utility>

#include "devices/yako_rtu/drive.hpp"
#include "devices/yako_rtu/registers.hpp"
#include "devices/yako_rtu/transactions.hpp"

namespace axisd::yako_rtu {

namespace {

constexpr int attempts = 3;
constexpr std::uint16_t absolute_move = 5;  // 7.6.1: bit 0 position mode, bit 2 absolute

}  // namespace

class YakoRtuDrive::Loaded final : public LoadedMove {
 public:
  Loaded(YakoRtuDrive& drive, MotionBlock block, MotionGuard guard, TimePoint read_at)
      : drive_(&drive), block_(block), guard_(std::move(guard)), read_at_(read_at) {}

  Task<Result<void>> verify() override {
    for (int attempt = 1;; ++attempt) {
      const auto canary = co_await drive_->read_canary(motion());
      if (!canary && canary.error().reason == Reason::no_reply && attempt < attempts) continue;
      if (!canary) {
        auto error = canary.error();
        if (error.outcome == Outcome::unknown) error.outcome = Outcome::not_executed;  // only read
        co_return fail(std::move(error));
      }
      if (!drive_->canary_.is(block_))
        co_return fail(drive_->error_at(Reason::superseded, reg::start_speed,
                                        "the drive was given another motion meanwhile", "repeat the move"));
      read_at_ = canary->sent_at;
      co_return Result<void>{};
    }
  }

  Task<Result<TimePoint>> trigger(TimePoint not_after) override {
    const auto latest = std::min(guard_.not_after, not_after);
    for (int attempt = 1;; ++attempt) {
      if (drive_->clock_->now() + time_to_trigger() > read_at_ + drive_->setup_.reboot_guard)
        if (const auto verified = co_await verify(); !verified) co_return fail(verified.error());
      auto fresh = motion();
      fresh.guard.not_after = std::min(latest, read_at_ + drive_->setup_.reboot_guard);
      const auto written = co_await drive_->node_.write(reg::start, absolute_move, fresh);
      if (written && written->certain) co_return written->request_end;
      if (written) {
        auto error =
            drive_->error_at(Reason::no_reply, reg::start,
                             "the reply to the start may be that of an earlier one", "check the wiring");
        error.outcome = Outcome::unknown;
        co_return fail(std::move(error));
      }
      // Nothing was sent: what it rests on had grown too old.
      const bool grown_old = written.error().reason == Reason::expired && drive_->clock_->now() < latest;
      if (!grown_old || attempt == attempts) co_return drive_->failed(written.error());
    }
  }

 private:
  /// With what the line may still have to do before it, unless it is held: a reading of an axis at rest.
  [[nodiscard]] Duration time_to_trigger() const {
    const auto& line = drive_->node_.bus().settings();
    const auto reading =
        drive_->node_.bus().held() ? ExchangeSize{.request = 0, .reply = 0} : transactions.state;
    const ExchangeSize trigger{};
    return modbus_rtu::wire_time(line, std::size_t{reading.request} + reading.reply + trigger.request) +
           2 * modbus_rtu::silence(line) + drive_->setup_.reboot_guard / 10;
  }
  [[nodiscard]] TransactionOptions motion() const {
    return {.transaction_class = TransactionClass::motion, .guard = guard_};
  }

  YakoRtuDrive* drive_;
  MotionBlock block_;
  MotionGuard guard_;
  TimePoint read_at_;  ///< its canary
};

Task<Result<std::unique_ptr<LoadedMove>>> YakoRtuDrive::load_move(MoveProfile profile, MotionGuard guard) {
  if (const auto mode = check_control_mode(); !mode) co_return fail(mode.error());
  const TransactionOptions motion{.transaction_class = TransactionClass::motion, .guard = guard};
  const auto block = distinct(encode(profile));
  Result<void> loaded;
  TimePoint read_at{};
  for (int attempt = 0; attempt < attempts; ++attempt) {
    const auto canary = co_await read_canary(motion);
    auto fresh = motion;  // as of start_once()
    if (canary) read_at = canary->sent_at;
    if (canary) fresh.guard.not_after = std::min(guard.not_after, read_at + setup_.reboot_guard);
    loaded = canary ? co_await write_canary(block, fresh) : fail(canary.error());
    if (loaded) break;
    const bool grown_old = loaded.error().reason == Reason::expired && clock_->now() < guard.not_after;
    if (!grown_old && loaded.error().reason != Reason::no_reply) break;
  }
  if (!loaded) {
    auto error = loaded.error();
    if (error.outcome == Outcome::unknown) error.outcome = Outcome::not_executed;  // only parameters
    co_return fail(std::move(error));
  }
  co_return std::make_unique<Loaded>(*this, block, std::move(guard), read_at);
}

}  // namespace axisd::yako_rtu
