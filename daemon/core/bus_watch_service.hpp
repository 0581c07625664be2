#pragma once

#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "buses/task.hpp"
#include "daemon/core/machine_core.hpp"
#include "devices/bus_watch.hpp"

namespace axisd::core {

/// What the API can see of the traffic: copies made on the core thread. Thread: any, from construction
/// (before the core runs) to destruction (after it ended).
class BusWatchService final : public BusWatch {
 public:
  /// How often a trace looks for new frames: what that costs is the same for quick readers and slow ones.
  static constexpr Duration trace_period = std::chrono::milliseconds(20);
  /// Frames of one batch.
  static constexpr std::size_t most_frames = 500;

  /// `machine` and `clock` outlive it.
  BusWatchService(Executor executor, Clock& clock, MachineCore& machine);

  void statistics(std::string bus, std::function<void(Result<std::vector<BusStatistics>>)> callback) override;
  std::shared_ptr<StreamToken> watch_statistics(
      std::string bus, Duration period, std::function<void(Result<StatisticsTick>)> callback) override;
  std::shared_ptr<StreamToken> trace(TraceRequest request,
                                     std::function<void(Result<TraceBatch>)> callback) override;
  void flight_records(std::function<void(Result<std::vector<FlightRecord>>)> callback) override;
  void flight_record(std::string name, std::function<void(Result<std::string>)> callback) override;
  void write_flight_record(std::string bus, std::string client,
                           std::function<void(Result<std::string>)> callback) override;

 private:
  Task<> run_statistics(std::string bus, Duration period, std::weak_ptr<StreamToken> alive,
                        std::function<void(Result<StatisticsTick>)> callback);
  Task<> run_trace(TraceRequest request, std::weak_ptr<StreamToken> alive,
                   std::function<void(Result<TraceBatch>)> callback);
  [[nodiscard]] TraceBatch batch_of(const FrameRing& frames, FrameRing::Place& place,
                                    const TraceRequest& request) const;
  [[nodiscard]] BusStatistics statistics_of(const Bus& bus) const;
  /// Errors: invalid_argument (unknown bus).
  [[nodiscard]] Result<std::vector<BusStatistics>> statistics_of(const std::string& bus) const;

  Executor executor_;
  Clock* clock_;
  MachineCore* machine_;
};

}  // namespace axisd::core
