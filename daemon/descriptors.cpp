#include "daemon/descriptors.hpp"

#include <fmt/format.h>
#include <sys/resource.h>

namespace axisd {
namespace {

/// Of the process itself: gRPC, state, log; and as many again, which the accept loop leaves to ports that
/// come back.
constexpr rlim_t own = 192;
/// Ports, and what wakes their threads; of a simulated one both ends.
constexpr rlim_t per_bus = 8;

}  // namespace

void raise_descriptor_limit() {
  rlimit limit{};
  if (getrlimit(RLIMIT_NOFILE, &limit) != 0) return;
  limit.rlim_cur = limit.rlim_max;
  (void)setrlimit(RLIMIT_NOFILE, &limit);  // where that is forbidden it stays as it is
}

Result<void> check_descriptor_limit(const config::Configuration& configuration) {
  rlimit limit{};
  if (getrlimit(RLIMIT_NOFILE, &limit) != 0) return {};
  const auto buses = configuration.lines.size() + configuration.networks.size();
  const auto connections = static_cast<rlim_t>(configuration.server.limits.connections);
  const auto needed = own + per_bus * buses + 2 * connections;  // each is watched, too
  if (limit.rlim_cur >= needed) return {};
  return fail(Reason::invalid_argument,
              fmt::format("only {} file descriptors may be open at a time, and {} may be needed",
                          limit.rlim_cur, needed),
              fmt::format("raise LimitNOFILE of the service (ulimit -n), or lower server.limits.connections "
                          "from {}",
                          configuration.server.limits.connections));
}

}  // namespace axisd
