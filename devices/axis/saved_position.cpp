#include "devices/axis/saved_position.hpp"

#include <memory>
#include <string>
#include <utility>

#include "devices/axis/restart_mark.hpp"

namespace axisd {

namespace {

/// What an earlier run kept, and this one has not proven yet, still finds a restart of the drive (M1). False:
/// there is nothing.
bool distrust_earlier(Persistence& kept, const std::string& axis) {
  const auto& axes = kept.current().axes;
  const auto found = axes.find(axis);
  if (found == axes.end() || !found->second.offset || found->second.offset->canary.empty()) return false;
  auto record = *found->second.offset;
  record.trust = PositionTrust::unknown;
  kept.save_offset(axis, std::move(record), {});
  return true;
}

}  // namespace

OffsetRecord SavedPosition::offset_record(std::int64_t offset, PositionTrust trust) const {
  // The record speaks of the 32-bit counter: unwrapping begins anew with each start of the daemon.
  // A measured position may not have settled yet.
  const auto counter = shaft_.tracker().resting_counter();
  const auto raw = static_cast<std::int32_t>(counter);
  OffsetRecord record{.offset_pulses = offset + counter - raw,
                      .trust = trust,
                      .last_position_pulses = raw,
                      .pulses_per_revolution = context_.settings.scale.pulses_per_revolution,
                      .invert = context_.settings.scale.invert};
  if (const auto mark = context_.drive->continuity_mark()) record.canary = *mark;
  if (power_.state() == PowerMachine::State::restarted) record.canary = restart_mark();
  return record;
}

void SavedPosition::remember_position() {
  if (context_.env.persistence == nullptr || shaft_.tracker().trust() == PositionTrust::unknown) return;
  context_.env.persistence->save_offset(
      context_.settings.name, offset_record(shaft_.tracker().offset(), shaft_.tracker().trust()), {});
}

/// Returns once a restart finds no position for the axis.
Task<Result<void>> SavedPosition::forget_saved_position() {
  if (context_.env.persistence == nullptr) co_return Result<void>{};
  auto answer = std::make_shared<Promise<Result<void>>>(context_.env.executor, *context_.env.clock);
  context_.env.persistence->forget_offset(context_.settings.name,
                                          [answer](Result<void> result) { answer->set(std::move(result)); });
  co_return co_await answer->get();
}

/// What was saved for a command that then came to nothing: the record says again what the axis goes by.
void SavedPosition::correct_saved_position() {
  if (shaft_.tracker().trust() != PositionTrust::unknown) return remember_position();
  void_saved_position();
}

void SavedPosition::void_saved_position() {
  if (context_.env.persistence == nullptr) return;
  const bool restarted = power_.state() == PowerMachine::State::restarted;
  if (!owns_canary_ && !restarted && distrust_earlier(*context_.env.persistence, context_.settings.name))
    return;
  forget_position(*context_.env.persistence, context_.settings.name, restarted);
  const bool closing = life_.state() == AxisLife::State::closing;
  if (closing)
    keep_canary(PositionTrust::unknown);  // retired, the axis that comes after it goes by the record
}

void SavedPosition::keep_canary(PositionTrust trust) {
  if (context_.env.persistence == nullptr || !owns_canary_ || !context_.drive->continuity_mark()) return;
  context_.env.persistence->save_offset(context_.settings.name,
                                        offset_record(shaft_.tracker().offset(), trust), {});
}

void SavedPosition::drop_canary() {
  if (context_.env.persistence == nullptr || shaft_.tracker().trust() != PositionTrust::unknown) return;
  const auto& axes = context_.env.persistence->current().axes;
  const auto found = axes.find(context_.settings.name);
  const bool kept =
      found != axes.end() && found->second.offset && found->second.offset->canary != restart_mark();
  if (kept) void_saved_position();
}

Task<Result<void>> SavedPosition::journal_offset(std::int64_t offset, PositionTrust trust) {
  if (context_.env.persistence == nullptr) co_return Result<void>{};
  // Shared: the answer may come after this sequence was left.
  auto answer = std::make_shared<Promise<Result<void>>>(context_.env.executor, *context_.env.clock);
  context_.env.persistence->save_offset(context_.settings.name, offset_record(offset, trust),
                                        [answer](Result<void> result) { answer->set(std::move(result)); });
  co_return co_await answer->get();
}

}  // namespace axisd
