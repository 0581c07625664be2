// How often the EEPROM of one drive may be written to: its cells bear about 100,000 writes.
#pragma once

#include <cstdint>
#include <optional>
#include <string>

#include "buses/clock.hpp"
#include "buses/error.hpp"
#include "devices/persistence.hpp"

namespace axisd {

/// Bounds saves within a day. A save is one request that makes the drive save, one register or all of them:
/// no cell is worn more often than that. Counted by the hour, so that what is kept is bounded: a save counts
/// for 24 to 25 h.
///
/// The hours are those of the wall clock, as nothing else goes on while the daemon does not run. Where that
/// is set back, what lies in its future counts as saved now: it is not forgotten, and not kept for longer
/// than a day from then. Where it is set forward by a day, the day's saves are forgotten; `saves` is not.
///
/// Thread: core.
class EepromBudget {
 public:
  /// `per_day`: > 0.
  EepromBudget(std::uint64_t per_day, EepromRecord record) : per_day_(per_day), record_(std::move(record)) {}

  /// Leaves out what is older than a day, and puts what lies ahead into this hour. True: it was changed.
  bool settle(WallTime now);
  void count(std::uint64_t saves, WallTime now);
  /// Errors: eeprom_budget, with all figures, if so many more are too many for this day.
  [[nodiscard]] Result<void> permit(std::uint64_t saves, WallTime now);

  [[nodiscard]] const EepromRecord& record() const { return record_; }

 private:
  [[nodiscard]] std::uint64_t of_this_day() const;
  /// nullopt: never, so many at once are too many for any day. Precondition: too many for this day.
  [[nodiscard]] std::optional<WallTime> permitted_from(std::uint64_t saves) const;

  std::uint64_t per_day_;
  EepromRecord record_;
};

}  // namespace axisd
