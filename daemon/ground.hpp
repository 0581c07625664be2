#pragma once

#include <memory>
#include <string>
#include <vector>

#include "config/configuration.hpp"
#include "daemon/core/core_loop.hpp"
#include "daemon/logging.hpp"
#include "daemon/options.hpp"
#include "daemon/ports.hpp"
#include "daemon/store/audit_log.hpp"
#include "daemon/store/flight_files.hpp"
#include "daemon/store/kept_state.hpp"
#include "devices/budget.hpp"

namespace axisd {

/// What the machine stands on: what it remembers, its files and its ports. Thread: first.
struct Ground {
  core::CoreLoop loop;
  std::unique_ptr<store::KeptState> state;  ///< locks the directory
  core::FrameObserver wire_log;
  std::unique_ptr<store::FlightFiles> flight_files;
  std::unique_ptr<Ports> ports;
  std::vector<BusBudgetReport> budgets;
  std::string instance_id;
  std::unique_ptr<store::AuditLog> audit;
};

/// Opens all of it in the order of its members. `yaml`: what the configuration was read from. Errors: what is
/// in the way of serving it.
[[nodiscard]] Result<void> prepare(Ground& ground, const Options& options,
                                   const config::Configuration& configuration, const std::string& yaml,
                                   const Logging& logging);

}  // namespace axisd
