// Who may command the axis, and what it does when the lease that it was commanded under ends.
#include "devices/axis/axis.hpp"

namespace axisd {

namespace {

/// Ends by itself, where its request said.
bool is_bounded(CommandKind kind) {
  return kind == CommandKind::home || kind == CommandKind::move_absolute ||
         kind == CommandKind::move_relative;
}

}  // namespace

Result<void> Axis::check_lease(const Requester& requester) const {
  const auto allowed = env_.leases->check(settings_.name, requester, env_.clock->now());
  if (allowed) return {};
  return fail(error(allowed.error().reason, allowed.error().message, allowed.error().remedy));
}

const Command* Axis::commanded_without_lease() const {
  if (!activity_ || activity_->options.lease_token != 0) return nullptr;
  const auto& command = activity_->command->value();
  return command.kind == CommandKind::disable ? nullptr : &command;
}

/// What `finish` lets go on is past its start: the drive moves by itself, and whatever would have to be sent
/// for it carries a token that the gate no longer knows (the search after a homing's back-off, say).
void Axis::lease_lost(const Error& cause) {
  const auto* command = activity_ ? &activity_->command->value() : nullptr;
  if (command != nullptr && command->kind == CommandKind::disable) return;  // it needs no lease
  auto policy = settings_.on_lease_loss;
  if (policy == LeaseLoss::finish) {
    if (command == nullptr) return;
    if (is_bounded(command->kind) && command->state == CommandState::active) return;
    policy = LeaseLoss::halt;
  }
  const bool rests = at_rest();
  const auto shown = activity_ ? activity_->state : AxisState::standstill;
  accept_epoch_ = gate_->epoch();
  supersede(error(cause.reason, cause.message, cause.remedy));
  if (policy == LeaseLoss::disable && sample_ && sample_->enabled && link_ != LinkState::offline) {
    (void)accept(DisableRequest{}, {.client = "axisd, as on_lease_loss says"});
  } else if (!rests) {
    stopping_.shown = shown;
    begin_stop(policy == LeaseLoss::halt ? StopKind::halt : StopKind::stop, false, nullptr);
  }
  publish();
}

}  // namespace axisd
