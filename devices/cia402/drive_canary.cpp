// The canary that every start depends on (M6, M7).
#include <fmt/format.h>

#include <algorithm>
#include <utility>

#include "devices/cia402/drive.hpp"

namespace axisd::cia402 {

MotionBlock Cia402Drive::fresh_neutral_block() const {
  constexpr int neutral_rpm = 60, braking_rpm = 1000, lowest_start = 5, most_different = 61;
  constexpr auto neutral_time = std::chrono::milliseconds(100);
  // One ramp differs a little each time: a record of an earlier power cycle then never fits this one.
  const auto moment = clock_->now().time_since_epoch() / std::chrono::milliseconds(1);
  const auto differs = 1 + static_cast<std::int32_t>(moment % most_different);
  // The data sheet of a drive may not allow as little, or as much.
  const auto within = [this](Object object, std::int64_t value) {
    const auto* known = find_parameter(model_->descriptor->parameters, object.key());
    if (known != nullptr) value = std::max(std::min(value, known->maximum - most_different), known->minimum);
    return static_cast<std::int32_t>(value);
  };
  const auto pulses = setup_.pulses_per_revolution;
  // A homing has ramps of its own, but a halt brakes it on these.
  const auto ramps = encode(
      *model_, pulses,
      MoveProfile{
          .velocity_rpm = braking_rpm, .acceleration_time = neutral_time, .deceleration_time = neutral_time});
  const bool two_ramps = model_->descriptor->capabilities.own_deceleration;
  // Target 0: should a terminal start a relative move, it goes nowhere.
  return {0, within(object::profile_velocity, encode_velocity(*model_, pulses, neutral_rpm)),
          within(object::acceleration, ramps[acceleration]) + (two_ramps ? 0 : differs),
          two_ramps ? within(object::deceleration, ramps[deceleration]) + differs : 0,
          model_->objects.start_speed ? lowest_start : 0};
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
  if (contact_.rebooted()) co_return fail(lost_memory());
  const auto asked = clock_->now();
  const auto foreign = bus_->master().traffic(node_.id()).foreign_writes;
  const auto block = co_await read_block(std::move(options));
  if (!block) co_return fail(block.error());
  if (contact_.rebooted()) co_return fail(lost_memory());
  if (const auto alone = check_alone(); !alone) co_return fail(alone.error());
  if (!canary_.is_expected(*block)) {
    forget_power_cycle();
    canary_.note_power_up(*block);
    co_return fail(lost_memory());
  }
  canary_.found(*block, foreign);
  co_return asked;
}

/// The last look before a trigger. A node that is heard would have told of a restart (boot-up message): what
/// tells the block from that after a power-up is enough then, so that slow answers fit into reboot_guard.
/// Else, and where another master has written to the node since it was read, all of it is read. The time:
/// before the first of it was asked for.
Task<Result<TimePoint>> Cia402Drive::prove_block(SdoOptions options) {
  const auto asked = clock_->now();
  const bool alone = !canary_.may_be_foreign(bus_->master().traffic(node_.id()).foreign_writes);
  if (!alive(asked) || canary_.state() != ObjectCanary::State::block || !alone)
    co_return co_await read_canary(std::move(options));
  const auto block = canary_.blocks().front();
  const auto losses = bus_->losses();
  for (const auto& [field, object] : canary_.telling(block, motion_objects(*model_))) {
    const auto value = co_await read_object(object, options);
    if (!value) co_return fail(value.error());
    if (contact_.rebooted()) co_return fail(lost_memory());
    const bool proves = *value == block.at(field) && losses == bus_->losses();
    if (!proves) co_return co_await read_canary(std::move(options));
  }
  if (!canary_.is(block)) co_return fail(lost_memory());  // another sequence found it so meanwhile
  co_return asked;
}

Task<Result<void>> Cia402Drive::write_canary(MotionBlock block, SdoOptions options) {
  const auto objects = motion_objects(*model_);
  const bool known = canary_.state() == ObjectCanary::State::block;
  auto present = known ? canary_.blocks().front() : MotionBlock{};
  std::vector<MotionObject> written;
  for (const auto& one : objects) {
    if (known && present.at(one.field) == block.at(one.field)) continue;
    const auto done = co_await write_object(one.object, block.at(one.field), 0, options);
    if (contact_.rebooted()) co_return fail(lost_memory());
    auto after = present;
    after.at(one.field) = block.at(one.field);
    const bool uncertain = !done && done.error().outcome == Outcome::unknown;
    if (known)
      canary_.note_write(present, after,
                         done ? ObjectCanary::Written::yes
                              : (uncertain ? ObjectCanary::Written::unknown : ObjectCanary::Written::no));
    if (!done) co_return done;
    present = after;
    written.push_back(one);
  }
  canary_.written(block);
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
  const auto unbegun = start_pdo_.guard();
  if (const auto canary = co_await read_canary(options); !canary) co_return fail(canary.error());
  // The link, or the node's state, may have been lost in between.
  if (const auto settled = co_await settle(options); !settled) co_return settled;
  if (const auto started = co_await start_node(); !started || start_pdo_.state() != StartPdo::State::unproven)
    co_return started;
  co_await prove_common_start(unbegun);
  co_return co_await settle(options);
}

}  // namespace axisd::cia402
