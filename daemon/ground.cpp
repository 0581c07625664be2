#include "daemon/ground.hpp"

#include <fmt/format.h>
#include <spdlog/spdlog.h>

#include <chrono>
#include <filesystem>
#include <optional>
#include <random>
#include <utility>

#include "config/budget.hpp"
#include "daemon/audit_opening.hpp"
#include "daemon/configuration_service.hpp"
#include "devices/axis/id_limits.hpp"

namespace axisd {

namespace {

/// Starts of the daemon are counted durably, so ids never repeat; the random part tells two state directories
/// apart, and two runs from copies of the same one.
std::string make_instance_id(std::uint64_t start_count) {
  return fmt::format("{:x}{:08x}", start_count, std::random_device{}());
}

/// What the buses promise, and what somebody should look at.
void tell(const config::Configuration& configuration, const std::vector<BusBudgetReport>& budgets) {
  for (const auto& budget : budgets) {
    spdlog::info("budget of {}", config::summary(budget));
    for (const auto& warning : config::warnings(budget)) spdlog::warn("{}", warning);
  }
  for (const auto& warning : config::other_warnings(configuration)) spdlog::warn("{}", warning);
}

/// `audit`: null as long as there is none yet; looked at while the core and the server run, by any thread.
Result<std::unique_ptr<store::KeptState>> open_state(const config::Configuration& configuration,
                                                     core::CoreLoop& loop,
                                                     const std::unique_ptr<store::AuditLog>& audit) {
  const IdLimits limits{.total = static_cast<std::size_t>(configuration.server.limits.request_ids)};
  return store::KeptState::open(
      configuration.state_directory, std::chrono::system_clock::now(), loop.executor(),
      {.bounds = {.most = limits.total + limits.reserve()},
       .other_trouble = [&audit]() { return audit ? audit->trouble() : std::nullopt; }});
}

}  // namespace

Result<void> prepare(Ground& ground, const Options& options, const config::Configuration& configuration,
                     const std::string& yaml, const Logging& logging) {
  auto state = open_state(configuration, ground.loop, ground.audit);
  if (!state) return fail(state.error());
  ground.state = *std::move(state);
  if (!options.wire_log.empty()) {
    auto opened = logging.open_wire_log(options.wire_log);
    if (!opened) return fail(opened.error());
    ground.wire_log = *std::move(opened);
  }
  ground.flight_files = std::make_unique<store::FlightFiles>(
      std::filesystem::path(configuration.state_directory) / "flight",
      static_cast<std::size_t>(configuration.flight_recorder.files), ground.loop.executor());
  auto ports = Ports::open(ground.loop, configuration, options.link_helper);
  if (!ports) return fail(ports.error());
  ground.ports = *std::move(ports);
  ground.budgets = config::budgets(configuration);
  tell(configuration, ground.budgets);
  ground.instance_id = make_instance_id(ground.state->state().loaded().start_count);
  ground.audit = open_audit(configuration, *ground.state, ground.instance_id, revision_of(yaml));
  record_run(*ground.audit, *ground.state, DaemonRun::What::began);
  return {};
}

}  // namespace axisd
