// What must survive a restart, as the axes and the machine see it. The file behind it is daemon/store's
// business.
#pragma once

#include <cstdint>
#include <functional>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "buses/clock.hpp"
#include "buses/error.hpp"
#include "devices/axis/snapshot.hpp"
#include "devices/axis/stop_holds.hpp"
#include "devices/drive_values.hpp"
#include "devices/kept_state.hpp"

namespace axisd {

/// How an axis's position follows from its drive's counter, and by what the drive is recognised as unchanged
/// (M20).
struct OffsetRecord {
  std::int64_t offset_pulses = 0;                ///< axis position in pulses = unwrapped counter + offset
  PositionTrust trust = PositionTrust::unknown;  ///< as it was; only the axis may turn it into `restored`
  ContinuityMark canary{};                       ///< what the drive's memory holds (M6); empty: not known
  std::int64_t last_position_pulses = 0;         ///< the drive's counter at standstill when this was saved
  std::int64_t pulses_per_revolution = 0;        ///< another value in the configuration voids the record
  bool invert = false;                           ///< likewise
  bool operator==(const OffsetRecord&) const = default;
};

/// The machine-wide latch of StopAll (M14).
struct InhibitRecord {
  bool active = false;
  std::string by;  ///< who latched it (or released it)
  WallTime since{};
  bool operator==(const InhibitRecord&) const = default;
};

/// Who holds an axis in Stopping, and since when (M14).
using HoldRecords = std::map<HoldKey, WallTime>;

/// Requests that made the axis's drive save to its EEPROM, as far as EepromBudget counts them.
struct EepromRecord {
  std::uint64_t saves = 0;  ///< since the axis was first configured on this computer
  /// Of the last day: by the hour, UTC, since 1970. At most 25 of them.
  std::map<std::int64_t, std::uint64_t> by_hour{};
  bool operator==(const EepromRecord&) const = default;
};

struct AxisRecord {
  std::optional<OffsetRecord> offset;
  std::uint64_t eeprom_writes = 0;  ///< registers, since the axis was first configured on this computer
  HoldRecords holds{};
  EepromRecord eeprom{};
  bool operator==(const AxisRecord&) const = default;
};

/// Everything that is kept.
struct StoredState {
  std::uint64_t start_count =
      0;  ///< rises with every start of the daemon, also after a damaged file: fencing epoch
  InhibitRecord inhibit;
  std::map<std::string, AxisRecord> axes;  ///< by name; also axes that the configuration no longer has
  std::vector<Conviction> convictions{};   ///< until somebody has accepted them
  bool operator==(const StoredState&) const = default;
};

/// Saves what must survive. Calls return at once; nothing waits for the disk, a stop least of all. `done`
/// (may be empty) is called exactly once, later, on the core thread: when the change is durable, or with
/// Error `storage`. After an error the saved offset of that axis is void (neither old nor new is certain), an
/// inhibit stays latched, holds stand, and counts are kept for the next save. Thread: core.
class Persistence {
 public:
  using Callback = std::function<void(Result<void>)>;
  virtual ~Persistence() = default;

  /// What was kept when the daemon started; does not follow later saves. Thread: any.
  [[nodiscard]] virtual const StoredState& loaded() const = 0;
  /// The same with all that was asked for since, durable or not; what could not be saved as below.
  [[nodiscard]] virtual const StoredState& current() const = 0;

  /// What the start of the daemon found of the files.
  [[nodiscard]] virtual KeptStateSeen seen() const = 0;

  /// Without `done` it may wait up to 1 s for what comes next: of motions that follow each other the last one
  /// counts. A restart before then finds the axis elsewhere than saved, and restores nothing.
  virtual void save_offset(std::string axis, OffsetRecord offset, Callback done) = 0;
  /// The position is no longer known: after a restart there is nothing to restore.
  virtual void forget_offset(std::string axis, Callback done) = 0;
  virtual void save_inhibit(InhibitRecord inhibit, Callback done) = 0;
  /// Somebody holds the axis; also one that the configuration no longer has.
  virtual void save_hold(std::string axis, HoldKey hold, WallTime since, Callback done) = 0;
  /// These have ended.
  virtual void forget_holds(std::string axis, HoldRecords holds, Callback done) = 0;
  /// `writes` more registers were saved to the drive's EEPROM; `saves`: as they are counted with those.
  virtual void count_eeprom_writes(std::string axis, std::uint64_t writes, EepromRecord saves,
                                   Callback done) = 0;
  /// A person has looked at the convictions: there are none any more. After an error they stand.
  virtual void accept_state(Callback done) = 0;
};

}  // namespace axisd
