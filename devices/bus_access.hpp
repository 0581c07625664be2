// What the API can ask of a bus itself: nodes that are not axes, single exchanges, and a search for nodes.
#pragma once

#include <boost/smart_ptr/shared_ptr.hpp>
#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "buses/canopen/remote_node.hpp"
#include "buses/error.hpp"
#include "buses/modbus_rtu/settings.hpp"
#include "devices/axis/snapshot.hpp"

namespace axisd {

/// One exchange on an RS-485 line, through its queue, class `parameters` (M28).
struct TransactRequest {
  std::string bus;
  std::uint8_t node = 0;
  std::uint16_t address = 0;
  std::uint16_t count = 1;              ///< registers to read
  std::vector<std::uint16_t> values{};  ///< not empty: written, with FC06 if it is one
};

/// One SDO transfer on a CAN network, through the queue of its node, class `parameters` (M28).
struct ObjectRequest {
  std::string bus;
  std::uint8_t node = 0;
  std::uint32_t object = 0;           ///< index << 8 | sub-index
  std::vector<std::uint8_t> bytes{};  ///< not empty: written, low byte first
};

struct ScanRequest {
  std::string bus;
  std::uint8_t first_node = 1, last_node = 127;
  std::vector<int> bauds{};                   ///< empty: the bus's own, and the only one of a CAN network
  std::vector<modbus_rtu::Format> formats{};  ///< likewise
  Duration reply_timeout{};                   ///< 0: the bus's turnaround_max or sdo_timeout
};

struct FoundNode {
  std::uint8_t node = 0;
  bool on_network = false;      ///< of a CAN network
  int baud = 0;                 ///< or bit rate
  modbus_rtu::Format format{};  ///< on RS-485
  std::string model;            ///< empty: answers, but is no drive that is known here
  std::uint16_t model_code = 0;
  std::string version;
  std::int32_t pulses_per_revolution = 0;  ///< as the drive is set; 0: unknown
  std::string configured_as;  ///< axis or device that has this address in the configuration; empty: none
  std::string note;           ///< "garbled replies: two nodes on one address?"
  std::optional<canopen::Identity> identity{};  ///< on CAN, if it told
};

struct ScanProgress {
  int probed = 0, total = 0;       ///< probes: node x baud x format; on CAN: nodes
  std::vector<FoundNode> found{};  ///< since the last report
  bool finished = false;
};

/// A register of a node that is not an axis, as it was last read.
struct DeviceValue {
  std::string name, unit;
  std::optional<double> value;  ///< scaled; nothing before it was read
  bool writable = false;
};

struct DeviceSnapshot {
  std::string name, bus;
  std::uint8_t node = 0;
  LinkState link = LinkState::offline;
  std::optional<Error> error{};
  std::vector<DeviceValue> values{};
  WallTime measured_at{};
};
using DeviceSnapshotPtr = boost::shared_ptr<const DeviceSnapshot>;

/// Parts of Machine. Thread: any; callbacks arrive on the core thread.
class BusAccess {
 public:
  virtual ~BusAccess() = default;

  /// Calls back once, with the registers read. Errors: invalid_argument (unknown bus, node 0, a write to a
  /// node that an axis owns), refused, no_reply (a write: outcome unknown), bus_down.
  virtual void transact(TransactRequest request,
                        std::function<void(Result<std::vector<std::uint16_t>>)> callback) = 0;

  /// Calls back once, with the bytes read, as the node sent them. Errors: invalid_argument (unknown bus, no
  /// node-ID, a write to a node that an axis owns), those of an SDO abort, no_reply (a write: outcome
  /// unknown), bus_down.
  virtual void transact_object(ObjectRequest request,
                               std::function<void(Result<std::vector<std::uint8_t>>)> callback) = 0;

  /// Looks for nodes in class `scan`. Calls back with progress, last with `finished` or an error. Other
  /// serial settings than the bus's own are tried only while every axis of the bus is released or offline
  /// (frames in another rate are noise to the rest of the line). Dropping the token ends it.
  virtual std::shared_ptr<void> scan(ScanRequest request,
                                     std::function<void(Result<ScanProgress>)> callback) = 0;

  /// All `devices:`, in the order of the file, without waiting for the core.
  [[nodiscard]] virtual std::vector<DeviceSnapshotPtr> devices() const = 0;
  /// Writes one named register; calls back with the value as written. Errors: invalid_argument (unknown or
  /// not writable), out_of_range (not representable), and those of the wire.
  virtual void write_device(std::string device, std::string name, double value,
                            std::function<void(Result<double>)> callback) = 0;
};

}  // namespace axisd
