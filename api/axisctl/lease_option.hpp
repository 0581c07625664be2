// --lease, of whatever needs the lease of an axis that is leased.
#pragma once

#include <CLI/CLI.hpp>
#include <cstdint>

namespace axisd::axisctl {

/// Of `token` 0: none.
inline void add_lease(CLI::App& command, std::uint64_t& token) {
  command.add_option("--lease,--lease-token", token, "Token of the lease that is held (axisctl lease)")
      ->envname("AXISD_LEASE")
      ->type_name("TOKEN");
}

}  // namespace axisd::axisctl
