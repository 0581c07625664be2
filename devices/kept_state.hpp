// The files that keep a machine's state vouch for each other. What a start found of them that cannot be.
#pragma once

#include <cstdint>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "buses/clock.hpp"
#include "buses/error.hpp"

namespace axisd {

enum class KeptFile : std::uint8_t {
  state,     ///< state.v1
  previous,  ///< state.v1.previous: the generation before
  journal,   ///< journal.v1
};

enum class KeptFault : std::uint8_t {
  missing,      ///< the others say that it was there
  rolled_back,  ///< the others know a newer one
  damaged,      ///< its content is not what was written
  not_regular,  ///< in its place there is a FIFO, a link, a device or a directory
  swapped,      ///< it holds what belongs into another file
  foreign,      ///< it does not belong to the others
};

/// A file that the others convict. Motion waits until a person has accepted that.
struct Conviction {
  KeptFile file = KeptFile::state;
  KeptFault fault = KeptFault::missing;
  std::uint64_t found = 0;     ///< the generation that it has; 0: none
  std::uint64_t expected = 0;  ///< that the others know of, at least; 0: they do not say
  std::string detail{};        ///< more, for people; may be empty
  WallTime since{};            ///< when a start first found it
  bool operator==(const Conviction&) const = default;
};

/// What a start found of one file.
struct KeptFileSeen {
  std::uint64_t found = 0;     ///< its generation; 0: none
  std::uint64_t expected = 0;  ///< that the others know of, at least; 0: they do not say
};

struct KeptStateSeen {
  KeptFileSeen state{}, journal{};
};

/// "state.v1".
std::string_view name_of(KeptFile file);
/// "state.v1 was rolled back: it has generation 12, but there was generation 40".
std::string to_string(const Conviction& conviction);
/// All of them, in one line.
std::string to_string(std::span<const Conviction> convictions);
/// What motion is refused with. Precondition: there is one at least.
Error state_unaccepted(std::span<const Conviction> convictions);

}  // namespace axisd
