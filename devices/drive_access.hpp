// What the API can ask of the drive behind an axis, beside moving it: parameters, segments, address.
#pragma once

#include <cstdint>
#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "buses/error.hpp"
#include "buses/modbus_rtu/settings.hpp"
#include "devices/axis/settings.hpp"
#include "devices/descriptor.hpp"
#include "devices/lease/lease.hpp"

namespace axisd {

struct DriveInfo {
  const DriveDescriptor* descriptor = nullptr;
  std::optional<DriveIdentity> identity;  ///< nothing before the drive was reached
  std::uint64_t eeprom_writes = 0;        ///< registers saved, since the axis is known on this computer
  bool persist = false;                   ///< anything of the configuration is saved in the drive
  /// By address: the key of the configuration that decides a parameter ("inputs.X0"). The others are free.
  std::map<std::uint32_t, std::string> configured_by{};
};

/// A new address or new serial settings for one drive. They count from its next power-up.
struct SerialChange {
  std::optional<std::uint8_t> node;
  std::optional<int> baud;
  std::optional<modbus_rtu::Format> format;
  Duration verify{};  ///< how long to look for the drive as it will be; 0: do not
};

struct SerialProgress {
  enum class Phase : std::uint8_t {
    written,  ///< saved in the drive and read back: switch it off and on
    waiting,  ///< looking for it at its new address or settings
    verified  ///< it answers there; the last one
  };
  Phase phase = Phase::written;
  std::string text;  ///< one line for people
};

/// Parts of Machine. Thread: any; callbacks arrive on the core thread, exactly once unless said otherwise.
/// Errors of all: unknown_axis, offline, configuring, no_reply, refused with the register in `where`; of
/// those that change something also lease_required and lease_lost, as for motion. The lease counts when the
/// work begins.
class DriveAccess {
 public:
  using ValuesCallback = std::function<void(Result<std::vector<ParameterValue>>)>;
  using SegmentsCallback = std::function<void(Result<SegmentSettings>)>;
  virtual ~DriveAccess() = default;

  virtual void drive_info(std::string axis, std::function<void(Result<DriveInfo>)> callback) = 0;

  /// Reads registers in blocks. Errors: invalid_argument (unknown or write-only register): nothing is sent.
  virtual void read_parameters(std::string axis, std::vector<std::uint32_t> addresses,
                               ValuesCallback callback) = 0;
  /// Writes all or, if any is refused by the checks, none; calls back with what was read back. Errors:
  /// out_of_range, invalid_argument (read-only, trigger, owned by the configuration: names the key), moving,
  /// fault (the power stage is on), misconfigured (read back differs).
  virtual void write_parameters(std::string axis, std::vector<ParameterValue> values, Requester requester,
                                ValuesCallback callback) = 0;

  /// Saves all RW registers to the drive's EEPROM (M27); at standstill and released only.
  virtual void save_parameters(std::string axis, Requester requester,
                               std::function<void(Result<void>)> callback) = 0;
  /// Restores the factory settings, at standstill and released only. The text says which address, baud and
  /// format will apply after the next power-up.
  virtual void restore_factory(std::string axis, Requester requester,
                               std::function<void(Result<std::string>)> callback) = 0;

  /// The segment table as the drive holds it, in the axis's units and direction; segments of 0 are left out.
  virtual void read_segments(std::string axis, SegmentsCallback callback) = 0;
  /// Replaces the whole table; refused if the configuration owns it.
  virtual void write_segments(std::string axis, SegmentSettings segments, Requester requester,
                              SegmentsCallback callback) = 0;

  /// Calls back with each phase, last with `verified` (or `written` without `verify`) or an error. Dropping
  /// the returned token ends the looking, not what was written.
  virtual std::shared_ptr<void> change_serial(std::string axis, SerialChange change, Requester requester,
                                              std::function<void(Result<SerialProgress>)> callback) = 0;
};

}  // namespace axisd
