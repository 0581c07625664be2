// Starts in common with other drives, by SYNC (M22, M24): the control word comes by an RPDO that waits in the
// drive for it.
#include <fmt/format.h>

#include <algorithm>
#include <utility>

#include "devices/cia402/drive.hpp"

namespace axisd::cia402 {

namespace {

using canopen::CanopenBus;
using std::chrono::milliseconds;

constexpr std::size_t word_bytes = 2;
/// A drive that is to leave its control word as it is has had time to change it after this.
constexpr auto unmoved_time = milliseconds(5);
constexpr auto taken_limit = milliseconds(50);

canopen::SdoOptions urgent() { return {.transaction_class = TransactionClass::motion}; }

}  // namespace

/// One drive's move, until it is started or superseded.
class Cia402Drive::Prepared final : public PreparedMove {
 public:
  /// `own`: StartPdo::guard(), from before the first of it was asked for.
  Prepared(Cia402Drive& drive, MotionGuard guard, MotionGuard own)
      : drive_(&drive),
        block_(drive.canary_.blocks().front()),
        guard_(std::move(guard)),
        own_(std::move(own)) {}

  Task<Result<TimePoint>> start_with(std::vector<PreparedMove*> others, StartWindow window) override {
    auto members = members_of(others);
    if (!members) co_return fail(members.error());
    Members all{.moves = std::move(*members), .parts = {}, .refusal = {}, .not_after = window.not_after};
    all.parts.resize(all.moves.size());
    co_await at_once(all, [&all](std::size_t i) { return all.moves[i]->check(all, i); });
    if (all.refusal) co_return fail(std::move(*all.refusal));
    for (auto* move : all.moves) move->begin();
    auto started = co_await drive_->bus_->start_together(all.parts, window.not_before);
    for (auto* move : all.moves) move->end();
    const bool may_run = !started && started.error().outcome == Outcome::unknown;
    if (started) co_await at_once(all, [&](std::size_t i) { return all.moves[i]->follow_up(*started); });
    if (may_run) co_await at_once(all, [&](std::size_t i) { return all.moves[i]->stop(); });
    co_return started;
  }

 private:
  struct Members {
    std::vector<Prepared*> moves;
    std::vector<canopen::SyncStart> parts;
    std::optional<Error> refusal;
    TimePoint not_after;
  };

  [[nodiscard]] Result<std::vector<Prepared*>> members_of(const std::vector<PreparedMove*>& others) {
    std::vector<Prepared*> all{this};
    for (auto* other : others) {
      auto* one = dynamic_cast<Prepared*>(other);
      const bool fits = one != nullptr && one->drive_->bus_ == drive_->bus_;
      if (!fits || std::ranges::find(all, one->drive_, &Prepared::drive_) != all.end())
        return fail(drive_->error_at(Reason::invalid_argument, object::control_word,
                                     "these moves cannot start together",
                                     "start drives of one bus together, each once"));
      all.push_back(one);
    }
    return all;
  }

  Task<> at_once(const Members& all, std::function<Task<>(std::size_t)> what) {
    return canopen::for_each_at_once(drive_->executor_, *drive_->clock_, all.moves.size(), std::move(what));
  }

  /// The last look before the trigger; what it found counts for reboot_guard (M6).
  Task<> check(Members& all, std::size_t index) {
    auto& drive = *drive_;
    auto options = urgent();
    options.guard = guard_;
    const auto canary = co_await drive.check_prepared(block_, true, options);
    auto guard = guard_;
    if (canary)
      guard.not_after = std::min({guard.not_after, all.not_after, *canary + drive.setup_.reboot_guard});
    const bool superseded = may_send(own_, drive.clock_->now()) != Verdict::send;
    if (superseded || !canary) {
      if (!all.refusal)
        all.refusal = canary
                          ? drive.error_at(Reason::superseded, object::control_word,
                                           "the drive was told something else meanwhile", "prepare it again")
                          : canary.error();
      co_return;
    }
    all.parts[index] = {.node = drive.node_.id(),
                        .cob_id = *drive.start_pdo_.id(),
                        .arm = canopen::number_bytes(control::start_word, word_bytes),
                        .guards = {guard, own_},
                        .neutral = [&drive] { return drive.neutral_bytes(); },
                        .confirm = [&drive] { return drive.confirm_started(); }};
  }

