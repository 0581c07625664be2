#include "devices/cia402/state_pdos.hpp"

#include <algorithm>
#include <utility>

namespace axisd::cia402 {

void StatePdos::begin(const Model& model, std::vector<canopen::PdoMapping> layout, bool synchronous) {
  *this = {};
  model_ = &model;
  layout_ = std::move(layout);
  synchronous_ = synchronous;
  parts_.resize(layout_.size());
}

bool StatePdos::complete() const {
  return !parts_.empty() && std::ranges::all_of(parts_, [](const Part& part) { return part.there; });
}

void StatePdos::on_sync(TimePoint at) {
  if (!synchronous_) return;
  if (sync_ && !complete()) late_ = true;
  previous_sync_ = std::exchange(sync_, at);
  for (auto& part : parts_) part.there = false;
}

bool StatePdos::on_pdo(std::size_t index, std::span<const std::uint8_t> bytes, TimePoint begin,
                       TimePoint end) {
  auto values = canopen::unpack_pdo(layout_.at(index), bytes);
  if (!values || (synchronous_ && !sync_)) return false;
  if (parts_.at(index).there) late_ = false;
  parts_.at(index) = {.values = std::move(*values), .begin = begin, .end = end, .there = true};
  if (!complete()) return false;
  if (synchronous_)
    assemble(late_ ? previous_sync_.value_or(*sync_) : *sync_);
  else
    assemble(std::ranges::min(parts_, {}, &Part::begin).begin);
  return true;
}

void StatePdos::assemble(TimePoint asked_at) {
  Reading reading{.asked_at = asked_at};
  for (std::size_t i = 0; i < parts_.size(); ++i) {
    reading.measured_at = std::max(reading.measured_at, parts_[i].end);
    for (std::size_t entry = 0; entry < layout_[i].size(); ++entry) {
      const auto& mapped = layout_[i][entry];
      const auto raw = parts_[i].values[entry];
      reading.values[mapped.object.key()] = type_of(*model_, mapped.object).is_signed
                                                ? canopen::sign_extended(raw, mapped.bits)
                                                : static_cast<std::int64_t>(raw);
    }
  }
  newest_ = std::move(reading);
}

std::optional<Reading> StatePdos::since(TimePoint since) const {
  if (!newest_ || newest_->asked_at < since) return std::nullopt;
  return newest_;
}

}  // namespace axisd::cia402
