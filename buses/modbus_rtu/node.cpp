#include "buses/modbus_rtu/node.hpp"

namespace axisd::modbus_rtu {

Task<Result<Answer>> Node::read(std::uint16_t address, std::uint16_t count,
                                TransactionOptions options) const {
  co_return co_await bus_->transact(reading(address, count), std::move(options));
}

Task<Result<std::optional<Answer>>> Node::watch(std::uint16_t address, std::uint16_t count,
                                                Repetition repetition) const {
  co_return co_await bus_->watch(reading(address, count), std::move(repetition));
}

Request Node::reading(std::uint16_t address, std::uint16_t count) const {
  return {.node = address_, .function = Function::read_holding_registers, .address = address, .count = count};
}

Task<Result<Answer>> Node::write(std::uint16_t address, std::uint16_t value,
                                 TransactionOptions options) const {
  Request request{.node = address_, .function = Function::write_single_register, .address = address};
  request.values.push_back(value);
  co_return co_await bus_->transact(std::move(request), std::move(options));
}

Task<Result<Answer>> Node::write_block(std::uint16_t address, std::span<const std::uint16_t> values,
                                       TransactionOptions options) const {
  Request request{.node = address_,
                  .function = Function::write_multiple_registers,
                  .address = address,
                  .count = static_cast<std::uint16_t>(values.size())};
  request.values.assign(values.begin(), values.end());
  co_return co_await bus_->transact(std::move(request), std::move(options));
}

Task<Result<Answer>> Node::read_patiently(std::uint16_t address, std::uint16_t count,
                                          TransactionOptions options, int attempts) const {
  auto result = co_await read(address, count, options);
  while (!result && result.error().reason == Reason::no_reply && --attempts > 0)
    result = co_await read(address, count, options);
  co_return result;
}

Task<Result<Answer>> Node::write_patiently(std::uint16_t address, std::uint16_t value,
                                           TransactionOptions options, int attempts) const {
  auto result = co_await write(address, value, options);
  while (!result && result.error().reason == Reason::no_reply && --attempts > 0)
    result = co_await write(address, value, options);
  co_return result;
}

}  // namespace axisd::modbus_rtu
