#include "daemon/metering.hpp"

#include <fmt/format.h>
#include <spdlog/spdlog.h>

#include <chrono>
#include <functional>
#include <utility>
#include <vector>

#include "api/tls/expiry.hpp"

namespace axisd {
namespace {

/// Of what is served now; what has no end is left out.
std::function<std::vector<metrics::FileExpiry>()> expiry_of(std::shared_ptr<const tls::Live> live) {
  if (!live) return {};
  return [live = std::move(live)] {
    const auto now = std::chrono::system_clock::now();
    std::vector<metrics::FileExpiry> all;
    for (const auto& file : tls::expiries(live->paths(), live->served()->contents, now))
      if (file.at != WallTime::max()) all.push_back({.key = file.key, .at = file.at});
    return all;
  };
}

}  // namespace

Metering::Metering(const Parts& parts)
    : settings_(parts.settings.metrics),
      meter_(parts.loop.clock(), parts.machine, [&loop = parts.loop] { return loop.take_longest_handler(); }),
      metrics_({.machine = &parts.service,
                .reading = [this] { return meter_.latest(); },
                .journal_syncs = [&journal = parts.journal] { return journal.sync_times(); },
                .budgets = parts.budgets,
                .files_expire = expiry_of(parts.tls)}) {}

void Metering::start() {
  if (!settings_.listen.empty()) meter_.start();
}

Result<void> Metering::listen() {
  if (settings_.listen.empty()) return {};
  auto server = metrics::HttpServer::open(
      settings_.listen, settings_.remote, [this](metrics::Format format) { return metrics_.scrape(format); },
      metrics::HttpServer::Limits());
  if (!server) return fail(std::move(server).error());
  server_ = *std::move(server);
  const auto host = settings_.listen.substr(0, settings_.listen.rfind(':'));
  spdlog::info("metrics at http://{}:{}/metrics", host, server_->port());
  return {};
}

}  // namespace axisd
