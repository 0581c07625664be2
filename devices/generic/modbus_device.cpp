#include "devices/generic/modbus_device.hpp"

#include <fmt/format.h>
#include <spdlog/spdlog.h>

#include <algorithm>
#include <boost/smart_ptr/make_shared.hpp>
#include <utility>

namespace axisd {

namespace {

using modbus_rtu::Answer;

constexpr Duration first_backoff = std::chrono::milliseconds(100);
/// A wait for a silent node takes some 30 ms: this keeps its share of the line below 2 %.
constexpr Duration longest_backoff = std::chrono::seconds(2);
constexpr int attempts_before_offline = 3;

TransactionOptions in(TransactionClass transaction_class) { return {.transaction_class = transaction_class}; }

}  // namespace

ModbusDevice::ModbusDevice(Executor executor, Clock& clock, modbus_rtu::RtuBus& bus, DeviceSettings settings)
    : executor_(std::move(executor)),
      clock_(&clock),
      node_(bus, settings.node),
      settings_(std::move(settings)),
      blocks_(blocks_of(settings_.registers)),
      wake_(executor_, clock),
      values_(settings_.registers.size()) {
  publish();
}

void ModbusDevice::start() {
  polling_ = true;
  spawn(executor_, run(), fmt::format("{} poll", settings_.name));
}

void ModbusDevice::close() {
  closing_ = true;
  wake_.notify_all();
}

Task<> ModbusDevice::run() {
  auto backoff = first_backoff;
  int failures = 0;
  while (!closing_) {
    co_await wait_for_port();
    if (closing_) break;
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

Task<> ModbusDevice::wait_for_port() {
  auto& bus = node_.bus();
  while (!closing_ && !bus.port().open) {
    if (const auto& cause = bus.port().error) go_offline(*cause);
    // Its own signal wakes it at the end, the port's when there is something to do.
    co_await bus.port_changed().wait_until(clock_->now() + longest_backoff);
  }
}

/// Reads all blocks; the first refusal is kept, any other failure ends it.
Task<Result<void>> ModbusDevice::poll_once() {
  Result<void> first;
  for (const auto& block : blocks_) {
    auto result = co_await read_block(block);
    if (closing_) co_return first;
    if (!result && result.error().reason != Reason::refused) co_return result;
    if (!result && first) first = std::move(result);
  }
  co_return first;
}

Task<Result<void>> ModbusDevice::read_block(const RegisterBlock& block) {
  const auto urgency = link_ == LinkState::online ? TransactionClass::parameters : TransactionClass::scan;
  const auto answer = co_await node_.read(block.address, block.count, in(urgency));
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

Task<Result<double>> ModbusDevice::write(std::string name, double value) {
  const auto found = std::ranges::find(settings_.registers, name, &RegisterSettings::name);
  if (found == settings_.registers.end()) co_return fail(unknown_register(name));
  if (!found->writable)
    co_return fail(Reason::invalid_argument, fmt::format("{}.{} is not writable", settings_.name, name),
                   "say `access: rw` for it in the configuration if the device permits it");
  const auto raw = encode(*found, value);
  if (!raw) co_return fail(with_name(raw.error()));
  const auto written =
      raw->size() == 1 ? co_await node_.write(found->address, raw->front(), in(TransactionClass::parameters))
                       : co_await node_.write_block(found->address, *raw, in(TransactionClass::parameters));
  if (!written) co_return fail(with_name(written.error()));
  const auto back = co_await node_.read_patiently(found->address, register_count(found->type),
                                                  in(TransactionClass::parameters));
  if (!back) co_return fail(with_name(back.error()));
  const auto actual = decode(*found, back->registers);
  values_[static_cast<std::size_t>(found - settings_.registers.begin())] = actual;
  measured_at_ = back->answered_at;
  publish();
  if (back->registers == *raw) co_return actual;
  co_return fail(with_name(
      {.reason = Reason::misconfigured,
       .message = fmt::format("{} reads {} after {} was written", name, actual, decode(*found, *raw)),
       .remedy = "check the range that the device permits, and whether something else writes to it",
       .outcome = Outcome::not_executed,
       .where = {.bus = settings_.bus, .node = settings_.node, .object = found->address}}));
}

Error ModbusDevice::with_name(Error error) const {
  const auto prefix = settings_.name + ": ";
  if (!error.message.starts_with(prefix)) error.message.insert(0, prefix);
  return error;
}

Error ModbusDevice::unknown_register(std::string_view name) const {
  std::string known;
  for (const auto& one : settings_.registers) known += (known.empty() ? "" : ", ") + one.name;
  return {.reason = Reason::invalid_argument,
          .message = fmt::format("{} has no register '{}'", settings_.name, name),
          .remedy = fmt::format("it has: {}", known)};
}

void ModbusDevice::publish() {
  auto next = boost::make_shared<DeviceSnapshot>();
  next->name = settings_.name;
  next->bus = settings_.bus;
  next->node = settings_.node;
  next->link = link_;
  next->error = error_;
  for (std::size_t i = 0; i < values_.size(); ++i) {
    const auto& one = settings_.registers[i];
    next->values.push_back(
        {.name = one.name, .unit = one.unit, .value = values_[i], .writable = one.writable});
  }
  if (measured_at_ != TimePoint{}) next->measured_at = clock_->wall(measured_at_);
  snapshot_.store(std::move(next));
}

}  // namespace axisd
