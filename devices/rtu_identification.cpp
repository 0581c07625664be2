#include "devices/rtu_identification.hpp"

#include <algorithm>

namespace axisd {

namespace {

Task<Result<bool>> has_register(const modbus_rtu::Node& node, std::uint16_t address,
                                TransactionOptions options) {
  const auto answer = co_await node.read_patiently(address, 1, std::move(options));
  if (answer) co_return true;
  if (answer.error().reason == Reason::refused) co_return false;
  co_return fail(answer.error());
}

}  // namespace

Task<Result<bool>> probes_fit(const modbus_rtu::Node& node, const RtuIdentification& identification,
                              TransactionOptions options) {
  if (identification.has_register) {
    const auto present = co_await has_register(node, *identification.has_register, options);
    if (!present || !*present) co_return present;
  }
  if (identification.lacks_register) {
    const auto present = co_await has_register(node, *identification.lacks_register, options);
    if (!present) co_return present;
    co_return !*present;
  }
  co_return true;
}

Task<Result<const DriveDescriptor*>> find_rtu_model(const modbus_rtu::Node& node, std::uint16_t code,
                                                    TransactionOptions options) {
  for (const auto* descriptor : drive_models()) {
    const auto& identification = descriptor->identification;
    if (descriptor->bus != BusKind::modbus_rtu) continue;
    if (std::ranges::find(identification.model_codes, code) == identification.model_codes.end()) continue;
    const auto fits = co_await probes_fit(node, identification, options);
    if (!fits) co_return fail(fits.error());
    if (*fits) co_return descriptor;
  }
  co_return nullptr;
}

}  // namespace axisd
