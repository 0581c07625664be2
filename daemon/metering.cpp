#include "daemon/metering.hpp"

#include <fmt/format.h>
#include <spdlog/spdlog.h>

#include <functional>
#include <optional>
#include <utility>

#include "api/tls/expiry.hpp"

namespace axisd {
namespace {

/// Of the certificate that is served now.
std::function<std::optional<WallTime>()> certificate_expiry(std::shared_ptr<const tls::Live> live) {
  if (!live) return {};
  return [live = std::move(live)] {
    return std::optional(tls::first_expiry(live->served()->contents.certificate));
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
                .certificate_expires = certificate_expiry(parts.tls)}) {}

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
