#include "api/server/bus_convert.hpp"

#include <span>
#include <utility>

#include "api/server/convert.hpp"
#include "api/server/parameter_type.hpp"
#include "api/server/serial_format.hpp"

namespace axisd::server {

static_assert(std::to_underlying(BusKind::canopen) + 1 == v1::BusKind_MAX);
static_assert(std::to_underlying(can::InterfaceState::stalled) + 1 == v1::NetworkLink_MAX);

void to_proto(const NetworkStatus& from, v1::NetworkStatus& to) {
  to.set_link(static_cast<v1::NetworkLink>(std::to_underlying(from.link) + 1));
  to.set_frames_received(from.frames.received);
  to.set_frames_sent(from.frames.sent);
  to.set_frames_not_sent(from.frames.not_sent);
  to.set_frames_unknown(from.frames.unknown);
  to.set_error_frames(from.frames.error_frames);
  to.set_receive_overflows(from.frames.receive_overflows);
  to.set_no_buffer(from.frames.no_buffer);
  to.set_bus_offs(from.frames.bus_offs);
  to.set_stalls(from.frames.stalls);
  to.set_sdo_transfers(from.sdo.transfers);
  to.set_sdo_aborts(from.sdo.aborted_by_node);
  to.set_sdo_timeouts(from.sdo.timeouts);
  to.set_sdo_protocol_errors(from.sdo.protocol_errors);
  if (from.sync_period > Duration{}) {
    to_proto(from.sync_period, *to.mutable_sync_period());
    to_proto(from.sync.latest, *to.mutable_sync_latest());
  }
  to.set_sync_running(from.sync_running);
  to.set_sync_sent(from.sync.sent);
  to.set_sync_missed(from.sync.missed);
  to.set_emergencies(from.emergencies);
  for (const auto node : from.foreign_nodes) to.add_foreign_nodes(node);
  to.set_foreign_frames(from.others.foreign_node);
  to.set_unknown_frames(from.others.unknown_cob);
  to.set_malformed_frames(from.others.malformed);
  if (from.link_helper_error) to_proto(*from.link_helper_error, *to.mutable_link_helper_error());
}

void to_proto(const BusStatus& from, v1::Bus& to) {
  to.set_name(from.name);
  to.set_port(from.port);
  to.set_baud(static_cast<std::uint32_t>(from.baud));
  to.set_open(from.open);
  if (from.error) to_proto(*from.error, *to.mutable_error());
  to.set_simulated(from.simulated);
  to.set_transactions(from.counters.transactions);
  to.set_timeouts(from.counters.timeouts);
  to.set_corrupt_replies(from.counters.corrupt);
  to.set_exceptions(from.counters.exceptions);
  to.set_foreign_frames(from.counters.foreign_frames);
  to.set_dropped_expired(from.counters.dropped_expired);
  to.set_dropped_superseded(from.counters.dropped_superseded);
  to.set_io_errors(from.counters.io_errors);
  to.set_kind(static_cast<v1::BusKind>(std::to_underlying(from.kind) + 1));
  if (from.network) to_proto(*from.network, *to.mutable_network());
}

void to_proto(const DeviceSnapshot& from, v1::Device& to) {
  to.set_name(from.name);
  to.set_bus(from.bus);
  to.set_node(from.node);
  to.set_link(to_proto(from.link));
  if (from.error) to_proto(*from.error, *to.mutable_error());
  for (const auto& value : from.values) {
    auto& entry = *to.add_values();
    entry.set_name(value.name);
    if (value.value) entry.set_value(*value.value);
    entry.set_unit(value.unit);
    entry.set_writable(value.writable);
  }
  // A node that never answered was never measured: unset instead of 1970.
  if (from.measured_at != WallTime{}) to_proto(from.measured_at, *to.mutable_measured_at());
}

void to_proto(const FoundNode& from, v1::FoundNode& to) {
  to.set_node(from.node);
  to.set_baud(static_cast<std::uint32_t>(from.baud));
  if (!from.on_network) to.set_format(to_text(from.format));
  to.set_model(from.model);
  to.set_model_code(from.model_code);
  to.set_version(from.version);
  to.set_pulses_per_revolution(static_cast<std::uint32_t>(from.pulses_per_revolution));
  to.set_configured_as(from.configured_as);
  to.set_note(from.note);
  if (!from.identity) return;
  to.set_device_type(from.identity->device_type);
  if (from.identity->vendor) to.set_vendor(*from.identity->vendor);
  if (from.identity->product) to.set_product(*from.identity->product);
  if (from.identity->revision) to.set_revision(*from.identity->revision);
  if (from.identity->serial) to.set_serial_number(*from.identity->serial);
}

void to_proto(const std::vector<std::uint8_t>& bytes, v1::ParameterType type, v1::TransactResponse& to) {
  to.set_data(bytes.data(), bytes.size());
  const auto size = type == v1::PARAMETER_TYPE_UNSPECIFIED ? bytes.size() : size_of(type);
  constexpr std::size_t longest = 7;  // more does not fit a signed number
  if (size == 0 || size > longest || size > bytes.size()) return;
  const auto number = canopen::number_of(std::span(bytes).first(size));
  const auto bits = static_cast<unsigned>(8 * size);
  to.set_value(is_signed(type) ? canopen::sign_extended(number, bits) : static_cast<std::int64_t>(number));
}

void to_proto(const ScanProgress& from, v1::ScanResponse& to) {
  to.set_probed(static_cast<std::uint32_t>(from.probed));
  to.set_total(static_cast<std::uint32_t>(from.total));
  for (const auto& node : from.found) to_proto(node, *to.add_found());
}

}  // namespace axisd::server
