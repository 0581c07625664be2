// Ids of commands that have ended, as bytes: pure functions, no files.
#pragma once

#include <string>
#include <string_view>
#include <vector>

#include "devices/axis/command_journal.hpp"

namespace axisd::store {

/// One block: each has its length and checksum. Little-endian, as all machines that this runs on.
std::string encode_ids(const std::vector<ClientRun>& runs);

struct IdBlocks {
  std::vector<ClientRun> runs;
  std::size_t good = 0;  ///< bytes that are intact: all, unless the rest is damaged
};
IdBlocks decode_ids(std::string_view bytes);

}  // namespace axisd::store
