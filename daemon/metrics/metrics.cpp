#include "daemon/metrics/metrics.hpp"

#include <utility>

#include "daemon/metrics/axis_families.hpp"
#include "daemon/metrics/machine_families.hpp"

namespace axisd::metrics {

std::shared_ptr<const std::string> Metrics::scrape(Format format) {
  ++scrapes_;
  auto& kept = texts_.at(std::to_underlying(format));
  const auto now = sources_.machine->now();
  if (!kept.text || now - kept.made >= renewed_after) {
    kept.text = std::make_shared<const std::string>(render(format));
    kept.made = now;
    last_took_ = sources_.machine->now() - now;
  }
  return kept.text;
}

std::string Metrics::render(Format format) const {
  auto& machine = *sources_.machine;
  const auto reading = sources_.reading();
  std::vector<AxisSnapshotPtr> axes;
  for (const auto& name : machine.axis_names())
    if (auto snapshot = machine.snapshot(name)) axes.push_back(std::move(snapshot));
  Exposition to(format);
  write_machine(to, machine.info());
  write_axes(to, axes, reading->tallies, machine.now());
  write_devices(to, machine.bus_access().devices());
  write_buses(to, reading->buses);
  write_stops(to, reading->buses, sources_.budgets);
  write_tallies(to, reading->tallies);
  write_daemon(to, *reading, sources_.journal_syncs(),
               sources_.files_expire ? sources_.files_expire() : std::vector<FileExpiry>{});
  write_process(to);
  to.family("axisd_metrics_scrapes_total", MetricType::counter, "Scrapes that were answered.");
  to.sample({}, scrapes_);
  to.family("axisd_metrics_render_seconds", MetricType::gauge,
            "How long the text before this one took to make.");
  to.sample({}, in_seconds(last_took_));
  return to.take();
}

}  // namespace axisd::metrics
