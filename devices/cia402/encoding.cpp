#include "devices/cia402/encoding.hpp"

#include <algorithm>
#include <cstdlib>

#include "devices/cia402/standstill.hpp"
#include "devices/cia402/status_word.hpp"

namespace axisd::cia402 {

namespace {

struct StandardType {
  canopen::Object object;
  ObjectType type;
};
constexpr auto standard_types = std::to_array<StandardType>({
    {object::emergency_id, {4, false}},
    {object::heartbeat_time, {2, false}},
    {object::error_code, {2, false}},
    {object::control_word, {2, false}},
    {object::status_word, {2, false}},
    {object::halt_option, {2, true}},
    {object::mode, {1, true}},
    {object::mode_display, {1, true}},
    {{0x6062, 0}, {4, true}},
    {object::position, {4, true}},
    {{0x6067, 0}, {4, false}},
    {{0x606C, 0}, {4, true}},
    {{0x606F, 0}, {2, false}},
    {object::target_position, {4, true}},
    {object::home_offset, {4, true}},
    {object::profile_velocity, {4, false}},
    {object::acceleration, {4, false}},
    {object::deceleration, {4, false}},
    {object::homing_method, {1, true}},
    {object::homing_speed, {4, false}},
    {object::homing_search_speed, {4, false}},
    {object::homing_acceleration, {4, false}},
    {{0x60FD, 0}, {4, false}},
    {{0x60FE, 1}, {4, false}},
    {object::target_velocity, {4, true}},
});

std::int32_t milliseconds_of(Duration time) {
  return static_cast<std::int32_t>(std::chrono::duration_cast<std::chrono::milliseconds>(time).count());
}

/// A time from `from_rpm` to `rpm` as the drive wants its ramps.
std::int32_t ramp(const Model& model, std::int64_t pulses_per_revolution, int rpm, Duration time,
                  RampUse use) {
  const auto& units = model.meaning.units;
  if (units.ramps == Ramps::times) return milliseconds_of(time);
  return ramp_of(units.acceleration, pulses_per_revolution, rpm, time, use);
}

/// With which a drive that has no other brakes, too.
std::int32_t starting_ramp(const Model& model, std::int64_t pulses_per_revolution, int rpm, Duration time) {
  const auto use = model.descriptor->capabilities.own_deceleration ? RampUse::start : RampUse::brake;
  return ramp(model, pulses_per_revolution, rpm, time, use);
}

/// 0: the drive has none of its own.
std::int32_t braking_ramp(const Model& model, std::int64_t pulses_per_revolution, int rpm, Duration time) {
  return model.descriptor->capabilities.own_deceleration
             ? ramp(model, pulses_per_revolution, rpm, time, RampUse::brake)
             : 0;
}

std::int64_t value_of(const Values& values, const std::optional<canopen::Object>& object) {
  if (!object) return 0;
  const auto found = values.find(object->key());
  return found == values.end() ? 0 : found->second;
}

}  // namespace

ObjectType type_of(const Model& model, canopen::Object object) {
  if (const auto* known = find_parameter(model.descriptor->parameters, object.key()))
    return {static_cast<std::uint8_t>(size_of(known->type)), is_signed(known->type)};
  const auto standard = std::ranges::find(standard_types, object, &StandardType::object);
  return standard == standard_types.end() ? ObjectType{} : standard->type;
}

bool has(const Model& model, canopen::Object object) {
  return find_parameter(model.descriptor->parameters, object.key()) != nullptr;
}

std::vector<canopen::Object> state_objects(const Model& model) {
  std::vector<canopen::Object> objects{object::status_word, object::position};
  const auto& vendor = model.objects;
  if (vendor.commanded_position) objects.push_back(*vendor.commanded_position);
  if (vendor.velocity) objects.push_back(*vendor.velocity);
  if (has(model, object::error_code)) objects.push_back(object::error_code);
  if (vendor.inputs) objects.push_back(*vendor.inputs);
  if (vendor.outputs) objects.push_back(*vendor.outputs);
  objects.push_back(object::mode_display);
  return objects;
}

std::vector<canopen::PdoMapping> state_layout(const Model& model) {
  constexpr std::size_t most_entries = 4, most_bytes = 8;
  std::vector<canopen::PdoMapping> layout;
  auto objects = state_objects(model);
  // Both positions are to be of one moment: one PDO carries them.
  if (model.objects.commanded_position)
    std::rotate(objects.begin(), objects.begin() + 1, objects.begin() + 3);
  for (const auto object : objects) {
    const auto bytes = type_of(model, object).bytes;
    if (layout.empty() || layout.back().size() == most_entries ||
        canopen::pdo_size(layout.back()) + bytes > most_bytes)
      layout.emplace_back();
    layout.back().push_back({.object = object, .bits = static_cast<std::uint8_t>(8U * bytes)});
  }
  return layout;
}

CanTransactionSet transactions_of(const Model& model, std::uint8_t watched) {
  CanTransactionSet set{.pdo_inhibit = inhibit_period,
                        .pdo_event = event_period,
                        .drift_transfers = watched,
                        .stop_transfers = stop_transfers};
  const auto layout = state_layout(model);
  for (std::size_t i = 0; i < std::min(layout.size(), set.state_pdos.size()); ++i)
    set.state_pdos.at(i) = static_cast<std::uint8_t>(canopen::pdo_size(layout[i]));
  const auto states = state_objects(model).size() + (model.objects.moving ? 1U : 0U);
  set.state_transfers = static_cast<std::uint8_t>(states);
  set.continuity_transfers = static_cast<std::uint8_t>(motion_objects(model).size());
  return set;
}

std::uint16_t alarm_of(const Model& model, std::uint16_t error_code) {
  const auto& meaning = model.meaning;
  const auto own = static_cast<std::uint16_t>(error_code & meaning.alarm_mask);
  const auto prefix = static_cast<std::uint16_t>(error_code & ~meaning.alarm_mask);
  return prefix == meaning.alarm_prefix ? own : error_code;
}

int decode_velocity(const Model& model, std::int64_t pulses_per_revolution, std::int64_t value) {
  return rpm_of(model.meaning.units.velocity, pulses_per_revolution, value);
}

std::optional<bool> told_motion(const Model& model, const Values& values, bool halted) {
  const auto word = static_cast<std::uint16_t>(value_of(values, object::status_word));
  if (model.status.moving != 0 || model.objects.moving)
    return (word & model.status.moving) != 0 || value_of(values, model.objects.moving) != 0;
  if (!is_energised(state_of(word))) return false;
  bool rests = false;
  switch (static_cast<OperationMode>(value_of(values, object::mode_display))) {
    case OperationMode::profile_velocity:
      rests = (word & status::mode_specific) != 0;
      break;
    case OperationMode::profile_position:
    case OperationMode::homing:
      rests = (word & status::target_reached) != 0;
      break;
    case OperationMode::none:  // there is no target: the change to this mode may have set it, too
      rests = halted && (word & status::target_reached) != 0;
      break;
  }
  return rests ? std::optional(false) : std::nullopt;
}

DriveSample decode_state(const Model& model, std::int64_t pulses_per_revolution, const Values& values,
                         ActiveLow active_low, int velocity_noise) {
  const auto word = static_cast<std::uint16_t>(value_of(values, object::status_word));
  const auto is = [word](std::uint16_t bits) { return (word & bits) != 0; };
  const auto& bits = model.status;
  const auto state = state_of(word);
  DriveSample sample;
  sample.position_pulses = static_cast<std::int32_t>(value_of(values, object::position));
  if (const auto& commanded = model.objects.commanded_position;
      commanded && values.contains(commanded->key()))
    sample.commanded_pulses = static_cast<std::int32_t>(value_of(values, commanded));
  const auto velocity = value_of(values, model.objects.velocity);
  sample.velocity_rpm = decode_velocity(model, pulses_per_revolution, velocity);
  sample.negative_direction = velocity < 0;
  // The manual shows motion in three places (6.2.2 bit 14, 2001h, 2002h): any one is enough to be careful.
  const bool turns = velocity_noise > 0 ? std::abs(sample.velocity_rpm) > velocity_noise : velocity != 0;
  sample.moving = is(bits.moving) || turns || value_of(values, model.objects.moving) != 0;
  const auto mode = static_cast<OperationMode>(value_of(values, object::mode_display));
  // In homing the appendix (MC_HOME) reads the maker's bit as "homing failed": there the state tells.
  const bool by_state = bits.enabled == 0 || mode == OperationMode::homing;
  sample.enabled = by_state ? is_energised(state) : is(bits.enabled);
  sample.homed = is(bits.homed) ||
                 (mode == OperationMode::homing && is(status::mode_specific) && is(status::target_reached));
  sample.in_position = bits.in_position != 0 ? is(bits.in_position) : is(status::target_reached);
  const bool faulty = state == State::fault || state == State::fault_reaction_active || is(bits.alarm);
  if (faulty || model.meaning.error_code_ends)
    sample.alarm_code = alarm_of(model, static_cast<std::uint16_t>(value_of(values, object::error_code)));
  if (sample.alarm_code == 0 && faulty) sample.alarm_code = alarm_without_code;
  // 60FDh has inputs of the maker's beyond those that CiA 402 names.
  const auto known = (std::uint64_t{1} << model.descriptor->inputs.size()) - 1;
  const auto inputs = known & static_cast<std::uint64_t>(value_of(values, model.objects.inputs));
  sample.inputs = static_cast<std::uint32_t>(inputs) ^ active_low.inputs;
  sample.outputs = static_cast<std::uint32_t>(value_of(values, model.objects.outputs)) ^ active_low.outputs;
  return sample;
}

std::optional<bool> home_bit(const Model& model, const Values& values) {
  const auto word = static_cast<std::uint16_t>(value_of(values, object::status_word));
  if ((word & model.status.homed) != 0) return true;
  const auto mode = static_cast<OperationMode>(value_of(values, object::mode_display));
  if (mode == OperationMode::homing) return (word & status::mode_specific) != 0;
  return model.status.homed != 0 ? std::optional(false) : std::nullopt;
}

bool homing_failed(const Model& model, const Values& values) {
  const auto word = static_cast<std::uint16_t>(value_of(values, object::status_word));
  const auto mode = static_cast<OperationMode>(value_of(values, object::mode_display));
  return mode == OperationMode::homing && (word & model.status.homing_error) != 0;
}

std::vector<MotionObject> motion_objects(const Model& model) {
  std::vector<MotionObject> objects{{target, object::target_position},
                                    {speed, object::profile_velocity},
                                    {acceleration, object::acceleration}};
  if (model.descriptor->capabilities.own_deceleration)
    objects.push_back({deceleration, object::deceleration});
  if (model.objects.start_speed) objects.push_back({start_speed, *model.objects.start_speed});
  return objects;
}

std::int32_t encode_velocity(const Model& model, std::int64_t pulses_per_revolution, int rpm) {
  return counts_of(model.meaning.units.velocity, pulses_per_revolution, rpm);
}

MotionBlock encode(const Model& model, std::int64_t pulses_per_revolution, const MoveProfile& profile) {
  return {profile.target_pulses, encode_velocity(model, pulses_per_revolution, profile.velocity_rpm),
          starting_ramp(model, pulses_per_revolution, profile.velocity_rpm, profile.acceleration_time),
          braking_ramp(model, pulses_per_revolution, profile.velocity_rpm, profile.deceleration_time),
          model.objects.start_speed ? profile.start_rpm : 0};
}

MotionBlock encode(const Model& model, std::int64_t pulses_per_revolution, const VelocityProfile& profile,
                   const MotionBlock& present) {
  return {present[target], present[speed],
          starting_ramp(model, pulses_per_revolution, profile.velocity_rpm, profile.acceleration_time),
          braking_ramp(model, pulses_per_revolution, profile.velocity_rpm, profile.deceleration_time),
          model.objects.start_speed ? profile.start_rpm : 0};
}

std::vector<std::pair<canopen::Object, std::int64_t>> encode(const Model& model,
                                                             std::int64_t pulses_per_revolution,
                                                             const HomingProfile& profile) {
  std::vector<std::pair<canopen::Object, std::int64_t>> values{
      {object::homing_speed, encode_velocity(model, pulses_per_revolution, profile.velocity_rpm)},
      {object::homing_search_speed,
       encode_velocity(model, pulses_per_revolution, profile.search_velocity_rpm)},
      {object::homing_acceleration,
       ramp(model, pulses_per_revolution, profile.velocity_rpm, profile.acceleration_time, RampUse::brake)},
      {object::home_offset, profile.offset_pulses}};
  std::erase_if(values, [&](const auto& value) { return !has(model, value.first); });
  return values;
}

MotionBlock default_block(const Model& model) {
  MotionBlock block{};
  for (const auto& [field, object] : motion_objects(model)) {
    const auto* known = find_parameter(model.descriptor->parameters, object.key());
    block.at(field) = known == nullptr ? 0 : static_cast<std::int32_t>(known->default_value.value_or(0));
  }
  return block;
}

}  // namespace axisd::cia402
