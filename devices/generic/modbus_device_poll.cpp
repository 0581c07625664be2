// The way to the device: polling, and noticing that it is gone or back.
#include <fmt/format.h>
#include <spdlog/spdlog.h>

#include <algorithm>
#include <span>

#include "devices/generic/modbus_device.hpp"

namespace axisd {

namespace {

constexpr Duration first_backoff = std::chrono::milliseconds(100);
/// A wait for a silent node takes some 30 ms: this keeps its share of the line below 2 %.
constexpr Duration longest_backoff = std::chrono::seconds(2);
constexpr int attempts_before_offline = 3;

}  // namespace

Task<> ModbusDevice::run() {
  auto backoff = first_backoff;
  int failures = 0;
  while (co_await port_is_open()) {
    const auto began = clock_->now();
    const auto polled = co_await poll_once();
    if (closing_) break;
    // Whatever the device answers, it is there.
    if (polled || polled.error().reason == Reason::refused) {
      go_online(polled);
      failures = 0;
      backoff = first_backoff;
      co_await wake_.wait_until(began + settings_.poll);
      continue;
    }
    if (link_ == LinkState::online && polled.error().reason != Reason::bus_down &&
        ++failures < attempts_before_offline)
      continue;  // the bus's own timeouts pace the repetition
    go_offline(polled.error());
    co_await wake_.wait_until(clock_->now() + backoff);
    backoff = std::min(2 * backoff, longest_backoff);
  }
  polling_ = false;
}

/// Waits until it is; false: the device is being closed.
Task<bool> ModbusDevice::port_is_open() {
  auto& bus = node_.bus();
  while (!closing_ && !bus.port().open) {
    if (const auto& cause = bus.port().error) go_offline(*cause);
    // Its own signal wakes it at the end, the port's when there is something to do.
    co_await bus.port_changed().wait_until(clock_->now() + longest_backoff);
  }
  co_return !closing_;
}

/// Reads all blocks; the first refusal is kept, any other failure ends it.
Task<Result<void>> ModbusDevice::poll_once() {
  const auto urgency = link_ == LinkState::online ? TransactionClass::parameters : TransactionClass::scan;
  Result<void> first;
  for (const auto& block : blocks_) {
    auto result = co_await read_block(block, urgency);
    if (closing_) co_return first;
    if (!result && result.error().reason != Reason::refused) co_return result;
    if (!result && first) first = std::move(result);
  }
  co_return first;
}

Task<Result<void>> ModbusDevice::read_block(const RegisterBlock& block, TransactionClass urgency) {
  const auto answer = co_await node_.read(block.address, block.count, {.transaction_class = urgency});
  if (!answer) {
    if (answer.error().reason == Reason::refused)
      for (const auto i : block.values) values_[i].reset();
    co_return fail(with_name(answer.error()));
  }
  const std::span<const std::uint16_t> registers = answer->registers;
  for (const auto i : block.values) {
    const auto& one = settings_.registers[i];
    values_[i] = decode(one, registers.subspan(one.address - block.address, register_count(one.type)));
  }
  measured_at_ = answer->answered_at;
  co_return Result<void>{};
}

void ModbusDevice::go_online(const Result<void>& polled) {
  if (link_ != LinkState::online) spdlog::info("{}: online", settings_.name);
  if (!polled && (!error_ || error_->where.object != polled.error().where.object))
    spdlog::warn("{}", to_string(polled.error()));
  link_ = LinkState::online;
  error_ = polled ? std::nullopt : std::optional(polled.error());
  publish();
}

void ModbusDevice::go_offline(const Error& cause) {
  const auto error = with_name(cause);
  if (link_ == LinkState::online || !error_ || error_->reason != error.reason)
    spdlog::warn("{}", to_string(error));
  link_ = LinkState::offline;
  error_ = error;
  publish();
}

}  // namespace axisd
