#include "devices/generic/device.hpp"

#include <fmt/format.h>
#include <spdlog/spdlog.h>

#include <algorithm>
#include <boost/smart_ptr/make_shared.hpp>
#include <utility>

#include "devices/generic/value.hpp"

namespace axisd {

namespace {

constexpr Duration first_backoff = std::chrono::milliseconds(100);
/// A wait for a silent node takes some 30 ms of a line: this keeps its share below 2 %.
constexpr Duration longest_backoff = std::chrono::seconds(2);
constexpr int attempts_before_offline = 3;

}  // namespace

Device::Device(Executor executor, Clock& clock, Bus& bus, DeviceSettings settings)
    : executor_(std::move(executor)),
      clock_(&clock),
      bus_(&bus),
      settings_(std::move(settings)),
      wake_(executor_, clock),
      values_(settings_.values.size()) {
  publish();
}

void Device::start() {
  polling_ = true;
  spawn(executor_, run(), fmt::format("{} poll", settings_.name));
}

void Device::close() {
  closing_ = true;
  wake_.notify_all();
  bus_->port_changed().notify_all();
}

TransactionClass Device::poll_class() const {
  return link_ == LinkState::online ? TransactionClass::parameters : TransactionClass::scan;
}

void Device::keep(std::size_t index, const Reading& reading) {
  values_[index] = decode(settings_.values[index], reading.raw);
  measured_at_ = reading.at;
}

Task<Result<double>> Device::write(std::string name, double value) {
  const auto found = std::ranges::find(settings_.values, name, &ValueSettings::name);
  if (found == settings_.values.end()) co_return fail(unknown_value(name));
  if (!found->writable)
    co_return fail(Reason::invalid_argument, fmt::format("{}.{} is not writable", settings_.name, name),
                   "say `access: rw` for it in the configuration if the device permits it");
  const auto raw = encode(*found, value);
  if (!raw) co_return fail(with_name(raw.error()));
  const auto index = static_cast<std::size_t>(found - settings_.values.begin());
  const auto written = co_await write_raw(index, *raw);
  if (!written) co_return fail(with_name(written.error()));
  const auto back = co_await read_raw(index);
  if (!back) co_return fail(with_name(back.error()));
  keep(index, *back);
  publish();
  const auto actual = *values_[index];
  if (back->raw == *raw) co_return actual;
  co_return fail(with_name(
      {.reason = Reason::misconfigured,
       .message = fmt::format("{} reads {} after {} was written", name, actual, decode(*found, *raw)),
       .remedy = "check the range that the device permits, and whether something else writes to it",
       .outcome = Outcome::not_executed,
       .where = {.bus = settings_.bus, .node = settings_.node, .object = found->address}}));
}

Task<> Device::run() {
  auto backoff = first_backoff;
  int failures = 0;
  while (co_await port_is_open()) {
    const auto began = clock_->now();
    const auto polled = co_await poll_once();
    if (closing_) break;
    if (polled || is_answer(polled.error())) {
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
Task<bool> Device::port_is_open() {
  while (!closing_ && !bus_->port().open) {
    if (const auto& cause = bus_->port().error) go_offline(*cause);
    // Its own signal wakes it at the end, the port's when there is something to do.
    co_await bus_->port_changed().wait_until(clock_->now() + longest_backoff);
  }
  co_return !closing_;
}

void Device::go_online(const Result<void>& polled) {
  if (link_ != LinkState::online) spdlog::info("{}: online", settings_.name);
  if (!polled && (!error_ || error_->where.object != polled.error().where.object))
    spdlog::warn("{}", to_string(polled.error()));
  link_ = LinkState::online;
  error_ = polled ? std::nullopt : std::optional(polled.error());
  publish();
}

void Device::go_offline(const Error& cause) {
  const auto error = with_name(cause);
  if (link_ == LinkState::online || !error_ || error_->reason != error.reason)
    spdlog::warn("{}", to_string(error));
  link_ = LinkState::offline;
  error_ = error;
  publish();
}

Error Device::with_name(Error error) const {
  const auto prefix = settings_.name + ": ";
  if (!error.message.starts_with(prefix)) error.message.insert(0, prefix);
  return error;
}

Error Device::unknown_value(std::string_view name) const {
  std::string known;
  for (const auto& one : settings_.values) known += (known.empty() ? "" : ", ") + one.name;
  return {.reason = Reason::invalid_argument,
          .message = fmt::format("{} has no {} '{}'", settings_.name, settings_.noun(), name),
          .remedy = fmt::format("it has: {}", known)};
}

void Device::publish() {
  auto next = boost::make_shared<DeviceSnapshot>();
  next->name = settings_.name;
  next->bus = settings_.bus;
  next->node = settings_.node;
  next->link = link_;
  next->error = error_;
  for (std::size_t i = 0; i < values_.size(); ++i) {
    const auto& one = settings_.values[i];
    next->values.push_back(
        {.name = one.name, .unit = one.unit, .value = values_[i], .writable = one.writable});
  }
  if (measured_at_ != TimePoint{}) next->measured_at = clock_->wall(measured_at_);
  face_->snapshot.store(std::move(next));
}

}  // namespace axisd
