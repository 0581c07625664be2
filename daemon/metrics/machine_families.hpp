// The families of metrics, by what they are about. Each is written whether or not it has a sample.
#pragma once

#include <string_view>
#include <vector>

#include "api/exposition/exposition.hpp"
#include "daemon/core/meter.hpp"
#include "devices/budget.hpp"

namespace axisd::metrics {

/// When a file of `server.tls` is of no more use.
struct FileExpiry {
  std::string_view key;  ///< "certificate", "client_ca" or "crl": a literal
  WallTime at;
};

void write_buses(Exposition& to, const std::vector<core::BusReading>& buses);
/// Delays of stops, beside what is promised of them.
void write_stops(Exposition& to, const std::vector<core::BusReading>& buses,
                 const std::vector<BusBudgetReport>& budgets);
/// Commands, leases, and what else clients have caused.
void write_tallies(Exposition& to, const core::Tallies& tallies);
void write_machine(Exposition& to, const MachineInfo& info);
void write_daemon(Exposition& to, const core::MachineReading& reading, const LatencyHistogram& journal_syncs,
                  const std::vector<FileExpiry>& files_expire);
/// What Prometheus knows of any process.
void write_process(Exposition& to);

}  // namespace axisd::metrics
