// The audit of a daemon, from its configuration.
#pragma once

#include <filesystem>
#include <memory>
#include <string>

#include "config/configuration.hpp"
#include "daemon/store/audit_log.hpp"
#include "daemon/store/kept_state.hpp"

namespace axisd {

[[nodiscard]] std::filesystem::path audit_directory(const config::Configuration& configuration);

/// What of the journal no record tells of is recovered first: whatever reached a wire is in the journal.
/// `revision`: of the configuration. Precondition: `state` locks the directory, and its journal was not
/// taken.
[[nodiscard]] std::unique_ptr<store::AuditLog> open_audit(const config::Configuration& configuration,
                                                          store::KeptState& state,
                                                          const std::string& instance_id,
                                                          std::string revision);

/// The daemon began, or ended.
void record_run(store::AuditLog& audit, store::KeptState& state, DaemonRun::What what);

}  // namespace axisd
