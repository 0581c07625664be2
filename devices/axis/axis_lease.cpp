// Who may command the axis, and what it does when the lease that it was commanded under ends.
#include <fmt/format.h>
#include <spdlog/spdlog.h>

#include "devices/axis/axis.hpp"
#include "devices/axis/axis_log.hpp"

namespace axisd {

namespace {

/// Ends by itself, where its request said.
bool is_bounded(CommandKind kind) {
  return kind == CommandKind::home || kind == CommandKind::move_absolute ||
         kind == CommandKind::move_relative || kind == CommandKind::move_group;
}

}  // namespace

Result<void> Axis::check_lease(const Requester& requester) const {
  const auto allowed =
      context_.env.leases->check(context_.settings.name, requester, context_.env.clock->now());
  if (allowed) return {};
  return fail(context_.error(allowed.error().reason, allowed.error().message, allowed.error().remedy));
}

const Command* Axis::commanded_without_lease() const {
  if (!activity_ || activity_->options.lease_token != 0) return nullptr;
  const auto& command = activity_->command->value();
  return command.kind == CommandKind::disable ? nullptr : &command;
}

/// What `finish` lets go on is past its start: the drive moves by itself, and nothing more is sent for it
/// (the search after a homing's back-off, say).
void Axis::lease_lost(const Error& cause) {
  const auto* command = activity_ ? &activity_->command->value() : nullptr;
  auto policy = context_.settings.on_lease_loss;
  if (policy == LeaseLoss::finish) {
    if (command == nullptr) return;
    if (is_bounded(command->kind) && command->state == CommandState::active) {
      activity_->lease_over = true;
      drop_buffer(context_.error(cause.reason, cause.message, cause.remedy));
      return;
    }
    policy = LeaseLoss::halt;
  }
  if (policy == LeaseLoss::disable) {
    // An enable may be on its way to the drive, which then shows it some time later.
    const bool enabling = command != nullptr && command->kind == CommandKind::enable;
    power_.owe_release(context_.env.clock->now() + (enabling ? EnableMachine::shows_within : Duration{}));
  }
  if (command != nullptr && command->kind == CommandKind::disable) return;  // it needs no lease
  const bool motion = activity_ && activity_->state != AxisState::standstill;
  // What a terminal moves was not commanded under the lease.
  const bool moves = motion || stop_.under_way() || stop_.owed() ||
                     (shaft_.sample() && shaft_.sample()->moving && !shaft_.terminal_motion().moves());
  note_motion_to_stop();
  supersede(context_.error(cause.reason, cause.message, cause.remedy));
  release_as_owed();
  if (moves && !activity_) begin_stop(policy == LeaseLoss::halt ? StopKind::halt : StopKind::stop, nullptr);
  publish();
}

/// `on_lease_loss: disable` is done once the drive shows that it is released: whatever comes between (a stop,
/// silence, an enable that was on its way) only puts it off.
void Axis::release_as_owed() {
  if (!link_.online() || activity_ || stop_.owed() || !shaft_.sample()) return;
  if (!power_.look(*shaft_.sample())) return;
  accept_epoch_ = context_.gate->epoch();
  (void)accept(DisableRequest{}, {.client = "axisd, as on_lease_loss says"});
}

/// The drive took part, and is not released: trying again and again would help nobody.
void Axis::give_up_release(const Error& cause) {
  if (!power_.owes_release() || cause.outcome == Outcome::unknown) return;
  power_.give_up();
  log_about_axis(spdlog::level::err, LogKind::axis_fault, context_.settings,
                 fmt::format("{}: the lease ended, and the drive was not released: {}",
                             context_.settings.name, to_string(cause)));
  if (!fault_) fault_ = cause;
}

}  // namespace axisd
