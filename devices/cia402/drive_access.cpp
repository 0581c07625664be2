// Objects of the node in their sizes, and the driver's errors.
#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <utility>

#include "buses/canopen/sdo_abort.hpp"
#include "devices/cia402/drive.hpp"

namespace axisd::cia402 {

namespace {

constexpr auto read_pause = std::chrono::milliseconds(2);

}  // namespace

std::unexpected<Error> Cia402Drive::failed(Error error) const {
  if (!contact_.rebooted()) return fail(std::move(error));
  auto lost = lost_memory();  // whatever the node answered, this is the reason
  lost.outcome = error.outcome;
  return fail(std::move(lost));
}

Error Cia402Drive::error_at(Reason reason, Object object, std::string message, std::string remedy) const {
  return {.reason = reason,
          .message = std::move(message),
          .remedy = std::move(remedy),
          .outcome = Outcome::not_executed,
          .where = {.bus = bus_->name(), .node = node_.id(), .object = object.key()}};
}

Error Cia402Drive::lost_memory() const {
  return error_at(Reason::rebooted, object::target_position,
                  "the drive lost its memory: it was switched off and on",
                  "enable the axis again, then home it; nothing resumes by itself");
}

void Cia402Drive::forget_power_cycle() {
  canary_.forget();
  words_.forget();
  forget_pdos();  // they are what a power-up left of them
  words_.forget_halt();
  configuration_.forget_power_cycle();
  seen_.forget_power_cycle();
  homing_.forget();
  motion_.forget();
}

Task<Result<std::int64_t>> Cia402Drive::read_object(Object object, SdoOptions options) {
  const auto answer = co_await node_.sdo().upload(node_.id(), object, std::move(options));
  if (!answer) co_return failed(answer.error());
  seen_.note_answer(answer->answered_at - answer->sent_at);
  constexpr std::size_t most = 8;
  const auto type = type_of(*model_, object);
  auto bytes = std::min(answer->bytes.size(), most);
  if (!answer->size_indicated) bytes = std::min<std::size_t>(bytes, seen_.size(object).value_or(type.bytes));
  if (bytes == 0)
    co_return fail(error_at(Reason::refused, object, "it came without data",
                            "check the configured model against the drive's firmware"));
  if (answer->size_indicated) seen_.sizes[object.key()] = static_cast<std::uint8_t>(bytes);
  const auto raw = canopen::number_of(std::span(answer->bytes).first(bytes));
  const auto value = type.is_signed ? canopen::sign_extended(raw, static_cast<unsigned>(8 * bytes))
                                    : static_cast<std::int64_t>(raw);
  if (object == model_->objects.position_window) seen_.position_window = value;
  if (object == model_->objects.velocity_threshold) seen_.velocity_threshold = value;
  if (object == object::quick_stop_deceleration) seen_.quick_stop_ramp = value;
  co_return value;
}

Task<Result<void>> Cia402Drive::write_object(Object object, std::int64_t value, std::uint8_t bytes,
                                             SdoOptions options) {
  const auto size = seen_.size(object).value_or(bytes != 0 ? bytes : type_of(*model_, object).bytes);
  std::vector<std::uint8_t> sizes{size, 4, 2, 1};
  for (std::size_t i = 0; i < sizes.size(); ++i) {
    if (std::find(sizes.begin(), sizes.begin() + static_cast<std::ptrdiff_t>(i), sizes[i]) !=
        sizes.begin() + static_cast<std::ptrdiff_t>(i))
      continue;
    const auto written = co_await node_.write(object, static_cast<std::uint64_t>(value), sizes[i], options);
    if (written) {
      seen_.sizes[object.key()] = sizes[i];
      co_return Result<void>{};
    }
    if (!canopen::is_wrong_size(written.error()) || i + 1 == sizes.size()) co_return failed(written.error());
    if (i > 0) continue;
    // The manual prints some objects in two sizes (6081h, 200Eh ...): the drive itself knows.
    const auto present = co_await node_.sdo().upload(node_.id(), object, options);
    if (present && present->size_indicated)
      sizes.insert(sizes.begin() + 1, static_cast<std::uint8_t>(present->bytes.size()));
  }
  co_return fail(error_at(Reason::misconfigured, object, "the drive takes it in no size",
                          "check the configured model against the drive's firmware"));
}

Task<Result<void>> Cia402Drive::write_verified(Object object, std::int64_t value, SdoOptions options) {
  if (const auto written = co_await write_object(object, value, 0, options); !written) co_return written;
  const auto present = co_await read_object(object, std::move(options));
  if (!present) co_return fail(present.error());
  if (*present == value) co_return Result<void>{};
  co_return fail(error_at(Reason::misconfigured, object,
                          fmt::format("it reads {} after {} was written", *present, value),
                          "check whether another master writes to this drive"));
}

Task<Result<std::int64_t>> Cia402Drive::read_until(Object object, std::function<bool(std::int64_t)> fits,
                                                   Duration limit, SdoOptions options) {
  const auto until = clock_->now() + limit;
  for (;;) {
    auto value = co_await read_object(object, options);
    if (!value || fits(*value) || clock_->now() >= until) co_return value;
    co_await sleep_until(executor_, *clock_, clock_->now() + read_pause);
  }
}

}  // namespace axisd::cia402
