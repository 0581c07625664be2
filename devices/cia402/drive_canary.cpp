// The canary that every start depends on (M6, M7).
#include <fmt/format.h>

#include <algorithm>
#include <utility>

#include "devices/cia402/drive.hpp"

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

std::optional<ContinuityMark> Cia402Drive::continuity_mark() const {
  if (expected_.size() == 1) return mark_of(expected_.front());
  return expected_marks_.size() == 1 ? std::optional(expected_marks_.front()) : std::nullopt;
}

void Cia402Drive::expect_marks(const std::vector<ContinuityMark>& marks) {
  expected_.clear();
  expected_marks_ = marks;
}

/// Its objects are written one after the other.
std::vector<ContinuityMark> Cia402Drive::marks_until(const MotionBlock& block) const {
  if (expected_.size() != 1) return {};
  auto present = expected_.front();
  std::vector<ContinuityMark> marks = {mark_of(present)};
  for (std::size_t i = 0; i < present.size(); ++i) {
    if (present.at(i) == block.at(i)) continue;
    present.at(i) = block.at(i);
    // Halfway it may look like after a power-up: then it proves nothing.
    if (std::ranges::find(power_up_blocks_, present) == power_up_blocks_.end())
      marks.push_back(mark_of(present));
  }
  return marks;
}

MotionBlock Cia402Drive::fresh_neutral_block() const {
  constexpr int neutral_rpm = 60, neutral_time = 100, lowest_start = 5;
  // One ramp differs a little each time: a record of an earlier power cycle then never fits this one.
  const auto moment = clock_->now().time_since_epoch() / std::chrono::milliseconds(1);
  const auto differs = 1 + static_cast<std::int32_t>(moment % 61);
  // The data sheet of a drive may not allow as little.
  const auto at_least = [this](Object object, std::int32_t value) {
    const auto* known = find_parameter(model_->descriptor->parameters, object.key());
    return known == nullptr ? value
                            : static_cast<std::int32_t>(std::max<std::int64_t>(value, known->minimum));
  };
  const auto velocity = encode_velocity(*model_, setup_.pulses_per_revolution, neutral_rpm);
  const bool two_ramps = model_->descriptor->capabilities.own_deceleration;
  // Target 0: should a terminal start a relative move, it goes nowhere.
  return {0, at_least(object::profile_velocity, velocity),
          at_least(object::acceleration, neutral_time) + (two_ramps ? 0 : differs),
          two_ramps ? at_least(object::deceleration, neutral_time) + differs : 0,
          model_->objects.start_speed ? lowest_start : 0};
}

MotionBlock Cia402Drive::distinct(MotionBlock block) const {
  constexpr std::int32_t high = 2000;
  while (std::ranges::find(power_up_blocks_, block) != power_up_blocks_.end())
    block[acceleration] += block[acceleration] < high ? 1 : -2;
  return block;
}

void Cia402Drive::note_power_up_block(const MotionBlock& block) {
  constexpr std::size_t most = 8;
  if (!power_up_blocks_.empty() && block == power_up_blocks_.front()) return;  // the factory's, for ever
  std::erase(power_up_blocks_, block);
  power_up_blocks_.push_back(block);
  if (power_up_blocks_.size() > most) power_up_blocks_.erase(std::next(power_up_blocks_.begin()));
}

bool Cia402Drive::is_expected(const MotionBlock& block) const {
  return std::ranges::find(expected_, block) != expected_.end() ||
         std::ranges::find(expected_marks_, mark_of(block)) != expected_marks_.end();
}

Task<Result<MotionBlock>> Cia402Drive::read_block(SdoOptions options) {
  MotionBlock block{};
  for (const auto& [field, object] : motion_objects(*model_)) {
    const auto value = co_await read_object(object, options);
    if (!value) co_return fail(value.error());
    block.at(field) = static_cast<std::int32_t>(*value);
  }
  co_return block;
}

