#include "devices/yako_rtu/codec.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <utility>

namespace axisd::yako_rtu {

namespace {

std::uint16_t milliseconds_of(Duration time) {
  return static_cast<std::uint16_t>(std::chrono::duration_cast<std::chrono::milliseconds>(time).count());
}

}  // namespace

DriveSample decode_state(std::span<const std::uint16_t> registers) {
  const auto at = [&](std::size_t address) { return registers[address - 0x0003]; };
  DriveSample sample;
  sample.mode = static_cast<DriveMode>(std::min<std::uint16_t>(at(0x0003), 3));
  const auto status = at(0x0007);
  // Moving is shown twice; either one is enough to be careful.
  sample.moving = at(0x0004) != 0 || (status & 0x0004) != 0;
  sample.negative_direction = at(0x0005) != 0;
  sample.alarm_code = at(0x0006);
  if (sample.alarm_code == 0 && (status & 0x0008) != 0)
    sample.alarm_code = 0xFFFF;  // alarm bit without a code
  sample.in_position = (status & 0x0001) != 0;
  sample.homed = (status & 0x0002) != 0;
  sample.enabled = (status & 0x0010) == 0;  // inverted: 0 enabled, 1 released
  sample.inputs = at(0x0008);
  sample.outputs = at(0x0009);
  sample.position_pulses = static_cast<std::int32_t>((std::uint32_t{at(0x000A)} << 16U) | at(0x000B));
  sample.velocity_rpm = static_cast<std::int16_t>(at(0x000C));
  return sample;
}

MotionBlock encode(const MoveProfile& profile) {
  const auto pulses = static_cast<std::uint32_t>(profile.target_pulses);
  return {static_cast<std::uint16_t>(profile.start_rpm), milliseconds_of(profile.acceleration_time),
          milliseconds_of(profile.deceleration_time),    static_cast<std::uint16_t>(profile.velocity_rpm),
          static_cast<std::uint16_t>(pulses >> 16U),     static_cast<std::uint16_t>(pulses & 0xFFFFU)};
}

MotionBlock encode(const VelocityProfile& profile) {
  return {static_cast<std::uint16_t>(profile.start_rpm),
          milliseconds_of(profile.acceleration_time),
          milliseconds_of(profile.deceleration_time),
          static_cast<std::uint16_t>(profile.velocity_rpm),
          0,
          0};
}

std::int64_t target_of(const MotionBlock& block) {
  return static_cast<std::int32_t>(std::uint32_t{block[4]} << 16U | block[5]);
}

HomingBlock encode(const HomingProfile& profile) {
  const auto offset = profile.offset_pulses;
  return {static_cast<std::uint16_t>(
              std::to_underlying(profile.method)),  // 0x0031 counts as the enumeration does
          static_cast<std::uint16_t>(profile.velocity_rpm),
          static_cast<std::uint16_t>(profile.search_velocity_rpm),
          milliseconds_of(profile.acceleration_time),
          static_cast<std::uint16_t>(offset > 0 ? offset : 0),
          static_cast<std::uint16_t>(offset < 0 ? -offset : 0)};
}

ContinuityMark mark_of(const MotionBlock& block) { return {block.begin(), block.end()}; }

std::vector<MotionBlock> blocks_of(const std::vector<ContinuityMark>& marks) {
  std::vector<MotionBlock> blocks;
  for (const auto& mark : marks)
    if (mark.size() == canary_count) std::ranges::copy(mark, blocks.emplace_back().begin());
  return blocks;
}

std::string version_text(std::span<const std::uint16_t> identity) {
  const auto version = identity[1];
  return fmt::format("V{}.{}", version >> 8U, (version >> 4U) & 0xFU);
}

const char* exception_text(std::uint32_t code) {
  static constexpr auto texts = std::to_array<const char*>(
      {"unknown exception", "CRC error", "function code not supported", "register address not allowed",
       "register address out of range", "more than 16 registers", "register cannot be accessed this way",
       "value out of range"});
  return texts.at(code < texts.size() ? code : 0);
}

const char* exception_remedy(std::uint32_t code) {
  static constexpr auto remedies = std::to_array<const char*>(
      {"see the drive's manual; check that the configured model is that of the drive",
       "repeat it; if that happens often, check termination, shielding and baud rate",
       "check that the configured model is that of the drive",
       "check that the configured model is that of the drive",
       "check that the configured model is that of the drive", "read fewer registers at once",
       "check the drive's state (alarm, power, motion), and repeat it; some registers are only read",
       "compare the value with the range in the drive's manual; firmware may differ from it"});
  return remedies.at(code < remedies.size() ? code : 0);
}

}  // namespace axisd::yako_rtu
