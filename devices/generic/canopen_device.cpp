#include "devices/generic/canopen_device.hpp"

#include <fmt/format.h>

#include <span>
#include <utility>

namespace axisd {

namespace {

canopen::Object object_of(const ValueSettings& value) {
  return {.index = static_cast<std::uint16_t>(value.address >> 8U),
          .sub = static_cast<std::uint8_t>(value.address & 0xFFU)};
}

}  // namespace

CanopenDevice::CanopenDevice(Executor executor, Clock& clock, canopen::CanopenBus& bus,
                             DeviceSettings settings)
    : Device(std::move(executor), clock, bus, std::move(settings)), bus_(&bus) {}

Task<Result<void>> CanopenDevice::poll_once() {
  Result<void> first;
  for (std::size_t i = 0; i < settings().values.size(); ++i) {
    const auto reading = co_await read_in(i, poll_class());
    if (closing()) co_return first;
    if (reading) {
      keep(i, *reading);
      continue;
    }
    auto error = with_name(reading.error());
    if (!is_answer(error)) co_return fail(std::move(error));
    forget(i);
    if (first) first = fail(std::move(error));
  }
  co_return first;
}

Task<Result<void>> CanopenDevice::write_raw(std::size_t index, std::uint32_t raw) {
  const auto& value = settings().values[index];
  const auto node = bus_->master().node(settings().node);
  const auto written = co_await node.write(object_of(value), raw, byte_count(value.type));
  if (!written) co_return fail(written.error());
  co_return Result<void>{};
}

Task<Result<Device::Reading>> CanopenDevice::read_raw(std::size_t index) {
  return read_in(index, TransactionClass::parameters);
}

Task<Result<Device::Reading>> CanopenDevice::read_in(std::size_t index, TransactionClass transaction_class) {
  const auto& value = settings().values[index];
  const auto object = object_of(value);
  canopen::SdoOptions options{.transaction_class = transaction_class};
  if (transaction_class == TransactionClass::scan) options.attempts = 1;  // it is asked again soon enough
  const auto answer = co_await bus_->master().sdo().upload(settings().node, object, std::move(options));
  if (!answer) co_return fail(answer.error());
  // Where the size is not indicated, 4 bytes came and the lowest count.
  const auto size = answer->bytes.size(), wanted = std::size_t{byte_count(value.type)};
  if (answer->size_indicated ? size != wanted : size < wanted) {
    Error error{.reason = Reason::misconfigured,
                .message = fmt::format("{} bytes came, not {}", size, wanted),
                .remedy = fmt::format("correct the type of {} in the configuration", value.name),
                .outcome = Outcome::refused,
                .where = {.bus = settings().bus, .node = settings().node, .object = object.key()}};
    co_return fail(std::move(error));
  }
  const std::span<const std::uint8_t> bytes(answer->bytes);
  co_return Reading{.raw = static_cast<std::uint32_t>(canopen::number_of(bytes.first(wanted))),
                    .at = answer->answered_at};
}

}  // namespace axisd
