#include "devices/simulation/canopen_objects.hpp"

namespace axisd::simulation {

std::int64_t CanopenObjects::value(const ObjectRow& row) const {
  const auto computed = hooks_.read ? hooks_.read(row) : std::nullopt;
  return computed.value_or(dictionary_->get(row.index, row.sub));
}

std::uint32_t CanopenObjects::read(std::uint16_t index, std::uint8_t sub,
                                   std::vector<std::uint8_t>& bytes) const {
  const auto* row = dictionary_->find(index, sub);
  if (row == nullptr) return dictionary_->missing(index);
  if (row->access == Access::wo) return abort_code::write_only;
  if (!row->text.empty()) {
    bytes.assign(row->text.begin(), row->text.end());
    return abort_code::none;
  }
  const auto raw = static_cast<std::uint64_t>(value(*row));
  bytes.clear();
  for (unsigned i = 0; i < row->size; ++i) bytes.push_back(static_cast<std::uint8_t>(raw >> (8 * i)));
  return abort_code::none;
}

std::uint32_t CanopenObjects::write(std::uint16_t index, std::uint8_t sub,
                                    std::span<const std::uint8_t> bytes, bool shorter_allowed) {
  const auto* row = dictionary_->find(index, sub);
  if (row == nullptr) return dictionary_->missing(index);
  if (row->access == Access::ro || !row->text.empty()) return abort_code::read_only;
  if (bytes.size() > row->size) return abort_code::too_long;
  if (bytes.size() < row->size && (bytes.empty() || !shorter_allowed)) return abort_code::too_short;
  const auto value = decode(*row, bytes);
  if (const auto refused = CanopenDictionary::check_write(*row, value); refused != abort_code::none)
    return refused;
  bool store = true;
  if (hooks_.write)
    if (const auto refused = hooks_.write(*row, value, store); refused != abort_code::none) return refused;
  if (!store) return abort_code::none;
  dictionary_->set(index, sub, value);  // first: what decides about saving may be this very object
  const bool saves = row->access == Access::rw_saved && (!hooks_.saves || hooks_.saves(*row));
  dictionary_->write(*row, value, saves);
  if (hooks_.written) hooks_.written(*row);
  return abort_code::none;
}

}  // namespace axisd::simulation