  /// Nobody knows the control word until the end.
  void begin() {
    stops_ = drive_->stops_.count();
    (void)drive_->words_.begin_write(std::nullopt);
    drive_->stops_.begin_trigger();
  }
  void end() {
    drive_->words_.end_write(drive_->clock_->now());
    drive_->stops_.end_trigger();
    drive_->give_up_common_start();  // once only
  }

  Task<> follow_up(TimePoint at) {
    if (stops_ != drive_->stops_.count()) co_return;
    drive_->note_move_began(at);
    auto options = urgent();
    options.guard = guard_;
    co_await drive_->acknowledge_set_point(options);
  }

  Task<> stop() {
    drive_->motion_.doubt();  // it may have started
    (void)co_await drive_->stop(StopKind::stop);
  }

  Cia402Drive* drive_;
  MotionBlock block_;
  MotionGuard guard_, own_;
  std::uint64_t stops_ = 0;
};

Task<Result<std::unique_ptr<PreparedMove>>> Cia402Drive::prepare_move(MoveProfile profile,
                                                                      MotionGuard guard) {
  give_up_leaving();
  if (start_pdo_.state() != StartPdo::State::proven)
    co_return fail(error_at(Reason::not_supported, object::control_word,
                            "no start by SYNC: " + start_pdo_.note(), "start it by itself"));
  auto own = start_pdo_.guard();
  const auto block = encode(*model_, setup_.pulses_per_revolution, profile);
  SdoOptions options = urgent();
  options.guard = guard;
  const auto ready = co_await prepare_start(block, OperationMode::profile_position, std::nullopt, options);
  if (!ready) {
    auto error = ready.error();
    if (error.outcome == Outcome::unknown) error.outcome = Outcome::not_executed;  // only parameters
    co_return fail(std::move(error));
  }
  co_return std::make_unique<Prepared>(*this, std::move(guard), std::move(own));
}

/// All that prepare_move() left stands there still, and the motor at rest.
Task<Result<TimePoint>> Cia402Drive::check_prepared(MotionBlock block, bool by_sync, SdoOptions options) {
  const auto word = co_await read_object(object::status_word, options);
  if (!word) co_return fail(word.error());
  const auto control = co_await read_object(object::control_word, options);
  if (!control) co_return fail(control.error());
  const auto mode = co_await read_object(object::mode_display, options);
  if (!mode) co_return fail(mode.error());
  std::int64_t moving = (*word & model_->status.moving) != 0 ? 1 : 0;
  if (model_->objects.moving) {
    const auto shown = co_await read_object(*model_->objects.moving, options);
    if (!shown) co_return fail(shown.error());
    moving = *shown;
  }
  const auto state = state_of(static_cast<std::uint16_t>(*word));
  if (state != State::operation_enabled) co_return fail(not_enabled(state));
  const auto canary = co_await prove_block(std::move(options));  // last: it is what grows old
  if (!canary) co_return canary;
  const auto nmt = bus_->master().nmt().status(node_.id()).state;
  const bool listens = nmt == canopen::NmtState::operational || nmt == canopen::NmtState::unknown;
  const bool ready = moving == 0 && *control == control_word(ControlCommand::enable_operation) &&
                     *mode == std::to_underlying(OperationMode::profile_position);
  if (ready && (!by_sync || (listens && start_pdo_.id())) && canary_.is(block)) co_return canary;
  co_return fail(
      error_at(Reason::superseded, object::control_word,
               fmt::format("not as it was prepared (control word {:04X}h, mode {}{}{})", *control, *mode,
                           moving != 0 ? ", moving" : "", listens || !by_sync ? "" : ", no PDOs"),
               "prepare it again"));
}

/// The SYNC was taken where the word stands that waited for it: bit 4 goes back only after this.
Task<Result<void>> Cia402Drive::confirm_started() {
  const auto word = co_await read_object(object::control_word, urgent());
  if (!word) co_return fail(word.error());
  if (*word == control::start_word) co_return Result<void>{};
  co_return fail(
      error_at(Reason::not_confirmed, object::control_word,
               fmt::format("the control word reads {:04X}h after the SYNC of a common start", *word),
               "the drives of the start are stopped"));
}

canopen::Bytes Cia402Drive::neutral_bytes() const {
  const auto bits = words_.state_bits().value_or(control_word(ControlCommand::enable_operation));
  return canopen::number_bytes(bits | control::halt, word_bytes);
}

void Cia402Drive::give_up_common_start() {
  start_pdo_.give_up();
  bus_->purge_superseded(node_.id(), start_pdo_.gate());
}

Task<> Cia402Drive::follow_waiting(std::uint16_t word) {
  if (!start_pdo_.id() || !bus_->armed(node_.id())) co_return;
  const auto quiet = static_cast<std::uint16_t>(word & ~(control::start | control::fault_reset));
  (void)co_await bus_->send_waiting(node_.id(), *start_pdo_.id(), canopen::number_bytes(quiet, word_bytes),
                                    {.transaction_class = TransactionClass::stop});
}

/// Before anything is begun: nothing waits in the drive that a later SYNC could set against it.
Task<Result<void>> Cia402Drive::settle_armed(SdoOptions options) {
  if (!bus_->armed(node_.id())) co_return Result<void>{};
  co_return co_await settle(std::move(options));
}

/// The manual does not say whether the type of an RPDO counts (YSS-C), so the drive shows it. It does so
/// released, with bit 8, which means nothing there, and while nothing else waits for a SYNC on the network.
/// Whatever is begun with the drive ends it, and waits in settle() until it has let go of the node.
Task<> Cia402Drive::prove_common_start(MotionGuard unbegun) {
  const SdoOptions options{.transaction_class = TransactionClass::parameters, .guard = std::move(unbegun)};
  // Twice: SYNC is not held for nothing, and others may have held it for long.
  auto obstacle = co_await obstacle_to_proof(options);
  std::shared_ptr<void> hold;
  if (obstacle.empty()) {
    hold = co_await bus_->hold_sync();
    obstacle = co_await obstacle_to_proof(options);
  }
  if (!obstacle.empty()) co_return start_pdo_.note_obstacle(obstacle);
  if (start_pdo_.state() != StartPdo::State::unproven) co_return;
  const auto held = co_await read_object(object::control_word, options);
  const bool begun = may_send(options.guard, clock_->now()) != Verdict::send;
  if (!held || begun || start_pdo_.work() != StartPdo::Work::none) co_return;
  start_pdo_.begin(StartPdo::Work::proving);
  co_await show_and_judge(static_cast<std::uint16_t>(*held), options);
  start_pdo_.end_work();
  news_.notify_all();
}

Task<> Cia402Drive::show_and_judge(std::uint16_t held, SdoOptions options) {
  // Until it has shown all of it, SYNC goes on only after what waits in it was thrown away.
  bus_->set_armed(node_.id(), true);
  (void)words_.begin_write(std::nullopt);
  const auto shown = co_await show_common_start(held, options);
  words_.end_write(clock_->now());
  if (!shown) co_return start_pdo_.note_obstacle(shown.error().message);
  start_pdo_.judge(*shown);
  if (start_pdo_.state() == StartPdo::State::proven)
    co_return bus_->set_readiness(node_.id(), CanopenBus::Readiness::settled);
  (void)co_await write_object(object::control_word, held, word_bytes, std::move(options));
}

Task<std::string> Cia402Drive::obstacle_to_proof(SdoOptions options) {
  if (const auto objection = bus_->objection_to_sync()) co_return objection->message;
  const auto word = co_await read_object(object::status_word, std::move(options));
  if (!word) co_return word.error().message;
  const auto status = static_cast<std::uint16_t>(*word);
  const auto state = state_of(status);
  const bool released = state == State::switch_on_disabled || state == State::ready_to_switch_on;
  if (released && (status & (model_->status.enabled | model_->status.moving)) == 0) co_return std::string();
  co_return fmt::format("it is shown while the drive is released, and that is in {}", to_string(state));
}

struct Cia402Drive::ShownStep {
  std::vector<std::uint16_t> words;  ///< that wait for a SYNC
  bool restored = false;             ///< the old word was written since the last SYNC
  bool pre_operational = false;      ///< was passed since they came
  bool synced = true;
  std::uint16_t after = 0;  ///< what the control word is to be then
  const char* otherwise = "";
};

/// The text: in what the drive differs from CiA 301; empty: in nothing that a start needs.
Task<Result<std::string>> Cia402Drive::show_common_start(std::uint16_t held, SdoOptions options) {
  const auto other = static_cast<std::uint16_t>(held ^ control::halt);
  const ShownStep steps[] = {
      {.words = {other}, .synced = false, .after = held, .otherwise = "its RPDO acts before the SYNC"},
      {.words = {held}, .after = held, .otherwise = "of several RPDOs before a SYNC not the last one counts"},
      {.words = {other}, .after = other, .otherwise = "a SYNC does not make its RPDO act"},
      {.words = {}, .restored = true, .after = held, .otherwise = "its RPDO acts again with a later SYNC"},
      {.words = {other},
       .pre_operational = true,
       .after = held,
       .otherwise = "what waits for a SYNC outlives Pre-Operational"}};
  for (const auto& step : steps) {
    const auto as_wanted = co_await show_step(step, held, options);
    if (!as_wanted) co_return fail(as_wanted.error());
    if (!*as_wanted) co_return std::string(step.otherwise);
  }
  co_return std::string();
}

Task<Result<bool>> Cia402Drive::show_step(ShownStep step, std::uint16_t held, SdoOptions options) {
  if (step.restored)
    if (const auto back = co_await write_object(object::control_word, held, word_bytes, options); !back)
      co_return fail(back.error());
  for (const auto word : step.words)
    if (const auto sent = co_await let_wait(word, options); !sent) co_return fail(sent.error());
  if (step.pre_operational) {
    if (const auto left = co_await leave_operational(false); !left) co_return fail(left.error());
    if (const auto back = co_await enter_operational(); !back) co_return fail(back.error());
  }
  if (step.synced) {
    const auto sent =
        co_await bus_->send_sync({.transaction_class = TransactionClass::motion, .guard = options.guard});
    if (!sent) co_return fail(sent.error());
  }
  co_return co_await shows(step.after, step.after == held, std::move(options));
}

Task<Result<void>> Cia402Drive::let_wait(std::uint16_t word, SdoOptions options) {
  const auto pdo = start_pdo_.id();
  if (!pdo)
    co_return fail(error_at(Reason::superseded, object::control_word, "its PDOs were lost meanwhile",
                            "it is shown again when the drive is configured"));
  const auto sent = co_await bus_->send_waiting(
      node_.id(), *pdo, canopen::number_bytes(word, word_bytes),
      {.transaction_class = TransactionClass::motion, .guard = std::move(options.guard)});
  if (!sent) co_return fail(sent.error());
  co_return Result<void>{};
}

/// Whether the control word reads `word`: after a while, or (`stays` false) within one.
Task<Result<bool>> Cia402Drive::shows(std::uint16_t word, bool stays, SdoOptions options) {
  if (stays) co_await sleep_until(executor_, *clock_, clock_->now() + unmoved_time);
  const auto fits = [word](std::int64_t shown) { return shown == word; };
  const auto shown =
      co_await read_until(object::control_word, fits, stays ? Duration{} : taken_limit, std::move(options));
  if (!shown) co_return fail(shown.error());
  co_return fits(*shown);
}

}  // namespace axisd::cia402
