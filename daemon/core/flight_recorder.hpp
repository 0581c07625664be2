#pragma once

#include <functional>
#include <map>
#include <optional>
#include <string>

#include "daemon/core/bus_recorder.hpp"
#include "daemon/store/record_files.hpp"
#include "devices/event.hpp"

namespace axisd::core {

/// Writes the newest frames of a bus to a file when something went wrong there. Thread: core; rendering and
/// writing are the files'.
class FlightRecorder {
 public:
  /// A record is written so long after the fault: what followed (the stop, its confirmation) belongs to it.
  static constexpr Duration aftermath = std::chrono::milliseconds(500);
  /// Of one bus no more often, however much goes wrong; what does meanwhile is named by the next record.
  static constexpr Duration interval = std::chrono::seconds(10);
  /// Called once a record is written (or not).
  using Written = std::function<void(const std::string& axis, const FlightRecordWritten& record)>;

  /// `files` may be null: nothing is written. `clock` and `files` outlive it.
  FlightRecorder(Clock& clock, store::RecordFiles* files, Written written);
  FlightRecorder(const FlightRecorder&) = delete;

  /// Something went wrong on the bus of `recorder`, with `axis` (or none in particular). `recorder` outlives
  /// this.
  void fault(const BusRecorder& recorder, const std::string& axis, const std::string& reason);
  /// Writes one now, and calls back with its name. Errors: storage, not_supported.
  void write(const BusRecorder& recorder, const std::string& reason,
             std::function<void(Result<std::string>)> done);
  /// nullptr: nothing is kept.
  [[nodiscard]] store::RecordFiles* files() const { return files_; }
  /// Writes what was still to be written.
  void close();

 private:
  struct Pending {
    const BusRecorder* recorder = nullptr;
    std::string axis;
    std::string reasons;  ///< empty: nothing is to be written
    int further = 0;      ///< faults whose reason has no room
    std::optional<TimePoint> written;
    Clock::Timer timer;
  };
  void due(Pending& pending);

  Clock* clock_;
  store::RecordFiles* files_;
  Written written_;
  std::map<std::string, Pending> pending_;  ///< by bus
};

}  // namespace axisd::core
