#include "api/server/bus_convert.hpp"

#include "api/server/convert.hpp"
#include "api/server/serial_format.hpp"

namespace axisd::server {

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
  to.set_format(to_text(from.format));
  to.set_model(from.model);
  to.set_model_code(from.model_code);
  to.set_version(from.version);
  to.set_pulses_per_revolution(static_cast<std::uint32_t>(from.pulses_per_revolution));
  to.set_configured_as(from.configured_as);
  to.set_note(from.note);
}

void to_proto(const ScanProgress& from, v1::ScanResponse& to) {
  to.set_probed(static_cast<std::uint32_t>(from.probed));
  to.set_total(static_cast<std::uint32_t>(from.total));
  for (const auto& node : from.found) to_proto(node, *to.add_found());
}

}  // namespace axisd::server
