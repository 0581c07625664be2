#include "daemon/metrics/machine_families.hpp"

#include <sys/resource.h>
#include <unistd.h>

#include <array>
#include <chrono>
#include <fstream>
#include <string_view>
#include <utility>

namespace axisd::metrics {
namespace {

using Buses = std::vector<core::BusReading>;

Labels label_of(const core::BusReading& bus) { return Labels().with("bus", bus.status.name); }

/// What became of transactions, by the names of `outcome`.
void write_outcomes(Exposition& to, const Labels& labels, const ClassStatistics& of_class) {
  const auto& [answered, refused, no_reply, damaged, failed] = of_class.ends;
  const auto& [expired, superseded, lease_lost, port_lost, unsupported] = of_class.drops;
  const std::pair<std::string_view, std::uint64_t> outcomes[] = {
      {"answered", answered},      {"refused", refused},       {"no_reply", no_reply},
      {"damaged", damaged},        {"failed", failed},         {"expired", expired},
      {"superseded", superseded},  {"lease_lost", lease_lost}, {"port_lost", port_lost},
      {"unsupported", unsupported}};
  for (const auto& [outcome, count] : outcomes) to.sample(labels.with("outcome", outcome), count);
}

/// Calls `write` for each class of each bus.
template <class Write>
void for_each_class(const Buses& buses, Write write) {
  for (const auto& bus : buses)
    for (std::size_t i = 0; i < bus.classes.size(); ++i)
      write(label_of(bus).with("class", to_string(static_cast<TransactionClass>(i))), bus.classes.at(i));
}

void write_transactions(Exposition& to, const Buses& buses) {
  to.family("axisd_bus_transactions_total", MetricType::counter,
            "Transactions that have ended, by what became of them; from expired on not a byte was sent.");
  for_each_class(buses, [&](const Labels& labels, const ClassStatistics& of_class) {
    write_outcomes(to, labels, of_class);
  });
  to.family("axisd_bus_waiting_transactions", MetricType::gauge, "Transactions that wait for the bus.");
  for_each_class(buses, [&](const Labels& labels, const ClassStatistics& of_class) {
    to.sample(labels, of_class.waiting);
  });
  to.family("axisd_bus_queueing_seconds", MetricType::histogram,
            "From being asked for to the first byte, of transactions that went out.");
  for_each_class(buses, [&](const Labels& labels, const ClassStatistics& of_class) {
    to.histogram(labels, of_class.queueing);
  });
  to.family("axisd_bus_exchange_seconds", MetricType::histogram,
            "From the first byte to the end of the reply, or of the wait for it.");
  for_each_class(buses, [&](const Labels& labels, const ClassStatistics& of_class) {
    to.histogram(labels, of_class.exchange);
  });
}

/// One value of each bus.
template <class Value>
void write_each(Exposition& to, const Buses& buses, std::string_view name, MetricType type,
                std::string_view help, Value value) {
  to.family(name, type, help);
  for (const auto& bus : buses) to.sample(label_of(bus), value(bus));
}

/// One value of each CAN network.
template <class Value>
void write_networks(Exposition& to, const Buses& buses, std::string_view name, MetricType type,
                    std::string_view help, Value value) {
  to.family(name, type, help);
  for (const auto& bus : buses)
    if (bus.status.network) to.sample(label_of(bus), value(*bus.status.network));
}

void write_can(Exposition& to, const Buses& buses) {
  constexpr auto counter = MetricType::counter;
  write_networks(to, buses, "axisd_can_frames_received_total", counter, "Frames of other nodes.",
                 [](const NetworkStatus& network) { return network.frames.received; });
  write_networks(to, buses, "axisd_can_frames_sent_total", counter, "Frames that went out.",
                 [](const NetworkStatus& network) { return network.frames.sent; });
  write_networks(to, buses, "axisd_can_error_frames_total", counter, "Error frames of the controller.",
                 [](const NetworkStatus& network) { return network.frames.error_frames; });
  write_networks(to, buses, "axisd_can_bus_offs_total", counter, "Times that the controller went bus-off.",
                 [](const NetworkStatus& network) { return network.frames.bus_offs; });
  write_networks(to, buses, "axisd_can_stalls_total", counter, "Times that no frame was confirmed any more.",
                 [](const NetworkStatus& network) { return network.frames.stalls; });
  write_networks(to, buses, "axisd_can_sync_missed_total", counter,
                 "SYNCs that were not sent within their period.",
                 [](const NetworkStatus& network) { return network.sync.missed; });
  write_networks(to, buses, "axisd_can_emergencies_total", counter, "Emergency messages of nodes.",
                 [](const NetworkStatus& network) { return network.emergencies; });
}

/// Calls `write` for the stops of some axes, and for those of all, of each bus.
template <class Write>
void for_each_scope(const Buses& buses, Write write) {
  for (const auto& bus : buses) {
    write(label_of(bus).with("scope", "some"), bus.stops.some);
    write(label_of(bus).with("scope", "all"), bus.stops.all);
  }
}

/// The bounds of a bus: for one axis, and for all.
template <class Value>
void write_bounds(Exposition& to, const std::vector<BusBudgetReport>& budgets, std::string_view name,
                  std::string_view help, Value value) {
  to.family(name, MetricType::gauge, help);
  for (const auto& report : budgets) {
    const auto& stops = report.predicted.stops;
    if (stops.empty()) continue;
    const auto labels = Labels().with("bus", report.predicted.bus);
    to.sample(labels.with("scope", "one"), in_seconds(value(stops.front())));
    to.sample(labels.with("scope", "all"), in_seconds(value(stops.back())));
  }
}

/// The processor time that this process has used, and the memory that it has.
std::pair<double, std::int64_t> usage() {
  rusage used{};
  getrusage(RUSAGE_SELF, &used);
  const auto seconds = [](const timeval& time) {
    return static_cast<double>(time.tv_sec) + static_cast<double>(time.tv_usec) / 1e6;
  };
  std::int64_t size = 0, resident = 0;
  std::ifstream("/proc/self/statm") >> size >> resident;
  return {seconds(used.ru_utime) + seconds(used.ru_stime), resident * sysconf(_SC_PAGESIZE)};
}

}  // namespace

void write_buses(Exposition& to, const Buses& buses) {
  to.family("axisd_bus_info", MetricType::info, "What is spoken on a bus, and where it is.");
  for (const auto& bus : buses)
    to.sample(label_of(bus)
                  .with("kind", bus.status.kind == BusKind::canopen ? "canopen" : "modbus_rtu")
                  .with("port", bus.status.port),
              1);
  write_each(to, buses, "axisd_bus_open", MetricType::gauge, "The port is open, or the network can be used.",
             [](const core::BusReading& bus) { return bus.status.open ? 1 : 0; });
  write_each(to, buses, "axisd_bus_load_ratio", MetricType::gauge,
             "Share of the last 10 s that a bus was occupied.",
             [](const core::BusReading& bus) { return bus.load; });
  write_each(to, buses, "axisd_bus_quarantined_nodes", MetricType::gauge,
             "Nodes of a line that are asked now and then only, because they do not answer.",
             [](const core::BusReading& bus) { return bus.quarantined; });
  write_each(to, buses, "axisd_bus_foreign_frames_total", MetricType::counter,
             "Frames on a line that nobody waited for.",
             [](const core::BusReading& bus) { return bus.status.counters.foreign_frames; });
  write_transactions(to, buses);
  write_can(to, buses);
}

void write_stops(Exposition& to, const Buses& buses, const std::vector<BusBudgetReport>& budgets) {
  using Scope = StopDelays::Scope;
  to.family("axisd_stop_frame_seconds", MetricType::histogram,
            "From a stop's arrival at the server to the end of the axis's first stop frame.");
  for_each_scope(buses, [&](const Labels& labels, const Scope& stops) { to.histogram(labels, stops.frame); });
  to.family("axisd_stop_frame_longest_seconds", MetricType::gauge, "The longest of these since the start.");
  for_each_scope(buses, [&](const Labels& labels, const Scope& stops) {
    to.sample(labels, in_seconds(stops.frame.longest()));
  });
  write_bounds(to, budgets, "axisd_stop_frame_bound_seconds",
               "The published bound of it: for one axis alone, and for all of a bus at once.",
               [](const StopBudget& stop) { return stop.last_frame; });
  to.family("axisd_stop_standstill_seconds", MetricType::histogram,
            "From a stop's arrival at the server to the confirmed standstill, the motor's way included.");
  for_each_scope(buses,
                 [&](const Labels& labels, const Scope& stops) { to.histogram(labels, stops.standstill); });
  write_bounds(to, budgets, "axisd_stop_standstill_bound_seconds",
               "The published bound of it, beyond the deceleration time.",
               [](const StopBudget& stop) { return stop.standstill; });
}

void write_tallies(Exposition& to, const core::Tallies& tallies) {
  to.family("axisd_commands_total", MetricType::counter,
            "Commands that were accepted, and how they have ended.");
  for (std::size_t k = 0; k < core::Tallies::command_kinds; ++k) {
    const auto kind = static_cast<CommandKind>(k);
    const auto labels = Labels().with("kind", to_string(kind));
    for (const auto state : {CommandState::accepted, CommandState::done, CommandState::aborted,
                             CommandState::error, CommandState::unknown})
      to.sample(labels.with("state", to_string(state)), tallies.commands(kind, state));
  }
  to.family("axisd_lease_changes_total", MetricType::counter,
            "Times that the holder of an axis's lease changed.");
  using What = LeaseChange::What;
  constexpr std::array<std::pair<What, std::string_view>, core::Tallies::lease_changes> changes = {
      {{What::acquired, "acquired"},
       {What::released, "released"},
       {What::expired, "expired"},
       {What::taken, "taken"}}};
  for (const auto& [what, name] : changes) to.sample(Labels().with("change", name), tallies.leases(what));
  to.family("axisd_stop_alls_total", MetricType::counter, "Calls of StopAll.");
  to.sample({}, tallies.stop_alls());
  to.family("axisd_flight_records_total", MetricType::counter,
            "Flight records that were written after faults.");
  to.sample({}, tallies.flight_records());
  to.family("axisd_configuration_reloads_total", MetricType::counter, "Reloads that were carried out.");
  to.sample({}, tallies.reloads());
}

void write_machine(Exposition& to, const MachineInfo& info) {
  to.family("axisd_build_info", MetricType::info, "Version of axisd.");
  to.sample(Labels().with("version", info.version), 1);
  to.family("axisd_machine_info", MetricType::info, "Name of the machine.");
  to.sample(Labels().with("machine", info.machine), 1);
  to.family("axisd_inhibited", MetricType::gauge,
            "A StopAll is latched: nothing moves until it is released.");
  to.sample({}, info.inhibited ? 1 : 0);
  to.family("axisd_state_unaccepted", MetricType::gauge,
            "The kept state is not certain: nothing moves until somebody accepts it.");
  to.sample({}, info.state_unaccepted.empty() ? 0 : 1);
}

void write_daemon(Exposition& to, const core::MachineReading& reading, const LatencyHistogram& journal_syncs,
                  const std::vector<FileExpiry>& files_expire) {
  to.family("axisd_core_longest_handler_seconds", MetricType::gauge,
            "The longest that the core was busy with one thing in the last minute.");
  to.sample({}, in_seconds(reading.longest_handler));
  to.family("axisd_journal_sync_seconds", MetricType::histogram,
            "How long the disk took to make the command journal durable.");
  to.histogram({}, journal_syncs);
  to.family("axisd_journal_failed", MetricType::gauge,
            "The command journal cannot be written: nothing new is started.");
  to.sample({}, reading.journal_fails ? 1 : 0);
  to.family("axisd_certificate_expiry_timestamp_seconds", MetricType::gauge,
            "When the first certificate or list in a file of server.tls ends, in Unix time.");
  for (const auto& file : files_expire)
    to.sample(Labels().with("file", file.key),
              std::chrono::duration_cast<std::chrono::seconds>(file.at.time_since_epoch()).count());
}

void write_process(Exposition& to) {
  const auto [processor, resident] = usage();
  to.family("process_cpu_seconds_total", MetricType::counter, "Processor time that the daemon has used.");
  to.sample({}, processor);
  to.family("process_resident_memory_bytes", MetricType::gauge, "Memory that the daemon has.");
  to.sample({}, resident);
}

}  // namespace axisd::metrics
