#include "devices/cia402/object_canary.hpp"

#include <algorithm>
#include <utility>

namespace axisd::cia402 {

namespace {

/// In as many words as a mark has; of wider values the low half, which is enough to tell blocks apart.
ContinuityMark mark_of(const MotionBlock& block) {
  const auto low = [](std::int32_t value) { return static_cast<std::uint16_t>(value); };
  const auto target_bits = static_cast<std::uint32_t>(block[target]);
  return {static_cast<std::uint16_t>(target_bits >> 16U),
          static_cast<std::uint16_t>(target_bits),
          low(block[speed]),
          low(block[acceleration]),
          low(block[deceleration]),
          low(block[start_speed])};
}

}  // namespace

ObjectCanary::State ObjectCanary::state() const {
  if (blocks_.is_known()) return State::block;
  if (!blocks().empty()) return State::either;
  return marks_.empty() ? State::nothing : State::marks;
}

bool ObjectCanary::is_expected(const MotionBlock& block) const {
  return blocks_.is_expected(block) || std::ranges::find(marks_, mark_of(block)) != marks_.end();
}

void ObjectCanary::found(const MotionBlock& block, std::uint64_t foreign_writes) {
  written(block);
  foreign_writes_ = foreign_writes;
}

void ObjectCanary::note_write(const MotionBlock& before, const MotionBlock& after, Written written) {
  blocks_.written(written == Written::yes ? after : before);
  if (written == Written::unknown) blocks_.may_hold(after);
  // Halfway it may look like after a power-up: then it proves nothing.
  for (const auto& block : {before, after})
    if (blocks_.is_left_by_power_up(block)) blocks_.distrust(block);
}

void ObjectCanary::written(const MotionBlock& block) {
  blocks_.written(block);
  marks_.clear();
}

void ObjectCanary::forget() {
  blocks_.forget();
  marks_.clear();
}

void ObjectCanary::expect_marks(std::vector<ContinuityMark> marks) {
  blocks_.forget();
  marks_ = std::move(marks);
}

std::vector<MotionObject> ObjectCanary::telling(const MotionBlock& block,
                                                const std::vector<MotionObject>& objects) const {
  std::vector<MotionObject> telling;
  for (const auto& power_up : blocks_.power_up_blocks()) {
    const auto differs = [&](const MotionObject& one) {
      return power_up.at(one.field) != block.at(one.field);
    };
    if (std::ranges::any_of(telling, differs)) continue;
    const auto found = std::ranges::find_if(objects, differs);
    if (found == objects.end()) return objects;
    telling.push_back(*found);
  }
  return telling.empty() ? objects : telling;
}

std::optional<ContinuityMark> ObjectCanary::mark() const {
  if (state() == State::block) return mark_of(blocks().front());
  return marks_.size() == 1 ? std::optional(marks_.front()) : std::nullopt;
}

std::vector<ContinuityMark> ObjectCanary::marks_until(const MotionBlock& block) const {
  if (state() != State::block) return {};
  auto present = blocks().front();
  std::vector<ContinuityMark> marks = {mark_of(present)};
  for (std::size_t i = 0; i < present.size(); ++i) {
    if (present.at(i) == block.at(i)) continue;
    present.at(i) = block.at(i);
    if (!blocks_.is_left_by_power_up(present)) marks.push_back(mark_of(present));  // else it proves nothing
  }
  return marks;
}

}  // namespace axisd::cia402
