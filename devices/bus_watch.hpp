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

/// Of one node of an RS-485 line: while it does not answer, it is asked with growing waits.
struct QuarantineStatus {
  bool active = false;
  Duration lasting{};        ///< while active: since so long
  Duration next_probe_in{};  ///< likewise; 0: its next request goes out
  std::uint64_t probes = 0;  ///< likewise: requests in vain since it began
  std::uint64_t times = 0;   ///< that it was put there
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
  std::map<std::uint8_t, QuarantineStatus> quarantine{};    ///< of an RS-485 line: those that ever were there
  std::size_t held_back = 0;                                ///< of an RS-485 line: until the next probe
  std::map<std::uint8_t, NetworkNodeStatistics> network{};  ///< of a CAN network
  std::optional<StatisticsByClass> sdo{};                   ///< of a CAN network
  std::map<std::uint8_t, Known> known{};
};

/// One tick of a stream of statistics.
struct StatisticsTick {
  std::vector<BusStatistics> buses{};
  std::uint64_t missed = 0;  ///< ticks since the one before that its reader was too slow for
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

/// A stream under way. Dropping it ends it.
struct StreamToken {
  /// The reader sets it when it can take the next message, whoever gives one clears it: nothing is made for a
  /// slow reader, so nothing waits for it.
  std::atomic<bool> wanted{true};
};

struct FlightRecord {
  std::string name, bus, reason;
  WallTime written_at{};
  std::uint64_t size = 0;  ///< bytes
};

/// Each tick is a copy that the core thread makes.
inline constexpr Duration shortest_statistics_period = std::chrono::milliseconds(100);

/// Part of Machine. Thread: any; callbacks arrive on the core thread and must only hand over.
class BusWatch {
 public:
  virtual ~BusWatch() = default;

  /// Of one bus, or of all if the name is empty. Errors: invalid_argument (unknown bus).
  virtual void statistics(std::string bus,
                          std::function<void(Result<std::vector<BusStatistics>>)> callback) = 0;
  /// The same at once and every `period` (at least `shortest_statistics_period`). A tick that the reader
  /// cannot take is made when it can, of the newest values; further ones until then are missed.
  virtual std::shared_ptr<StreamToken> watch_statistics(
      std::string bus, Duration period, std::function<void(Result<StatisticsTick>)> callback) = 0;
  /// Calls back with the frames from now on, some at a time, first with none; or once with an error
  /// (invalid_argument: unknown bus).
  virtual std::shared_ptr<StreamToken> trace(TraceRequest request,
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
