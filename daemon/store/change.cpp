#include "daemon/store/change.hpp"

namespace axisd::store {
namespace {

struct Apply {
  StoredState& state;
  void operator()(const SetOffset& change) const { state.axes[change.axis].offset = change.offset; }
  void operator()(const ForgetOffset& change) const { state.axes[change.axis].offset.reset(); }
  void operator()(const SetInhibit& change) const { state.inhibit = change.inhibit; }
  void operator()(const SetHold& change) const {
    state.axes[change.axis].holds.insert_or_assign(change.hold, change.since);
  }
  void operator()(const ForgetHolds& change) const {
    for (const auto& [hold, since] : change.holds) state.axes[change.axis].holds.erase(hold);
  }
  void operator()(const CountEepromWrites& change) const {
    auto& axis = state.axes[change.axis];
    axis.eeprom_writes += change.writes;
    axis.eeprom = change.saves;
  }
  void operator()(const AcceptState& /*change*/) const { state.convictions.clear(); }
};

/// By its canary a restart of the drive is still found (M1).
void distrust(AxisRecord& axis) {
  if (axis.offset) axis.offset->trust = PositionTrust::unknown;
}

struct ApplyAfterFailure {
  StoredState& state;
  void operator()(const SetOffset& change) const {
    Apply{state}(change);
    distrust(state.axes[change.axis]);
  }
  void operator()(const ForgetOffset& change) const { Apply{state}(change); }
  void operator()(const SetInhibit& change) const {
    if (change.inhibit.active) Apply{state}(change);
  }
  void operator()(const SetHold& change) const { Apply{state}(change); }
  void operator()(const ForgetHolds& change) const {
    state.axes[change.axis].holds.insert(change.holds.begin(), change.holds.end());
  }
  void operator()(const CountEepromWrites& change) const {
    auto& axis = state.axes[change.axis];
    axis.eeprom_writes += change.writes;
    if (axis.eeprom.saves <= change.saves.saves) axis.eeprom = change.saves;  // else more came since
  }
  void operator()(const AcceptState& /*change*/) const {}
};

}  // namespace

void apply(StoredState& state, const Change& change) { std::visit(Apply{state}, change); }

void apply_after_failure(StoredState& state, const Change& change) {
  std::visit(ApplyAfterFailure{state}, change);
}

void distrust_offsets(StoredState& state) {
  for (auto& [name, axis] : state.axes) distrust(axis);
}

void latch_by_caution(StoredState& state, WallTime now) {
  if (!state.inhibit.active)
    state.inhibit = {.active = true, .by = "axisd: whether StopAll was latched is not known", .since = now};
}

}  // namespace axisd::store
