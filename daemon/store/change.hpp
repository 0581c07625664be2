// What a save does to the state: pure functions.
#pragma once

#include <cstdint>
#include <string>
#include <variant>

#include "devices/persistence.hpp"

namespace axisd::store {

struct SetOffset {
  std::string axis;
  OffsetRecord offset;
};
struct ForgetOffset {
  std::string axis;
};
struct SetInhibit {
  InhibitRecord inhibit;
};
struct SetHold {
  std::string axis;
  HoldKey hold;
  WallTime since{};
};
struct ForgetHolds {
  std::string axis;
  HoldRecords holds;  ///< as they were: what could not be forgotten stands
};
struct CountEepromWrites {
  std::string axis;
  std::uint64_t writes = 0;
  EepromRecord saves{};
};
struct AcceptState {};
using Change =
    std::variant<SetOffset, ForgetOffset, SetInhibit, SetHold, ForgetHolds, CountEepromWrites, AcceptState>;

/// The change as asked.
void apply(StoredState& state, const Change& change);

/// What is left of a change that could not be saved: the disk may hold either version, so the next save must
/// not grant more than both. No offset is trusted, an inhibit is latched and never released, holds stand,
/// counts stay counted, convictions stand.
void apply_after_failure(StoredState& state, const Change& change);

/// An older state in place of the newest one: no offset is trusted.
void distrust_offsets(StoredState& state);
/// Nobody vouches for what is known of the latch: motion is inhibited, because it may have been.
void latch_by_caution(StoredState& state, WallTime now);

}  // namespace axisd::store
