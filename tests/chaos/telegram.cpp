#include "tests/chaos/telegram.hpp"

namespace axisd::chaos {

namespace {

// RS-485: 6.1 of the manuals.
constexpr std::uint16_t trigger_register = 0x0027, stop_register = 0x0028, enable_register = 0x0029,
                        homing_register = 0x0030;
constexpr std::uint16_t position_high = 0x000A, position_low = 0x000B, pulses_high = 0x0024,
                        pulses_low = 0x0025;
constexpr std::uint8_t write_one = 0x06;

// CiA 301 and CiA 402.
constexpr std::uint32_t sync_id = 0x080, sdo_request = 0x600, first_rpdo = 0x200, rpdo_step = 0x100;
constexpr std::uint16_t control_word = 0x6040, target_velocity = 0x60FF;
constexpr std::uint32_t control_key = 0x604000, status_key = 0x604100, mode_key = 0x606100,
                        method_key = 0x609800, position_key = 0x606400, target_key = 0x607A00;
constexpr std::uint8_t position_mode = 1, velocity_mode = 3, homing_mode = 6;
/// The present position is home: no motion.
constexpr std::uint32_t home_here = 35;
constexpr std::uint32_t last_synchronous_type = 240;
constexpr unsigned rpdos = 4;

std::int64_t signed_32(std::uint32_t bits) { return static_cast<std::int32_t>(bits); }

/// 7.6.1: bit 0 starts a positioning motion, bit 2 to an absolute target.
std::optional<std::int64_t> way_of(std::uint16_t command, const simulation::SimulatedNode& drive) {
  if ((command & 3U) != 1) return std::nullopt;
  const auto pair = [&](std::uint16_t high, std::uint16_t low) {
    return signed_32(drive.peek(high) << 16U | drive.peek(low));
  };
  const auto value = pair(pulses_high, pulses_low);
  return (command & 4U) != 0 ? value - pair(position_high, position_low) : value;
}

/// Bit 6: relative.
std::int64_t way_of_set_point(std::uint32_t word, const simulation::SimulatedNode& drive) {
  const auto value = signed_32(drive.peek(target_key));
  return (word & 0x40U) != 0 ? value : value - signed_32(drive.peek(position_key));
}

bool operates(const simulation::SimulatedNode& drive) { return (drive.peek(status_key) & 0x6FU) == 0x27; }
/// Ready to Switch On, Switched On, Quick Stop Active: the bits of Enable Operation lead on from there.
bool may_be_energised(const simulation::SimulatedNode& drive) {
  const auto state = drive.peek(status_key) & 0x6FU;
  return state == 0x21 || state == 0x23 || state == 0x07;
}

Telegram read_control(std::uint32_t word, const simulation::SimulatedNode& drive) {
  Telegram telegram;
  const bool enables = (word & 0x0FU) == 0x0F;
  const bool halts = (word & 0x100U) != 0;
  telegram.stop = halts || (!enables && operates(drive));
  telegram.energise = enables && may_be_energised(drive);
  const bool rises = (word & 0x10U) != 0 && (drive.peek(control_key) & 0x10U) == 0;
  if (!rises || !enables || halts) return telegram;
  const auto mode = drive.peek(mode_key) & 0xFFU;
  if (mode == position_mode) {
    telegram.start = Telegram::Start::motion;
    telegram.way = way_of_set_point(word, drive);
  }
  if (mode == homing_mode && drive.peek(method_key) != home_here) telegram.start = Telegram::Start::homing;
  return telegram;
}

Telegram read_download(const can::Frame& frame, const simulation::SimulatedNode& drive) {
  const auto command = frame.data[0];
  if ((command & 0xE0U) != 0x20 || (command & 0x02U) == 0) return {};
  const auto index = static_cast<std::uint16_t>(frame.data[1] | frame.data[2] << 8U);
  const auto value =
      static_cast<std::uint32_t>(frame.data[4]) | static_cast<std::uint32_t>(frame.data[5]) << 8U |
      static_cast<std::uint32_t>(frame.data[6]) << 16U | static_cast<std::uint32_t>(frame.data[7]) << 24U;
  if (index == control_word) return read_control(value & 0xFFFFU, drive);
  Telegram telegram;
  if (index == target_velocity && value != 0 && (drive.peek(mode_key) & 0xFFU) == velocity_mode)
    telegram.start = Telegram::Start::motion;
  return telegram;
}

/// Which RPDO of the drive a frame is; nothing: none that it has.
std::optional<unsigned> rpdo_of(const can::Frame& frame, const simulation::SimulatedNode& drive) {
  for (unsigned i = 0; i < rpdos; ++i)
    if (frame.id == first_rpdo + i * rpdo_step + drive.address()) return i;
  return std::nullopt;
}

}  // namespace

Telegram read_request(std::span<const std::uint8_t> request, const simulation::SimulatedNode& drive) {
  if (request.size() < 6 || request[1] != write_one) return {};
  const auto address = static_cast<std::uint16_t>(request[2] << 8U | request[3]);
  const auto value = static_cast<std::uint16_t>(request[4] << 8U | request[5]);
  Telegram telegram;
  if (address == trigger_register) {
    telegram.start = Telegram::Start::motion;
    telegram.way = way_of(value, drive);
  }
  if (address == homing_register) telegram.start = Telegram::Start::homing;
  telegram.stop = address == stop_register;
  telegram.energise = address == enable_register && value == 1;
  return telegram;
}

Telegram read_frame(const can::Frame& frame, const simulation::SimulatedNode& drive) {
  // What waits for it is a word without bit 6.
  if (frame.id == sync_id) return {.way = way_of_set_point(0, drive), .sync = true};
  if (frame.id == sdo_request + drive.address() && frame.size == 8) return read_download(frame, drive);
  const auto rpdo = rpdo_of(frame, drive);
  if (!rpdo || frame.size < 2) return {};
  const auto word = static_cast<std::uint32_t>(frame.data[0] | frame.data[1] << 8U);
  const auto type = drive.peek((0x1400U + *rpdo) << 8U | 2U) & 0xFFU;
  if (type > last_synchronous_type) return read_control(word, drive);
  const bool starts = (word & 0x1FU) == 0x1F && (word & 0x100U) == 0;
  return {.waiting = starts ? Telegram::Waiting::start : Telegram::Waiting::nothing};
}

}  // namespace axisd::chaos
