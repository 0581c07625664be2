#include "devices/cia402/canary.hpp"

#include <algorithm>
#include <iterator>
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

Canary::State Canary::state() const {
  if (expected_.size() > 1) return State::either;
  if (expected_.size() == 1) return State::block;
  return marks_.empty() ? State::nothing : State::marks;
}

bool Canary::is_expected(const MotionBlock& block) const {
  return std::ranges::find(expected_, block) != expected_.end() ||
         std::ranges::find(marks_, mark_of(block)) != marks_.end();
}

bool Canary::is(const MotionBlock& block) const {
  return state() == State::block && expected_.front() == block;
}

bool Canary::left_by_power_up(const MotionBlock& block) const {
  return std::ranges::find(power_up_, block) != power_up_.end();
}

void Canary::found(const MotionBlock& block, std::uint64_t foreign_writes) {
  written(block);
  foreign_writes_ = foreign_writes;
}

void Canary::note_write(const MotionBlock& before, const MotionBlock& after, Written written) {
  expected_ = {written == Written::yes ? after : before};
  // Without a reply either content may stand there now.
  if (written == Written::unknown) expected_.push_back(after);
  // Halfway it may look like after a power-up: then it proves nothing.
  std::erase_if(expected_, [this](const MotionBlock& block) { return left_by_power_up(block); });
}

void Canary::written(const MotionBlock& block) {
  expected_ = {block};
  marks_.clear();
}

void Canary::forget() {
  expected_.clear();
  marks_.clear();
}

void Canary::expect_marks(std::vector<ContinuityMark> marks) {
  expected_.clear();
  marks_ = std::move(marks);
}

void Canary::note_power_up(const MotionBlock& block) {
  constexpr std::size_t most = 8;
  if (block == power_up_.front()) return;  // the factory's, for ever
  std::erase(power_up_, block);
  power_up_.push_back(block);
  if (power_up_.size() > most) power_up_.erase(std::next(power_up_.begin()));
}

MotionBlock Canary::distinct(MotionBlock block) const {
  constexpr std::int32_t high = 2000;
  while (left_by_power_up(block)) block[acceleration] += block[acceleration] < high ? 1 : -2;
  return block;
}

std::vector<MotionObject> Canary::telling(const MotionBlock& block,
                                          const std::vector<MotionObject>& objects) const {
  std::vector<MotionObject> telling;
  for (const auto& power_up : power_up_) {
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

std::optional<ContinuityMark> Canary::mark() const {
  if (state() == State::block) return mark_of(expected_.front());
  return marks_.size() == 1 ? std::optional(marks_.front()) : std::nullopt;
}

std::vector<ContinuityMark> Canary::marks_until(const MotionBlock& block) const {
  if (state() != State::block) return {};
  auto present = expected_.front();
  std::vector<ContinuityMark> marks = {mark_of(present)};
  for (std::size_t i = 0; i < present.size(); ++i) {
    if (present.at(i) == block.at(i)) continue;
    present.at(i) = block.at(i);
    if (!left_by_power_up(present)) marks.push_back(mark_of(present));  // else it proves nothing
  }
  return marks;
}

}  // namespace axisd::cia402
