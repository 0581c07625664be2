#include "devices/generic/modbus_device.hpp"

#include <span>
#include <utility>

namespace axisd {

namespace {

const TransactionOptions parameters{.transaction_class = TransactionClass::parameters};

std::uint16_t register_of(const ValueSettings& value) { return static_cast<std::uint16_t>(value.address); }

}  // namespace

ModbusDevice::ModbusDevice(Executor executor, Clock& clock, modbus_rtu::RtuBus& bus, DeviceSettings settings)
    : Device(std::move(executor), clock, bus, std::move(settings)),
      node_(bus, this->settings().node),
      blocks_(blocks_of(this->settings().values)) {}

Task<Result<void>> ModbusDevice::poll_once() {
  Result<void> first;
  for (const auto& block : blocks_) {
    auto result = co_await read_block(block);
    if (closing()) co_return first;
    if (!result && !is_answer(result.error())) co_return result;
    if (!result && first) first = std::move(result);
  }
  co_return first;
}

Task<Result<void>> ModbusDevice::read_block(const RegisterBlock& block) {
  const auto answer = co_await node_.read(block.address, block.count, {.transaction_class = poll_class()});
  if (!answer) {
    if (is_answer(answer.error()))
      for (const auto i : block.values) forget(i);
    co_return fail(with_name(answer.error()));
  }
  const std::span<const std::uint16_t> registers = answer->registers;
  for (const auto i : block.values) {
    const auto& one = settings().values[i];
    const auto raw = registers.subspan(register_of(one) - block.address, register_count(one.type));
    keep(i, {.raw = from_registers(raw), .at = answer->answered_at});
  }
  co_return Result<void>{};
}

Task<Result<void>> ModbusDevice::write_raw(std::size_t index, std::uint32_t raw) {
  const auto& value = settings().values[index];
  const auto words = to_registers(raw, value.type);
  auto sending = words.size() == 1 ? node_.write(register_of(value), words.front(), parameters)
                                   : node_.write_block(register_of(value), words, parameters);
  const auto written = co_await std::move(sending);
  if (!written) co_return fail(written.error());
  co_return Result<void>{};
}

Task<Result<Device::Reading>> ModbusDevice::read_raw(std::size_t index) {
  const auto& value = settings().values[index];
  const auto answer =
      co_await node_.read_patiently(register_of(value), register_count(value.type), parameters);
  if (!answer) co_return fail(answer.error());
  co_return Reading{.raw = from_registers(answer->registers), .at = answer->answered_at};
}

}  // namespace axisd
