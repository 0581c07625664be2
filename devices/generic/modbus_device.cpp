#include "devices/generic/modbus_device.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <boost/smart_ptr/make_shared.hpp>
#include <utility>

namespace axisd {

namespace {

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

Task<Result<double>> ModbusDevice::write(std::string name, double value) {
  const auto found = std::ranges::find(settings_.registers, name, &RegisterSettings::name);
  if (found == settings_.registers.end()) co_return fail(unknown_register(name));
  if (!found->writable)
    co_return fail(Reason::invalid_argument, fmt::format("{}.{} is not writable", settings_.name, name),
                   "say `access: rw` for it in the configuration if the device permits it");
  const auto raw = encode(*found, value);
  if (!raw) co_return fail(with_name(raw.error()));
  auto sending = raw->size() == 1
                     ? node_.write(found->address, raw->front(), in(TransactionClass::parameters))
                     : node_.write_block(found->address, *raw, in(TransactionClass::parameters));
  const auto written = co_await std::move(sending);
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
