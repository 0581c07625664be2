#include "devices/rtu_identification.hpp"

#include <algorithm>
#include <optional>

namespace axisd {

namespace {

bool is_shown_by(const DriveDescriptor& model, RtuRead read) {
  return model.bus == BusKind::modbus_rtu && model.identification.read == read;
}

std::vector<RtuRead> distinct_reads() {
  std::vector<RtuRead> reads;
  for (const auto* model : drive_models()) {
    const auto& read = model->identification.read;
    if (model->bus == BusKind::modbus_rtu && std::ranges::find(reads, read) == reads.end())
      reads.push_back(read);
  }
  const auto most = std::ranges::max_element(reads, {}, [](RtuRead read) {
    return std::ranges::count_if(drive_models(), [&](const auto* one) { return is_shown_by(*one, read); });
  });
  if (most != reads.end()) std::rotate(reads.begin(), most, most + 1);
  return reads;
}

Task<Result<bool>> has_register(const modbus_rtu::Node& node, std::uint16_t address,
                                std::optional<std::uint8_t> damaged_frame, TransactionOptions options) {
  constexpr int attempts = 3;
  for (int attempt = 1;; ++attempt) {
    const auto answer = co_await node.read_patiently(address, 1, options);
    if (answer) co_return true;
    const auto& error = answer.error();
    const bool refused = error.reason == Reason::refused;
    const bool unclear = refused && damaged_frame && error.where.native_code == *damaged_frame;
    if (unclear && attempt < attempts) continue;
    if (refused && !unclear) co_return false;
    co_return fail(error);
  }
}

}  // namespace

std::span<const RtuRead> rtu_identity_reads() {
  static const auto reads = distinct_reads();
  return reads;
}

std::vector<const DriveDescriptor*> rtu_models_with_code(RtuRead read,
                                                         std::span<const std::uint16_t> registers) {
  std::vector<const DriveDescriptor*> models;
  for (const auto* model : drive_models()) {
    if (!is_shown_by(*model, read)) continue;
    const auto at = model->identification.code_at;
    const auto codes = model->identification.model_codes;
    if (at < registers.size() && std::ranges::find(codes, registers[at]) != codes.end())
      models.push_back(model);
  }
  return models;
}

Task<Result<bool>> probes_fit(const modbus_rtu::Node& node, const RtuIdentification& identification,
                              TransactionOptions options) {
  const auto damaged = identification.damaged_frame;
  if (identification.has_register) {
    const auto present = co_await has_register(node, *identification.has_register, damaged, options);
    if (!present || !*present) co_return present;
  }
  if (identification.lacks_register) {
    const auto present = co_await has_register(node, *identification.lacks_register, damaged, options);
    if (!present) co_return present;
    co_return !*present;
  }
  co_return true;
}

Task<Result<const DriveDescriptor*>> find_fitting_model(const modbus_rtu::Node& node,
                                                        std::vector<const DriveDescriptor*> models,
                                                        TransactionOptions options) {
  for (const auto* model : models) {
    const auto fits = co_await probes_fit(node, model->identification, options);
    if (!fits) co_return fail(fits.error());
    if (*fits) co_return model;
  }
  co_return nullptr;
}

}  // namespace axisd
