#pragma once

#include "buses/canopen/canopen_bus.hpp"
#include "devices/generic/device.hpp"

namespace axisd {

/// A device on a CAN network: objects, each read by an SDO of its own.
class CanopenDevice final : public Device {
 public:
  /// `bus` and `clock` outlive it.
  CanopenDevice(Executor executor, Clock& clock, canopen::CanopenBus& bus, DeviceSettings settings);

 private:
  Task<Result<void>> poll_once() override;
  Task<Result<void>> write_raw(std::size_t index, std::uint32_t raw) override;
  Task<Result<Reading>> read_raw(std::size_t index) override;
  Task<Result<Reading>> read_in(std::size_t index, TransactionClass transaction_class);

  canopen::CanopenBus* bus_;
};

}  // namespace axisd
