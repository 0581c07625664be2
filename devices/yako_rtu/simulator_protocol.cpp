// Frames of the simulated drive, manual 6.2.
#include "devices/simulation/crc.hpp"
#include "devices/yako_rtu/simulator.hpp"

namespace axisd::yako_rtu {

namespace {

std::uint16_t word(std::span<const std::uint8_t> frame, std::size_t at) {
  return static_cast<std::uint16_t>(frame[at] << 8 | frame[at + 1]);
}

void append_word(std::vector<std::uint8_t>& frame, std::uint16_t value) {
  frame.push_back(static_cast<std::uint8_t>(value >> 8U));
  frame.push_back(static_cast<std::uint8_t>(value & 0xFFU));
}

constexpr std::uint8_t read_registers = 0x03, write_register = 0x06, write_registers = 0x10;

/// Does the number of bytes fit the function? What does not is line noise, not a request.
bool has_right_size(std::span<const std::uint8_t> frame) {
  if (frame[1] == read_registers || frame[1] == write_register) return frame.size() == 8;
  if (frame[1] != write_registers) return true;
  return frame.size() >= 11 && frame.size() == 9U + frame[6] && frame[6] == 2 * word(frame, 4);
}

}  // namespace

std::optional<std::vector<std::uint8_t>> SimulatedDrive::on_frame(std::span<const std::uint8_t> frame) {
  if (!ready() || frame.size() < 4 || frame[0] != address() || address() == 0) return std::nullopt;
  const auto function = frame[1];
  std::vector<std::uint8_t> reply{address(), function};
  auto fail = Fail::none;
  if (!simulation::frame_is_sound(frame)) {
    if (!behaviour_.crc_error_answered) return std::nullopt;
    fail = Fail::crc;
  } else if (!has_right_size(frame)) {
    return std::nullopt;
  } else if (function == read_registers) {
    fail = read(frame, reply);
  } else if (function == write_register) {
    fail = write_one(frame, reply);
  } else if (function == write_registers) {
    fail = write_many(frame, reply);
  } else {
    fail = behaviour_.function_error_code_1 ? Fail::crc : Fail::function;
  }
  if (fail != Fail::none)
    reply = {address(), static_cast<std::uint8_t>(function | 0x80U), static_cast<std::uint8_t>(fail)};
  simulation::append_frame_crc(reply);
  return reply;
}

Fail SimulatedDrive::read(std::span<const std::uint8_t> frame, std::vector<std::uint8_t>& reply) {
  const auto first = word(frame, 2), count = word(frame, 4);
  const auto fail = memory_.check_read(first, count);
  if (fail != Fail::none) return fail;
  reply.push_back(static_cast<std::uint8_t>(2 * count));
  for (std::uint16_t i = 0; i < count; ++i) {
    const auto address = static_cast<std::uint16_t>(first + i);
    append_word(reply, address == reg::position_high ? position_words_.read_high(position(), now_)
                                                     : static_cast<std::uint16_t>(peek(address)));
  }
  return Fail::none;
}

Fail SimulatedDrive::write_one(std::span<const std::uint8_t> frame, std::vector<std::uint8_t>& reply) {
  const auto address = word(frame, 2), value = word(frame, 4);
  auto fail = memory_.check_write(address, value);
  if (fail == Fail::none) fail = execute(address, value);
  append_word(reply, address);
  append_word(reply, value);
  return fail;
}

Fail SimulatedDrive::write_many(std::span<const std::uint8_t> frame, std::vector<std::uint8_t>& reply) {
  const auto first = word(frame, 2), count = word(frame, 4);
  if (behaviour_.limit_block_writes && count > 16) return Fail::count;
  const auto value = [&](unsigned i) { return word(frame, 7 + std::size_t{2} * i); };
  const auto is_start_among_others = [&](unsigned i) { return count > 1 && first + i == reg::start; };
  const auto check = [&](unsigned i) {
    const bool refused = is_start_among_others(i) && behaviour_.one_frame_start_refused;
    return refused ? Fail::access : memory_.check_write(first + i, value(i));
  };
  auto fail = Fail::none;
  for (unsigned i = 0; i < count && fail == Fail::none; ++i) fail = check(i);
  if (fail != Fail::none && !behaviour_.partial_block_write && !behaviour_.bad_register_skipped) return fail;
  for (unsigned i = 0; i < count; ++i) {
    const bool bad = check(i) != Fail::none;
    if (bad && !behaviour_.bad_register_skipped) break;
    if (bad || (is_start_among_others(i) && !behaviour_.one_frame_start)) continue;
    const auto refused = execute(static_cast<std::uint16_t>(first + i), value(i));
    if (refused != Fail::none) return refused;
  }
  append_word(reply, first);
  append_word(reply, count);
  return fail;
}

Fail SimulatedDrive::execute(std::uint16_t address, std::uint16_t value) {
  switch (address) {
    case reg::start:
      return start(value);
    case reg::stop:
      stop_command((value & 1U) != 0);
      return Fail::none;
    case reg::enable:
      enabled_ = value == 1;
      if (!enabled_) cut();
      return Fail::none;
    case reg::alarm_clear:
      if (value == 1) clear_alarm();
      return Fail::none;
    case reg::parameter_setting:
      if (value == 1) memory_.restore_factory();
      if (value == 2) memory_.save_all();
      configuration_changed();
      return Fail::none;
    case reg::position_clear:
      if (value != 1 || (motor().moving() && !behaviour_.position_clear_in_motion)) return Fail::none;
      if (behaviour_.position_clear_late)
        shaft_.clear_at(now_ + std::chrono::milliseconds(20));
      else
        position_words_.clear();
      return Fail::none;
    case reg::homing_start:
      return value == 1 ? start_homing() : Fail::none;
    default:
      break;
  }
  memory_.write(address, value);
  if (address == reg::loop_mode && !behaviour_.loop_mode_from_power_up) open_loop_ = value == 1;
  if (address >= reg::input_levels && address < reg::output_levels) configuration_changed();
  return Fail::none;
}

}  // namespace axisd::yako_rtu
