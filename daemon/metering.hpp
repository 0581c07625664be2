#pragma once

#include <memory>
#include <vector>

#include "api/exposition/http_server.hpp"
#include "api/tls/live.hpp"
#include "config/configuration.hpp"
#include "daemon/core/core_loop.hpp"
#include "daemon/core/machine_core.hpp"
#include "daemon/core/machine_service.hpp"
#include "daemon/core/meter.hpp"
#include "daemon/metrics/metrics.hpp"
#include "daemon/store/kept_state.hpp"

namespace axisd {

/// The metrics of a machine, if its configuration has them; else nothing is measured for them. Made before
/// the core runs, destroyed after it ended. Thread: first.
class Metering {
 public:
  struct Parts {
    core::CoreLoop& loop;
    const core::MachineCore& machine;
    core::MachineService& service;
    const store::JournalFile& journal;
    const config::ServerSettings& settings;
    const std::vector<BusBudgetReport>& budgets;
    std::shared_ptr<const tls::Live> tls;  ///< nullptr: there is no TLS
  };
  /// All of them outlive this.
  explicit Metering(const Parts& parts);

  /// Begins to measure. Before the core runs.
  void start();
  /// Errors: those of metrics::HttpServer::open().
  [[nodiscard]] Result<void> listen();

 private:
  const config::MetricsSettings settings_;
  core::Meter meter_;
  metrics::Metrics metrics_;
  std::unique_ptr<metrics::HttpServer> server_;
};

}  // namespace axisd
