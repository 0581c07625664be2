#include "daemon/metering.hpp"

#include <fmt/format.h>
#include <spdlog/spdlog.h>

#include <optional>
#include <utility>

#include "api/tls/expiry.hpp"

namespace axisd {
namespace {

/// Of the certificate that is served; nothing: there is none, or who serves it tells what is wrong with it.
std::optional<WallTime> certificate_expiry(const config::ServerSettings& settings) {
  if (settings.metrics.listen.empty() || !settings.tls) return std::nullopt;
  const auto expires = tls::first_expiry(settings.tls->certificate);
  return expires ? std::optional(*expires) : std::nullopt;
}

}  // namespace

Metering::Metering(const Parts& parts)
    : settings_(parts.settings.metrics),
      meter_(parts.loop.clock(), parts.machine, [&loop = parts.loop] { return loop.take_longest_handler(); }),
      metrics_({.machine = &parts.service,
                .reading = [this] { return meter_.latest(); },
                .journal_syncs = [&journal = parts.journal] { return journal.sync_times(); },
                .budgets = parts.budgets,
                .certificate_expires = certificate_expiry(parts.settings)}) {}

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
