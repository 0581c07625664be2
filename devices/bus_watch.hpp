// What the API can see of the traffic on a bus: statistics, frames, flight records.
#pragma once

#include <atomic>
#include <cstdint>
#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "buses/canopen/master.hpp"
#include "buses/modbus_rtu/line_statistics.hpp"
#include "buses/traced_frame.hpp"
#include "devices/axis/unknown_outcomes.hpp"
#include "devices/bus_kind.hpp"

namespace axisd {

/// Of one node of a CAN network.
struct NetworkNodeStatistics {
  canopen::SdoCounters sdo{};
  canopen::NodeTraffic traffic{};
  std::uint64_t emergencies = 0;
};

/// Counters since start. A copy: nobody waits for its reader.
struct BusStatistics {
  /// A configured node.
  struct Known {
    std::string name;  ///< of the axis or device
    UnknownOutcomes unknown_starts{};
  };
  std::string bus;
  BusKind kind = BusKind::modbus_rtu;
  Duration since_start{};
  double recent_load = 0;   ///< share of the last BusLoad::window in which it was occupied
  double overall_load = 0;  ///< likewise of `since_start`
  std::optional<modbus_rtu::LineStatistics> line{};         ///< of an RS-485 line
  std::map<std::uint8_t, NetworkNodeStatistics> network{};  ///< of a CAN network
  std::map<std::uint8_t, Known> known{};
};

struct TraceRequest {
  std::string bus;
  std::optional<std::uint8_t> node{};  ///< nothing: all
};

/// A frame that keeps its bytes.
struct KeptFrame {
  std::uint64_t sequence = 0;
  WallTime wall{};
  TracedFrame frame;  ///< but for its bytes
  std::vector<std::uint8_t> data{};
  /// With its bytes, valid as long as this.
  [[nodiscard]] TracedFrame whole() const {
    auto copy = frame;
    copy.bytes = data;
    return copy;
  }
};
struct TraceBatch {
  std::vector<KeptFrame> frames{};
  std::uint64_t lost = 0;  ///< frames of any node before them that are no longer kept
};

/// A trace under way. Dropping it ends it.
struct TraceToken {
  /// The reader sets it when it can take the next batch, whoever gives one clears it: what waits for a slow
  /// reader stays in the ring of the bus, and is lost there.
  std::atomic<bool> wanted{true};
};

struct FlightRecord {
  std::string name, bus, reason;
  WallTime written_at{};
  std::uint64_t size = 0;  ///< bytes
};

/// Part of Machine. Thread: any; callbacks arrive on the core thread and must only hand over.
class BusWatch {
 public:
  virtual ~BusWatch() = default;

  /// Of one bus, or of all if the name is empty. Errors: invalid_argument (unknown bus).
  virtual void statistics(std::string bus,
                          std::function<void(Result<std::vector<BusStatistics>>)> callback) = 0;
  /// Calls back with the frames from now on, some at a time, first with none; or once with an error
  /// (invalid_argument: unknown bus).
  virtual std::shared_ptr<TraceToken> trace(TraceRequest request,
                                            std::function<void(Result<TraceBatch>)> callback) = 0;

  /// Oldest first. Errors: storage, not_supported (nothing is kept).
  virtual void flight_records(std::function<void(Result<std::vector<FlightRecord>>)> callback) = 0;
  /// The text of one. Errors: invalid_argument (there is none of that name), storage.
  virtual void flight_record(std::string name, std::function<void(Result<std::string>)> callback) = 0;
  /// Writes one now; calls back with its name once it is written. Errors: invalid_argument (unknown bus),
  /// storage, not_supported.
  virtual void write_flight_record(std::string bus, std::string client,
                                   std::function<void(Result<std::string>)> callback) = 0;
};

}  // namespace axisd
