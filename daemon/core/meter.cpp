#include "daemon/core/meter.hpp"

#include <algorithm>
#include <boost/smart_ptr/make_shared.hpp>
#include <utility>

namespace axisd::core {

Meter::Meter(Clock& clock, const MachineCore& machine, std::function<Duration()> take_longest_handler)
    : clock_(&clock), machine_(&machine), take_longest_handler_(std::move(take_longest_handler)) {}

void Meter::start() {
  read();
  timer_ = clock_->call_at(clock_->now() + period, [this] { start(); });
}

void Meter::read() {
  handlers_.push_back(take_longest_handler_());
  if (handlers_.size() > handlers_kept) handlers_.pop_front();
  auto reading = boost::make_shared<MachineReading>();
  for (auto& status : machine_->bus_status()) reading->buses.push_back(read_bus(std::move(status)));
  reading->tallies = machine_->events().tallies();
  reading->longest_handler = std::ranges::max(handlers_);
  reading->journal_fails = machine_->storage_error().has_value();
  latest_.store(std::move(reading));
}

BusReading Meter::read_bus(BusStatus status) const {
  BusReading reading{.status = std::move(status)};
  const auto& name = reading.status.name;
  const auto now = clock_->now();
  if (const auto* line = machine_->find_line(name)) {
    reading.classes = line->classes();
    reading.load = line->load().recent(now);
    reading.quarantined = static_cast<std::size_t>(std::ranges::count_if(
        line->quarantine().nodes(), [](const auto& node) { return node.second.quarantined(); }));
  } else if (const auto* network = machine_->find_network(name)) {
    reading.classes = network->master().sdo().classes();
    reading.load = machine_->find_recorder(name)->network_load().recent(now);
  }
  reading.stops = machine_->stop_delays(name);
  return reading;
}

}  // namespace axisd::core
