#pragma once

#include <functional>
#include <memory>
#include <set>
#include <string>
#include <vector>

#include "buses/clock.hpp"
#include "buses/task.hpp"
#include "daemon/core/bus_access_scan.hpp"
#include "daemon/core/machine_core.hpp"
#include "devices/bus_access.hpp"

namespace axisd::core {

/// The error of a request that names a bus that is not there.
[[nodiscard]] Error no_such_bus(const MachineCore& machine, const std::string& name);

/// What the API can ask of the buses: hands it to the core thread, where the sequences run; closing the
/// machine ends them. Thread: any, from construction (before the core runs) to destruction (after it ended).
class BusAccessService final : public BusAccess {
 public:
  /// `machine` and `clock` outlive it.
  BusAccessService(Executor executor, Clock& clock, MachineCore& machine);

  void transact(TransactRequest request,
                std::function<void(Result<std::vector<std::uint16_t>>)> callback) override;
  void transact_object(ObjectRequest request,
                       std::function<void(Result<std::vector<std::uint8_t>>)> callback) override;
  std::shared_ptr<void> scan(ScanRequest request,
                             std::function<void(Result<ScanProgress>)> callback) override;
  [[nodiscard]] std::vector<DeviceSnapshotPtr> devices() const override;
  void write_device(std::string device, std::string name, double value,
                    std::function<void(Result<double>)> callback) override;

 private:
  using ScanCallback = std::function<void(Result<ScanProgress>)>;
  Task<Result<std::vector<std::uint16_t>>> run_transact(TransactRequest request);
  Task<Result<std::vector<std::uint8_t>>> run_transact(ObjectRequest request);
  Task<> run_scan(ScanRequest request, std::weak_ptr<void> alive, ScanCallback callback);
  [[nodiscard]] Result<std::unique_ptr<NodeScan>> scan_of(ScanRequest request,
                                                          std::weak_ptr<void> alive) const;

  Executor executor_;
  Clock* clock_;
  MachineCore* machine_;
  std::set<std::string> scanning_;  ///< buses with a scan under way. Thread: core
};

}  // namespace axisd::core