Task<Result<TimePoint>> Cia402Drive::read_canary(SdoOptions options) {
  if (rebooted_) co_return fail(lost_memory());
  const auto asked = clock_->now();
  const auto foreign = bus_->master().traffic(node_.id()).foreign_writes;
  const auto block = co_await read_block(std::move(options));
  if (!block) co_return fail(block.error());
  if (rebooted_) co_return fail(lost_memory());
  if (const auto alone = check_alone(); !alone) co_return fail(alone.error());
  if (!is_expected(*block)) {
    forget_power_cycle();
    note_power_up_block(*block);
    co_return fail(lost_memory());
  }
  expected_ = {*block};
  expected_marks_.clear();
  foreign_at_block_ = foreign;
  co_return asked;
}

/// In the fewest objects that differ from each content which a power-up may leave.
std::vector<MotionObject> Cia402Drive::telling_objects(const MotionBlock& block) const {
  const auto objects = motion_objects(*model_);
  std::vector<MotionObject> telling;
  for (const auto& power_up : power_up_blocks_) {
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

/// The last look before a trigger. A node that is heard would have told of a restart (boot-up message): what
/// tells the block from that after a power-up is enough then, so that slow answers fit into reboot_guard.
/// Else, and where another master has written to the node since it was read, all of it is read. The time:
/// before the first of it was asked for.
Task<Result<TimePoint>> Cia402Drive::prove_block(SdoOptions options) {
  const auto asked = clock_->now();
  const bool alone = bus_->master().traffic(node_.id()).foreign_writes == foreign_at_block_;
  if (!alive(asked) || expected_.size() != 1 || !alone) co_return co_await read_canary(std::move(options));
  const auto block = expected_.front();
  const auto losses = bus_->losses();
  for (const auto& [field, object] : telling_objects(block)) {
    const auto value = co_await read_object(object, options);
    if (!value) co_return fail(value.error());
    if (rebooted_) co_return fail(lost_memory());
    const bool proves = *value == block.at(field) && losses == bus_->losses();
    if (!proves) co_return co_await read_canary(std::move(options));
  }
  co_return asked;
}

Task<Result<void>> Cia402Drive::write_canary(MotionBlock block, SdoOptions options) {
  const auto objects = motion_objects(*model_);
  const bool known = expected_.size() == 1;
  auto present = known ? expected_.front() : MotionBlock{};
  std::vector<MotionObject> written;
  for (const auto& one : objects) {
    if (known && present.at(one.field) == block.at(one.field)) continue;
    const auto done = co_await write_object(one.object, block.at(one.field), 0, options);
    if (rebooted_) co_return fail(lost_memory());
    const bool uncertain = !done && done.error().outcome == Outcome::unknown;
    auto after = present;
    after.at(one.field) = block.at(one.field);
    if (known) {
      expected_ = {present};
      if (uncertain) expected_.push_back(after);  // without a reply either content may stand there now
      if (done) expected_ = {after};
      // Halfway it may look like after a power-up: then it proves nothing.
      for (const auto& power_up : power_up_blocks_) std::erase(expected_, power_up);
    }
    if (!done) co_return done;
    present = after;
    written.push_back(one);
  }
  expected_ = {block};
  expected_marks_.clear();
  for (const auto& [field, object] : written) {
    const auto value = co_await read_object(object, options);
    if (!value) co_return fail(value.error());
    if (*value != block.at(field))
      co_return fail(error_at(Reason::misconfigured, object,
                              fmt::format("it reads {} after {} was written", *value, block.at(field)),
                              "check whether another master writes to this drive"));
  }
  co_return Result<void>{};
}

Task<Result<void>> Cia402Drive::check_continuity(TransactionClass transaction_class) {
  const SdoOptions options{.transaction_class = transaction_class};
  const MotionGuard unbegun{.gate = start_gate_, .epoch = start_gate_->epoch()};
  if (const auto canary = co_await read_canary(options); !canary) co_return fail(canary.error());
  // The link, or the node's state, may have been lost in between.
  if (const auto settled = co_await settle(options); !settled) co_return settled;
  if (const auto started = co_await start_node(); !started || !proof_due_) co_return started;
  co_await prove_common_start(unbegun);
  co_return co_await settle(options);
}

}  // namespace axisd::cia402
