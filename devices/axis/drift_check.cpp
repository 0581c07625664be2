// What the drive no longer holds as configured, because somebody else changed it.
#include "devices/axis/drift_check.hpp"

#include <fmt/format.h>
#include <spdlog/spdlog.h>

#include "devices/axis/axis_log.hpp"
#include "devices/axis/drive_connection.hpp"
#include "devices/axis/drive_work.hpp"
#include "devices/axis/execution.hpp"
#include "devices/axis/publisher.hpp"
#include "devices/axis/readings.hpp"
#include "devices/axis/sequences.hpp"
#include "devices/axis/state_reader.hpp"
#include "devices/axis/stopper.hpp"

namespace axisd {

/// Soon after the canary was read, if that can be: what a comparison reads would keep the next one waiting.
bool DriftCheck::drift_is_next() const {
  const auto now = context_.env.clock->now();
  return !work_.under_way() && watch_.is_next(now, reader_.continuity().just_proven(now));
}

/// Reads the terminals' functions again now and then, begun at rest: what another master changed is applied
/// again once the drive is released, and forbids motion until then. Nobody waits for it: the state is read
/// meanwhile as ever, also of a motion that begins.
void DriftCheck::look_for_drift() {
  if (!link_.online() || execution_.busy()) return;
  const bool free = !work_.under_way() && shaft_.sample() && !shaft_.sample()->enabled;
  if (watch_.drifted() && free) return connection_.reconfigure(watch_.text(), false);
  if (drift_is_next()) sequences_.launch(compare(), "comparison");
}

/// No start or stop ends or hastens what it reads: it comes to its end however often the axis moves.
Task<> DriftCheck::compare() {
  co_await check_for_drift({.transaction_class = TransactionClass::parameters,
                            .guard = {.gate = comparison_gate_, .epoch = comparison_gate_->epoch()},
                            .of_others = true});
  if (watch_.drifted()) reader_.wake();
}

/// What is being compared would say nothing any more, as the drive is out of reach, or is written to, or
/// keep those waiting who wait for the end of the axis.
void DriftCheck::give_up_comparison() {
  watch_.give_up();
  comparison_gate_->raise();
  context_.env.bus->purge_superseded(context_.settings.node, *comparison_gate_);
}

Task<Result<void>> DriftCheck::check_for_drift(TransactionOptions options) {
  const auto number = watch_.begin(context_.env.clock->now());
  const auto drift = co_await context_.drive->check_drift(std::move(options));
  const bool counts = watch_.end(number);
  if (!drift) co_return fail(drift.error());
  // It was configured or written to meanwhile, or connected anew: what was read before says nothing.
  if (!counts) co_return Result<void>{};
  if (drift->scale_changed) readings_.lose_trust();
  set_drift(drift->text);
  // A motion that was accepted while this was being read goes on without what it relies on.
  if ((drift->scale_changed || drift->limits_changed) && execution_.activity() &&
      execution_.activity()->state != AxisState::standstill) {
    execution_.enter_error_stop(
        context_.error(Reason::misconfigured, "the drive no longer holds its configuration: " + drift->text,
                       "disable the axis: the configuration is then applied again; then reset it"));
    stopper_.begin_stop(StopKind::stop, nullptr);
  }
  co_return Result<void>{};
}

void DriftCheck::applied() {
  watch_.applied(context_.env.clock->now());
  set_drift({});
}

void DriftCheck::set_drift(const std::string& text) {
  if (!watch_.found(text)) return;
  if (!text.empty())
    log_about_axis(
        spdlog::level::warn, LogKind::configuration_drifted, context_.settings,
        fmt::format("{}: the drive no longer holds its configuration: {}", context_.settings.name, text));
  publisher_.publish();
}

}  // namespace axisd
