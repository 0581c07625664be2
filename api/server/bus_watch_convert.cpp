#include "api/server/bus_watch_convert.hpp"

#include <chrono>
#include <set>
#include <string_view>
#include <utility>

#include "api/server/convert.hpp"

namespace axisd::server {
namespace {

static_assert(transaction_class_count == v1::TransactionClass_MAX);
static_assert(std::to_underlying(TracedFrame::Kind::link) + 1 == v1::TraceKind_MAX);

v1::TransactionClass class_of(TransactionClass from) {
  return static_cast<v1::TransactionClass>(std::to_underlying(from) + 1);
}

/// Modbus application protocol V1.1b3, 7.
std::string_view exception_name(std::size_t code) {
  switch (code) {
    case 1:
      return "illegal function";
    case 2:
      return "illegal data address";
    case 3:
      return "illegal data value";
    case 4:
      return "device failure";
    case 5:
      return "acknowledge";
    case 6:
      return "device busy";
    case 8:
      return "memory parity error";
    case 10:
      return "gateway path unavailable";
    case 11:
      return "gateway target failed to respond";
    default:
      return "";
  }
}

void fill(const LatencyHistogram& from, v1::LatencyHistogram& to) {
  auto count = from.counts().size();
  while (count > 0 && from.counts().at(count - 1) == 0) --count;
  for (std::size_t i = 0; i < count; ++i) to.add_counts(from.counts().at(i));
  to_proto(from.longest(), *to.mutable_longest());
}

void fill(const ClassStatistics& from, v1::ClassStatistics& to) {
  to.set_sent(from.sent);
  to.set_waiting(from.waiting);
  to.set_most_waiting(from.most_waiting);
  fill(from.queueing, *to.mutable_queueing());
  fill(from.exchange, *to.mutable_exchange());
  to.set_dropped_expired(from.drops.expired);
  to.set_dropped_superseded(from.drops.superseded);
  to.set_dropped_lease_lost(from.drops.lease_lost);
  to.set_dropped_port_lost(from.drops.port_lost);
  to.set_dropped_unsupported(from.drops.unsupported);
}

void fill_classes(const StatisticsByClass& from, v1::BusStatistics& to) {
  for (std::size_t i = 0; i < from.size(); ++i) {
    auto& entry = *to.add_classes();
    entry.set_transaction_class(class_of(static_cast<TransactionClass>(i)));
    fill(from.at(i), entry);
  }
}

void fill(const modbus_rtu::NodeStatistics& from, Duration since_start, v1::LineNodeStatistics& to) {
  to.set_replies(from.replies);
  to.set_timeouts(from.timeouts);
  to.set_corrupt_replies(from.corrupt);
  to.set_io_errors(from.io_errors);
  for (std::size_t code = 0; code < from.exceptions.size(); ++code) {
    if (from.exceptions.at(code) == 0) continue;
    auto& entry = *to.add_exceptions();
    entry.set_code(static_cast<std::uint32_t>(code));
    entry.set_name(std::string(exception_name(code)));
    entry.set_count(from.exceptions.at(code));
  }
  to.set_repeats(from.repeats);
  to_proto(from.longest_turnaround, *to.mutable_longest_turnaround());
  if (since_start > Duration{})
    to.set_utilisation_since_start(std::chrono::duration<double>(from.occupied) /
                                   std::chrono::duration<double>(since_start));
}

void fill(const QuarantineStatus& from, v1::Quarantine& to) {
  to.set_active(from.active);
  to_proto(from.lasting, *to.mutable_lasting());
  to_proto(from.next_probe_in, *to.mutable_next_probe_in());
  to.set_probes(from.probes);
  to.set_times(from.times);
}

void fill(const NetworkNodeStatistics& from, v1::NetworkNodeStatistics& to) {
  to.set_sdo_transfers(from.sdo.transfers);
  to.set_sdo_aborts(from.sdo.aborted_by_node);
  to.set_sdo_timeouts(from.sdo.timeouts);
  to.set_sdo_protocol_errors(from.sdo.protocol_errors);
  to.set_tpdos(from.traffic.tpdos);
  to.set_rpdos(from.traffic.rpdos);
  to.set_emergencies(from.emergencies);
  to.set_heartbeats_lost(from.traffic.heartbeats_lost);
  to.set_boots(from.traffic.boots);
}

/// Everybody who is configured, and everybody else of whom something was counted.
void fill_nodes(const BusStatistics& from, v1::BusStatistics& to) {
  std::set<std::uint8_t> nodes;
  for (const auto& [node, known] : from.known) nodes.insert(node);
  for (const auto& [node, counted] : from.network) nodes.insert(node);
  if (from.line)
    for (const auto& [node, counted] : from.line->nodes()) nodes.insert(node);
  for (const auto node : nodes) {
    auto& entry = *to.add_nodes();
    entry.set_node(node);
    if (const auto known = from.known.find(node); known != from.known.end()) {
      entry.set_name(known->second.name);
      const auto& starts = known->second.unknown_starts;
      entry.mutable_unknown_starts()->set_executed(starts.executed);
      entry.mutable_unknown_starts()->set_not_executed(starts.not_executed);
      entry.mutable_unknown_starts()->set_unresolved(starts.unresolved);
    }
    if (from.line) {
      const auto* counted = from.line->nodes().find(node);
      fill(counted == nullptr ? modbus_rtu::NodeStatistics{} : *counted, from.since_start,
           *entry.mutable_line());
      if (const auto there = from.quarantine.find(node); there != from.quarantine.end())
        fill(there->second, *entry.mutable_line()->mutable_quarantine());
    } else if (const auto counted = from.network.find(node); counted != from.network.end()) {
      fill(counted->second, *entry.mutable_network());
    }
  }
}

void fill(const KeptFrame& from, const std::string& bus, v1::TracedFrame& to) {
  const auto frame = from.whole();
  to.set_sequence(from.sequence);
  to.set_monotonic_ns(frame.at.time_since_epoch().count());
  to_proto(from.wall, *to.mutable_at());
  to.set_kind(static_cast<v1::TraceKind>(std::to_underlying(frame.kind) + 1));
  if (frame.asked_for()) to.set_transaction_class(class_of(frame.transaction_class));
  to.set_node(frame.node);
  to.set_data(from.data.data(), from.data.size());
  if (frame.on_network && frame.kind != TracedFrame::Kind::link) {
    auto& can = *to.mutable_can();
    can.set_id(frame.id);
    can.set_extended(frame.extended);
    can.set_remote(frame.remote);
    can.set_length(frame.length);
  }
  to.set_why(std::string(frame.why));
  append_line(*to.mutable_text(), bus, frame);
  to.mutable_text()->pop_back();  // its line end
}

}  // namespace

void to_proto(const BusStatistics& from, v1::BusStatistics& to) {
  to.set_bus(from.bus);
  to.set_kind(static_cast<v1::BusKind>(std::to_underlying(from.kind) + 1));
  to_proto(from.since_start, *to.mutable_since_start());
  to.set_utilisation(from.recent_load);
  to.set_utilisation_since_start(from.overall_load);
  to.set_held_back(from.held_back);
  if (from.line) fill_classes(from.line->classes(), to);
  if (from.sdo) fill_classes(*from.sdo, to);
  fill_nodes(from, to);
}

void to_proto(const TraceBatch& from, const std::string& bus, v1::TraceBusResponse& to) {
  to.set_lost(from.lost);
  for (const auto& frame : from.frames) fill(frame, bus, *to.add_frames());
}

void to_proto(const FlightRecord& from, v1::FlightRecord& to) {
  to.set_name(from.name);
  to.set_bus(from.bus);
  to.set_reason(from.reason);
  to_proto(from.written_at, *to.mutable_written_at());
  to.set_size(from.size);
}

}  // namespace axisd::server
