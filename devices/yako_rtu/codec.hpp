// Register contents of the YKD2405PR as values, pure (manual 6.1).
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "devices/drive.hpp"

namespace axisd::yako_rtu {

/// Registers 0x0003..0x000C in one read.
inline constexpr std::uint16_t state_count = 10;
/// Registers 0x0020..0x0025: what a start uses.
using MotionBlock = std::array<std::uint16_t, 6>;
/// As many are read to recognise it.
inline constexpr std::uint16_t canary_count = std::tuple_size_v<MotionBlock>;
/// Registers 0x0031..0x0036.
using HomingBlock = std::array<std::uint16_t, 6>;

/// Contents of the motion block after a factory reset (6.1).
inline constexpr MotionBlock factory_block = {5, 100, 100, 60, 0, 5000};

DriveSample decode_state(std::span<const std::uint16_t> registers);
MotionBlock encode(const MoveProfile& profile);
/// In speed mode the sign of the speed is the direction (7.2); the pulses are not used and kept neutral.
MotionBlock encode(const VelocityProfile& profile);
HomingBlock encode(const HomingProfile& profile);
/// Counter value to which such a block sends the drive, or by how much.
std::int64_t target_of(const MotionBlock& block);
/// "V1.2", of what 0x0000 and 0x0001 hold (6.1).
std::string version_text(std::span<const std::uint16_t> identity);
/// As it is kept on the disk.
ContinuityMark mark_of(const MotionBlock& block);
/// Those that are as long as the block is; no other can be this drive's.
std::vector<MotionBlock> blocks_of(const std::vector<ContinuityMark>& marks);
/// The vendor's exception codes (6.2.4), which are not those of the Modbus standard.
const char* exception_text(std::uint32_t code);
/// What to do about it.
const char* exception_remedy(std::uint32_t code);

}  // namespace axisd::yako_rtu
