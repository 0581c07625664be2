#pragma once

#include <cstdint>

#include "devices/axis/command_journal.hpp"

namespace axisd {

/// What became of a start that an earlier run of the daemon may have sent.
enum class Settlement : std::uint8_t {
  done,          ///< the drive went where it was sent
  not_executed,  ///< it never moved for it
  in_part,       ///< it moved, and was interrupted
  unknown,       ///< its counter does not tell
};

/// Tells it by where the drive rests now. `continuous`: it was proven that the drive kept its memory since.
/// Where that is not known only a counter that no power-up leaves says anything. `window`: pulses within
/// which a measured counter shows no motion, 0 for a counted one. Pure.
Settlement settle(CommandKind kind, const SendingNote& note, std::int32_t counter, bool continuous,
                  std::int64_t window = 0);

}  // namespace axisd
