#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "buses/modbus_rtu/rtu_bus.hpp"
#include "buses/task.hpp"
#include "daemon/core/machine_core.hpp"
#include "devices/bus_access.hpp"
#include "devices/descriptor.hpp"

namespace axisd::core {

/// A search for the nodes of one bus. Thread: core.
class NodeScan {
 public:
  virtual ~NodeScan() = default;
  /// Asks until there is something to report: found nodes, some that are silent, or the end. Errors end it.
  virtual Task<Result<ScanProgress>> next() = 0;
};

/// Axis or device with this address; empty: none.
[[nodiscard]] std::string configured_as(const MachineCore& machine, const std::string& bus,
                                        std::uint8_t node);

/// Looks for nodes of an RS-485 line: one read per node, baud and format, in class `scan`, and a few reads
/// more of what answers, until one shows a model that is known here. Never writes. Takes at most probes x
/// (reply timeout + margin of the bus + wire time), and what other transactions take meanwhile. Thread: core.
class BusScan final : public NodeScan {
 public:
  /// `machine` and `bus` outlive it. Nothing more is sent once `wanted` has expired.
  BusScan(const MachineCore& machine, modbus_rtu::RtuBus& bus, ScanRequest request,
          std::weak_ptr<void> wanted);

  /// Probes until there is something to report: found nodes, 16 probes without, or the end. Errors end the
  /// scan: invalid_argument (the request), moving or fault (an axis of the bus came to life: other settings
  /// would disturb it), bus_down, not_supported (the port cannot do the settings).
  Task<Result<ScanProgress>> next() override;

 private:
  struct Probe {
    std::uint8_t node;
    modbus_rtu::SerialSettings serial;
  };
  struct Heard {
    bool answered = false;                   ///< soundly, perhaps with an exception
    bool garbled = false;                    ///< damaged replies came, too
    std::vector<std::uint16_t> registers{};  ///< empty: an exception, or no sound answer
  };
  [[nodiscard]] Result<void> check() const;
  [[nodiscard]] Result<void> check_quiet(const modbus_rtu::SerialSettings& serial) const;
  [[nodiscard]] Probe probe_at(int index) const;
  [[nodiscard]] TransactionOptions options(const Probe& probe) const;
  Task<Result<std::optional<FoundNode>>> look(Probe probe);
  Task<Result<Heard>> ask(Probe probe, RtuRead read);
  Task<Result<bool>> identify(Probe probe, RtuRead read, std::vector<std::uint16_t> registers,
                              FoundNode& found);

  const MachineCore* machine_;
  modbus_rtu::RtuBus* bus_;
  ScanRequest request_;
  std::weak_ptr<void> wanted_;
  std::vector<modbus_rtu::SerialSettings> serials_;  ///< the bus's own first
  int nodes_ = 0;
  int probed_ = 0;
};

}  // namespace axisd::core
