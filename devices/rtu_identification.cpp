#include "devices/rtu_identification.hpp"

#include <algorithm>

namespace axisd {

namespace {

Task<Result<bool>> has_register(const modbus_rtu::Node& node, std::uint16_t address,
                                TransactionOptions options) {
  // Exception 01 means a damaged frame with these drives (manuals 6.2.4): it says nothing of the register.
  constexpr std::uint32_t damaged = 1;
  constexpr int attempts = 3;
  for (int attempt = 1;; ++attempt) {
    const auto answer = co_await node.read_patiently(address, 1, options);
    if (answer) co_return true;
    const auto& error = answer.error();
    const bool unclear = error.reason == Reason::refused && error.where.native_code == damaged;
    if (unclear && attempt < attempts) continue;
    if (error.reason == Reason::refused && !unclear) co_return false;
    co_return fail(error);
  }
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
