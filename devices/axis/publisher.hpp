// What an axis shows: snapshots, and events where something changed.
#pragma once

#include <cstdint>
#include <optional>

#include "devices/axis/axis_context.hpp"
#include "devices/axis/drift_watch.hpp"
#include "devices/axis/eeprom_budget.hpp"
#include "devices/axis/link_machine.hpp"
#include "devices/axis/power_machine.hpp"
#include "devices/axis/shaft.hpp"
#include "devices/axis/snapshot.hpp"
#include "devices/axis/stop_machine.hpp"

namespace axisd {

class Execution;

/// Makes the snapshots from what the other parts know, and tells what differs from the one before. Counts
/// what the drive saves to its EEPROM, as that is told, too. Thread: core.
class Publisher {
 public:
  Publisher(const AxisContext& context, const Shaft& shaft, const LinkMachine& link,
            const std::optional<DriveIdentity>& identity, const PowerMachine& power, const StopMachine& stop,
            const DriftWatch& drift, const Execution& execution);
  Publisher(const Publisher&) = delete;

  /// Stores a new snapshot, and tells what differs from the one before.
  void publish();
  /// The snapshot is that of the reading which was just taken in.
  void note_sampled() { sampled_revision_ = revision_; }
  /// Nothing has been published since note_sampled(), nor is anything new to be.
  [[nodiscard]] bool shows_sampled();
  /// The drive is as it is shown: only the time at which that is known has changed.
  void show_again(const DriveSample& sample);
  /// False: nothing was written since the last look. Else the next sample is published, whatever it says.
  bool note_eeprom_writes();
  /// Of the drive, whatever it saves for. Errors: eeprom_budget.
  [[nodiscard]] Result<void> permit_saves(std::uint64_t saves);
  /// Registers.
  [[nodiscard]] std::uint64_t eeprom_writes() const { return eeprom_writes_; }
  /// Edges of terminals between two readings (M29).
  void tell_edges(const DriveSample& before, const DriveSample& now);

 private:
  void show_position(AxisSnapshot& shown) const;
  void show_sample(AxisSnapshot& shown) const;
  void tell_changes(const AxisSnapshot& before, const AxisSnapshot& now);
  [[nodiscard]] MotionCause motion_cause() const;

  const AxisContext& context_;
  const Shaft& shaft_;
  const LinkMachine& link_;
  const std::optional<DriveIdentity>& identity_;
  const PowerMachine& power_;
  const StopMachine& stop_;
  const DriftWatch& drift_;
  const Execution& execution_;

  boost::shared_ptr<AxisSnapshot> shown_;  ///< the last snapshot
  std::uint64_t revision_ = 0;
  std::uint64_t sampled_revision_ = 0;  ///< of the snapshot after the last sample
  std::uint64_t eeprom_writes_ = 0;     ///< registers
  EepromBudget eeprom_budget_;
};

}  // namespace axisd
