// State file and journal vouch for each other: what a start makes of what it finds. Pure functions.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "buses/error.hpp"
#include "daemon/store/found_file.hpp"
#include "daemon/store/journal_model.hpp"
#include "daemon/store/state_text.hpp"
#include "devices/kept_state.hpp"

namespace axisd::store {

/// Where nobody can tell what was lost, starts of the daemon are counted on from so many further. A daemon
/// that is restarted a hundred times a day has as many in two years, and 2^21 of them are exact in a double
/// (lease tokens).
inline constexpr std::uint64_t start_count_jump = std::uint64_t{1} << 16U;

/// What the journal says of a generation of the state file.
StateLine line_of(const Generation& generation);

struct FoundFiles {
  FoundFile state{}, previous{}, journal{};
  FoundFile mark{};  ///< convicts the journal, and is convicted by nobody: it may be older, or gone
};

/// What the daemon goes on with.
struct Verdict {
  Generation state{};                    ///< with all convictions, those of earlier starts first
  std::optional<JournalLoad> journal{};  ///< nothing: there is none that can be used
  std::vector<Conviction> fresh{};       ///< those of this start
  KeptStateSeen seen{};
  std::string doubt{};            ///< why the journal does not know all that it should; empty: it does
  std::vector<KeptFile> aside{};  ///< not of the journal: these must not become the previous generation
};

/// `new_pair`: a name that no pair of files ever had. Errors: storage: there is nothing that tells how often
/// the daemon was started, or a file is of a newer format; says what to do.
Result<Verdict> judge(FoundFiles found, const std::string& new_pair, WallTime now);

}  // namespace axisd::store
