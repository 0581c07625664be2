#include "api/axisctl/statistics_view.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <iterator>
#include <numeric>

#include "api/axisctl/format.hpp"

namespace axisd::axisctl {
namespace {

/// Upper bounds of the buckets, as the contract has them.
double bound(int bucket) { return 0.1e-3 * std::exp2(bucket / 4.0); }
constexpr int bounded_buckets = 69;

std::string percent(double share) { return fmt::format("{} %", number(std::round(share * 1000) / 10)); }

std::string time_text(double seconds) {
  if (seconds == 0) return "";
  return seconds < 1 ? fmt::format("{:.1f} ms", seconds * 1000) : duration_text(seconds);
}

std::string exceptions(const v1::LineNodeStatistics& node) {
  std::string text;
  for (const auto& exception : node.exceptions())
    text += fmt::format("{}{} x {:02}{}{}", text.empty() ? "" : ", ", exception.count(), exception.code(),
                        exception.name().empty() ? "" : " ", exception.name());
  return text;
}

std::string unknown_starts(const v1::UnknownOutcomes& outcomes) {
  const auto sum = outcomes.executed() + outcomes.not_executed() + outcomes.unresolved();
  if (sum == 0) return "";
  return fmt::format("{}: {} executed, {} not, {} unresolved", sum, outcomes.executed(),
                     outcomes.not_executed(), outcomes.unresolved());
}

std::string quarantine(const v1::Quarantine& quarantine) {
  if (!quarantine.active())
    return quarantine.times() == 0 ? "" : fmt::format("{} x so far", quarantine.times());
  return fmt::format("for {}, {} probes, next in {}", duration_text(seconds(quarantine.lasting())),
                     quarantine.probes(), duration_text(seconds(quarantine.next_probe_in())));
}

}  // namespace

double percentile(const v1::LatencyHistogram& histogram, double share) {
  const auto& counts = histogram.counts();
  const auto total = std::accumulate(counts.begin(), counts.end(), std::uint64_t{});
  const auto longest = seconds(histogram.longest());
  const auto wanted = std::max(1.0, std::ceil(share * static_cast<double>(total)));
  std::uint64_t sum = 0;
  for (int i = 0; i < counts.size() && i < bounded_buckets; ++i) {
    sum += counts.Get(i);
    if (static_cast<double>(sum) >= wanted) return std::min(bound(i), longest);
  }
  return longest;
}

std::string load_line(const v1::BusStatistics& bus) {
  const auto held_back = fmt::format("; {} requests are held back for nodes in quarantine", bus.held_back());
  return fmt::format("{}: occupied {} of the last 10 s, {} of {} since the start{}", bus.bus(),
                     percent(bus.utilisation()), percent(bus.utilisation_since_start()),
                     duration_text(std::round(seconds(bus.since_start()))),
                     bus.held_back() > 0 ? held_back : "");
}

Table class_table(const v1::BusStatistics& bus) {
  Table table({"CLASS", "SENT", "WAIT", "MOST", "QUEUE P50", "P90", "P99", "MAX", "WIRE P50", "P90", "P99",
               "MAX", "EXPIRED", "SUPERSEDED", "NO LEASE", "NO PORT"},
              {1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12, 13, 14, 15});
  for (const auto& one : bus.classes()) {
    std::vector<Cell> row{
        lower_word(v1::TransactionClass_Name(one.transaction_class()), "TRANSACTION_CLASS_"),
        std::to_string(one.sent()), std::to_string(one.waiting()), std::to_string(one.most_waiting())};
    for (const auto* histogram : {&one.queueing(), &one.exchange()}) {
      for (const double share : {0.5, 0.9, 0.99}) row.emplace_back(time_text(percentile(*histogram, share)));
      row.emplace_back(time_text(seconds(histogram->longest())));
    }
    for (const auto drops : {one.dropped_expired(), one.dropped_superseded(), one.dropped_lease_lost(),
                             one.dropped_port_lost() + one.dropped_unsupported()})
      row.emplace_back(std::to_string(drops));
    table.add(std::move(row));
  }
  return table;
}

Table line_node_table(const v1::BusStatistics& bus) {
  Table table({"NODE", "NAME", "LOAD", "REPLIES", "TIMEOUTS", "CORRUPT", "I/O ERRORS", "REPEATS",
               "TURNAROUND", "QUARANTINE", "EXCEPTIONS", "STARTS WITHOUT REPLY"},
              {0, 2, 3, 4, 5, 6, 7, 8});
  for (const auto& node : bus.nodes()) {
    const auto& line = node.line();
    table.add({std::to_string(node.node()), node.name(), percent(line.utilisation_since_start()),
               std::to_string(line.replies()), std::to_string(line.timeouts()),
               std::to_string(line.corrupt_replies()), std::to_string(line.io_errors()),
               std::to_string(line.repeats()), time_text(seconds(line.longest_turnaround())),
               quarantine(line.quarantine()), exceptions(line), unknown_starts(node.unknown_starts())});
  }
  return table;
}

Table network_node_table(const v1::BusStatistics& bus) {
  Table table({"NODE", "NAME", "SDO", "ABORTS", "TIMEOUTS", "PROTOCOL", "TPDO", "RPDO", "EMCY",
               "HEARTBEATS LOST", "BOOTS", "STARTS WITHOUT REPLY"},
              {0, 2, 3, 4, 5, 6, 7, 8, 9, 10});
  for (const auto& node : bus.nodes()) {
    const auto& counted = node.network();
    table.add({std::to_string(node.node()), node.name(), std::to_string(counted.sdo_transfers()),
               std::to_string(counted.sdo_aborts()), std::to_string(counted.sdo_timeouts()),
               std::to_string(counted.sdo_protocol_errors()), std::to_string(counted.tpdos()),
               std::to_string(counted.rpdos()), std::to_string(counted.emergencies()),
               std::to_string(counted.heartbeats_lost()), std::to_string(counted.boots()),
               unknown_starts(node.unknown_starts())});
  }
  return table;
}

std::vector<std::string> statistics_lines(const google::protobuf::RepeatedPtrField<v1::BusStatistics>& buses,
                                          bool colour, int columns, TooWide too_wide) {
  std::vector<std::string> all;
  const auto add = [&](const Table& table) {
    std::ranges::move(table.lines(colour, columns, too_wide), std::back_inserter(all));
  };
  for (const auto& bus : buses) {
    if (!all.empty()) all.emplace_back();
    add(Table({load_line(bus)}));
    const bool network = bus.kind() == v1::BUS_KIND_CANOPEN;
    add(class_table(bus));
    if (bus.nodes().empty()) continue;
    all.emplace_back();
    add(network ? network_node_table(bus) : line_node_table(bus));
  }
  return all;
}

}  // namespace axisd::axisctl
