#pragma once

#include <cstdint>
#include <span>

#include "buses/modbus_rtu/rtu_bus.hpp"

namespace axisd::modbus_rtu {

/// One slave of a line, for drive code. Thread: core.
class Node {
 public:
  Node(RtuBus& bus, std::uint8_t address) : bus_(&bus), address_(address) {}

  Task<Result<Answer>> read(std::uint16_t address, std::uint16_t count, TransactionOptions options) const;
  /// FC03, not sent: for whoever sends it later (Proof).
  [[nodiscard]] Request reading(std::uint16_t address, std::uint16_t count) const;
  /// Errors: as of RtuBus::watch().
  Task<Result<std::optional<Answer>>> watch(std::uint16_t address, std::uint16_t count,
                                            Repetition repetition) const;
  /// FC06.
  Task<Result<Answer>> write(std::uint16_t address, std::uint16_t value, TransactionOptions options) const;
  /// FC16.
  Task<Result<Answer>> write_block(std::uint16_t address, std::span<const std::uint16_t> values,
                                   TransactionOptions options) const;

  /// The same for requests that may be repeated without harm: up to `attempts` while there is no reply. Never
  /// for triggers.
  Task<Result<Answer>> read_patiently(std::uint16_t address, std::uint16_t count, TransactionOptions options,
                                      int attempts = 3) const;
  Task<Result<Answer>> write_patiently(std::uint16_t address, std::uint16_t value, TransactionOptions options,
                                       int attempts = 3) const;

  [[nodiscard]] std::uint8_t address() const { return address_; }
  [[nodiscard]] RtuBus& bus() const { return *bus_; }

 private:
  RtuBus* bus_;
  std::uint8_t address_;
};

}  // namespace axisd::modbus_rtu
