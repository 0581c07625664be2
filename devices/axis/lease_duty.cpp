// Who may command the axis, and what it does when the lease that it was commanded under ends.
#include "devices/axis/lease_duty.hpp"

#include <fmt/format.h>
#include <spdlog/spdlog.h>

#include "devices/axis/acceptance.hpp"
#include "devices/axis/axis_log.hpp"
#include "devices/axis/execution.hpp"
#include "devices/axis/publisher.hpp"
#include "devices/axis/stopper.hpp"

namespace axisd {

namespace {

/// Ends by itself, where its request said.
bool is_bounded(CommandKind kind) {
  return kind == CommandKind::home || kind == CommandKind::move_absolute ||
         kind == CommandKind::move_relative || kind == CommandKind::move_group;
}

}  // namespace

const Command* LeaseDuty::commanded_without_lease() const {
  if (!execution_.activity() || execution_.activity()->options.lease_token != 0) return nullptr;
  const auto& command = execution_.activity()->command->value();
  return command.kind == CommandKind::disable ? nullptr : &command;
}

/// What `finish` lets go on is past its start: the drive moves by itself, and nothing more is sent for it
/// (the search after a homing's back-off, say).
void LeaseDuty::lease_lost(const Error& cause) {
  const auto* command = execution_.activity() ? &execution_.activity()->command->value() : nullptr;
  auto policy = context_.settings.on_lease_loss;
  if (policy == LeaseLoss::finish) {
    if (command == nullptr) return;
    if (is_bounded(command->kind) && command->state == CommandState::active) {
      execution_.activity()->lease_over = true;
      execution_.drop_buffer(context_.error(cause.reason, cause.message, cause.remedy));
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
  const bool motion = execution_.activity() && execution_.activity()->state != AxisState::standstill;
  // What a terminal moves was not commanded under the lease.
  const bool moves = motion || stop_.under_way() || stop_.owed() ||
                     (shaft_.sample() && shaft_.sample()->moving && !shaft_.terminal_motion().moves());
  execution_.note_motion_to_stop();
  execution_.supersede(context_.error(cause.reason, cause.message, cause.remedy));
  release_as_owed();
  if (moves && !execution_.activity())
    stopper_.begin_stop(policy == LeaseLoss::halt ? StopKind::halt : StopKind::stop, nullptr);
  publisher_.publish();
}

/// `on_lease_loss: disable` is done once the drive shows that it is released: whatever comes between (a stop,
/// silence, an enable that was on its way) only puts it off.
void LeaseDuty::release_as_owed() {
  if (!link_.online() || execution_.activity() || stop_.owed() || !shaft_.sample()) return;
  if (!power_.look(*shaft_.sample())) return;
  acceptance_.release({.client = "axisd, as on_lease_loss says"});
}

/// The drive took part, and is not released: trying again and again would help nobody.
void LeaseDuty::give_up_release(const Error& cause) {
  if (!power_.owes_release() || cause.outcome == Outcome::unknown) return;
  power_.give_up();
  log_about_axis(spdlog::level::err, LogKind::axis_fault, context_.settings,
                 fmt::format("{}: the lease ended, and the drive was not released: {}",
                             context_.settings.name, to_string(cause)));
  execution_.note_fault(cause);
}

}  // namespace axisd
