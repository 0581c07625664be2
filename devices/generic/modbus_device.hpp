#pragma once

#include <vector>

#include "buses/modbus_rtu/node.hpp"
#include "devices/generic/device.hpp"
#include "devices/generic/value.hpp"

namespace axisd {

/// A device on an RS-485 line: holding registers, read in blocks.
class ModbusDevice final : public Device {
 public:
  /// `bus` and `clock` outlive it.
  ModbusDevice(Executor executor, Clock& clock, modbus_rtu::RtuBus& bus, DeviceSettings settings);

 private:
  Task<Result<void>> poll_once() override;
  Task<Result<void>> write_raw(std::size_t index, std::uint32_t raw) override;
  Task<Result<Reading>> read_raw(std::size_t index) override;
  Task<Result<void>> read_block(const RegisterBlock& block);

  modbus_rtu::Node node_;
  std::vector<RegisterBlock> blocks_;
};

}  // namespace axisd
