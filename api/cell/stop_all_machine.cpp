#include "api/cell/stop_all_machine.hpp"

#include <algorithm>
#include <utility>

namespace axisd::cell {
namespace {

bool is_released(const v1::StopAllLatch& latch) { return !latch.released_by().empty(); }

/// What an entrance would write: an id that is a key, texts that can be shown.
bool is_usable(const v1::StopAllLatch& latch) {
  constexpr std::size_t longest_id = 64, longest_name = 128, longest_reason = 256;
  return !latch.id().empty() && latch.id().size() <= longest_id && latch.by().size() <= longest_name &&
         latch.released_by().size() <= longest_name && latch.entrance().size() <= longest_name &&
         latch.reason().size() <= longest_reason;
}

}  // namespace

StopAllMachine::Latch StopAllMachine::stop(Latch latch) {
  audience_.clear();  // for a new one everybody is told, whatever they said before
  const auto all = standing();
  for (const auto& other : all)
    if (all.size() >= most || (other.by() == latch.by() && other.reason() == latch.reason())) return other;
  latches_.insert_or_assign(latch.id(), latch);
  forget_oldest();
  return latch;
}

std::vector<StopAllMachine::Latch> StopAllMachine::release(const std::string& by,
                                                           const google::protobuf::Timestamp& at) {
  std::vector<Latch> ended;
  for (auto& [id, latch] : latches_) {
    if (is_released(latch)) continue;
    latch.set_released_by(by.empty() ? "unknown" : by);
    *latch.mutable_released_at() = at;
    ended.push_back(latch);
  }
  if (!ended.empty()) audience_.clear();
  return ended;
}

void StopAllMachine::put(const Latch& latch, Merged& merged) {
  const auto known = latches_.find(latch.id());
  if (known == latches_.end()) {
    if (latches_.size() >= 2 * most) return;
    latches_.emplace(latch.id(), latch);
    if (!is_released(latch)) merged.began.push_back(latch);
    return;
  }
  if (is_released(latch) && !is_released(known->second)) {
    known->second = latch;
    merged.ended.push_back(latch);
    return;
  }
  if (!is_released(latch) && is_released(known->second)) merged.other_lacks = true;
}

StopAllMachine::Merged StopAllMachine::merge(const google::protobuf::RepeatedPtrField<Latch>& others) {
  Merged merged;
  std::size_t common = 0;
  const auto before = latches_.size();
  for (const auto& latch : others) {
    if (!is_usable(latch)) continue;
    if (latches_.contains(latch.id())) ++common;
    put(latch, merged);
  }
  if (common < before) merged.other_lacks = true;
  if (!merged.began.empty()) audience_.clear();
  if (!merged.ended.empty() && !stands()) audience_.clear();
  forget_oldest();
  return merged;
}

void StopAllMachine::forget_oldest() {
  while (latches_.size() > most) {
    auto oldest = latches_.end();
    for (auto it = latches_.begin(); it != latches_.end(); ++it)
      if (is_released(it->second) && (oldest == latches_.end() || it->second.released_at().seconds() <
                                                                      oldest->second.released_at().seconds()))
        oldest = it;
    if (oldest == latches_.end()) return;  // all of them stand
    latches_.erase(oldest);
  }
}

bool StopAllMachine::stands() const {
  return std::ranges::any_of(latches_, [](const auto& entry) { return !is_released(entry.second); });
}

std::vector<StopAllMachine::Latch> StopAllMachine::standing() const {
  std::vector<Latch> all;
  for (const auto& [id, latch] : latches_)
    if (!is_released(latch)) all.push_back(latch);
  std::ranges::sort(all, {},
                    [](const Latch& latch) { return std::pair(latch.at().seconds(), latch.at().nanos()); });
  return all;
}

kept::StopAllRecord StopAllMachine::record() const {
  kept::StopAllRecord record;
  for (const auto& [id, latch] : latches_) *record.add_latches() = latch;
  return record;
}

kept::StopAllRecord StopAllMachine::record_with_told() const {
  auto record = this->record();
  for (const auto& [machine, audience] : audience_) {
    if (audience.told.empty()) continue;
    auto& told = *record.add_told();
    told.set_machine(machine);
    told.set_instance_id(audience.told);
  }
  return record;
}

void StopAllMachine::restore(const kept::StopAllRecord& record) {
  (void)merge(record.latches());
  if (!stands()) return;
  for (const auto& told : record.told()) audience_[told.machine()].told = told.instance_id();
}

bool StopAllMachine::seen(const std::string& machine, const std::string& instance_id, bool inhibited) {
  if (!stands()) return false;
  auto& audience = audience_[machine];
  if (audience.told == instance_id || audience.being_told) return false;
  if (inhibited) {
    audience.told = instance_id;
    return false;
  }
  audience.being_told = true;
  return true;
}

bool StopAllMachine::told(const std::string& machine, const std::string& instance_id) {
  if (!stands()) return false;
  auto& audience = audience_[machine];
  audience.being_told = false;
  return std::exchange(audience.told, instance_id) != instance_id;
}

void StopAllMachine::not_told(const std::string& machine) {
  if (const auto found = audience_.find(machine); found != audience_.end()) found->second.being_told = false;
}

}  // namespace axisd::cell
