#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <vector>

#include "buses/canopen/canopen_bus.hpp"
#include "buses/signal.hpp"
#include "buses/task.hpp"
#include "daemon/core/bus_access_scan.hpp"
#include "daemon/core/machine_core.hpp"
#include "devices/bus_access.hpp"

namespace axisd::core {

/// Looks for nodes of a CAN network: reads 1000h of many at once in class `scan`, and 1018h of those that
/// answer. Never writes, and never tries another bit rate: that is the interface's, which axisd does not
/// configure, and one frame with a wrong one is an error to everybody. 127 nodes take about 8 timeouts.
/// Thread: core.
class NetworkScan final : public NodeScan {
 public:
  /// `machine`, `clock` and `bus` outlive it. Nothing more is asked once `wanted` has expired.
  NetworkScan(Executor executor, Clock& clock, const MachineCore& machine, canopen::CanopenBus& bus,
              ScanRequest request, std::weak_ptr<void> wanted);

  /// Asks the next nodes. Errors end the scan: invalid_argument (the request, and settings of RS-485),
  /// not_supported (other bit rates), bus_down.
  Task<Result<ScanProgress>> next() override;

 private:
  struct Batch;
  [[nodiscard]] Result<void> check() const;
  [[nodiscard]] canopen::SdoOptions options() const;
  /// Ends by telling the batch, whatever happens.
  Task<> ask(std::uint8_t node, Batch& batch) const;
  Task<Result<std::optional<FoundNode>>> look(std::uint8_t node) const;
  Task<std::string> device_name(canopen::RemoteNode node) const;
  Task<void> identify(canopen::RemoteNode node, FoundNode& found) const;

  Executor executor_;
  Clock* clock_;
  const MachineCore* machine_;
  canopen::CanopenBus* bus_;
  ScanRequest request_;
  std::weak_ptr<void> wanted_;
  int probed_ = 0;
};

}  // namespace axisd::core
