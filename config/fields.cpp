#include "config/fields.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <optional>
#include <string_view>
#include <type_traits>
#include <utility>
#include <variant>

#include "devices/descriptor.hpp"

namespace axisd::config {

namespace {

template <class T>
std::string to_text(const T& value) {
  if constexpr (std::is_enum_v<T>)
    return std::to_string(static_cast<int>(value));
  else if constexpr (std::is_same_v<T, Duration>)
    return fmt::format("{} ns", value.count());
  else
    return fmt::format("{}", value);
}
template <class T>
std::string to_text(const std::optional<T>& value) {
  return value ? to_text(*value) : "none";
}
std::string to_text(const SettingValue& value) {
  return fmt::format("{}:{}", value.index(),
                     std::visit([](const auto& v) { return fmt::format("{}", v); }, value));
}

/// Fills one section.
class Fields {
 public:
  Fields(std::string section, std::string name)
      : section_{.section = std::move(section), .name = std::move(name)} {}
  template <class T>
  void add(std::string key, const T& value) {
    section_.fields.emplace(prefix_ + std::move(key), to_text(value));
  }
  /// What follows stands under this key.
  void enter(std::string_view key) { prefix_ = key.empty() ? std::string() : fmt::format("{}.", key); }
  Section take() { return std::move(section_); }

 private:
  Section section_;
  std::string prefix_;
};

void add_terminals(Fields& fields, std::string_view section, const std::vector<TerminalSettings>& terminals) {
  fields.enter(section);
  for (const auto& t : terminals)
    fields.add(t.terminal, fmt::format("{}{}", t.function, t.active_low ? ", active low" : ""));
}

void add_homing(Fields& fields, const HomingSettings& homing) {
  fields.enter("homing");
  if (homing.number)
    fields.add("method", fmt::format("number {}", int{*homing.number}));
  else
    fields.add("method", homing.method);
  fields.add("velocity", homing.velocity);
  fields.add("search_velocity", homing.search_velocity);
  fields.add("acceleration_time", homing.acceleration_time);
  fields.add("position", homing.position);
  fields.add("offset", homing.offset);
  fields.add("backoff", homing.backoff);
  fields.add("max_travel", homing.max_travel);
  fields.add("timeout", homing.timeout);
}

void add_scale_and_limits(Fields& fields, const AxisSettings& axis) {
  fields.add("unit", axis.scale.unit);
  fields.enter("scale");
  fields.add("microstep", axis.scale.pulses_per_revolution);
  fields.add("gear", fmt::format("{}/{}", axis.scale.gear_motor, axis.scale.gear_output));
  fields.add("travel", fmt::format("{}/{}", axis.scale.travel_numerator, axis.scale.travel_denominator));
  fields.add("invert", axis.scale.invert);
  fields.add("modulo", axis.scale.modulo);
  fields.enter("limits");
  fields.add("position",
             to_text(axis.limits.position_minimum) + ", " + to_text(axis.limits.position_maximum));
  fields.add("velocity", axis.limits.velocity);
  fields.add("acceleration_time", axis.limits.acceleration_time);
  fields.add("deceleration_time", axis.limits.deceleration_time);
  fields.add("start_speed", axis.limits.start_speed_rpm);
  fields.add("eeprom_saves_per_day", axis.limits.eeprom_saves_per_day);
}

void add_segments(Fields& fields, const SegmentSettings& segments) {
  fields.enter("segments");
  fields.add("mode", segments.absolute);
  for (const auto& row : segments.positions) {
    fields.enter(fmt::format("segments.positions.{}", row.number));
    fields.add("target", row.target);
    fields.add("velocity", row.velocity);
    fields.add("acceleration_time", row.acceleration_time);
  }
  for (const auto& row : segments.velocities) {
    fields.enter(fmt::format("segments.velocities.{}", row.number));
    fields.add("velocity", row.velocity);
    fields.add("acceleration_time", row.acceleration_time);
  }
}

std::string to_text(const PersistSettings& persist) {
  return fmt::format("terminals={} segments={} homing={} drive={}", persist.terminals, persist.segments,
                     persist.homing, persist.drive);
}

void add_policies(Fields& fields, const AxisSettings& axis) {
  fields.enter({});
  fields.add("load", axis.vertical);
  fields.add("on_lease_loss", axis.on_lease_loss);
  fields.add("stop_escalation", axis.stop_escalation_release);
  fields.add("require_trust", axis.require_trust);
  fields.add("jog_travel", axis.jog_travel);
  fields.add("position_tolerance", axis.position_tolerance);
  fields.add("turnaround_max", axis.turnaround_max);
  fields.add("poll.moving", axis.poll_moving);
  fields.add("poll.idle", axis.poll_idle);
  fields.add("reboot_guard", axis.reboot_guard);
  fields.add("stop_margin", axis.stop_margin);
  fields.add("start_within", axis.start_within);
  fields.add("drift_check", axis.drift_check);
  fields.add("persist", to_text(axis.persist));
  fields.add("brake.release_time", axis.brake.release_time);
  fields.add("brake.engage_time", axis.brake.engage_time);
}

bool is_path(const DriveDescriptor& descriptor, std::string_view key) {
  const auto found = std::ranges::find(descriptor.settings, key, &SettingSpec::key);
  return found != descriptor.settings.end() && found->kind == "path";
}

void add_axis(Fields& fields, const AxisSettings& axis) {
  fields.add("bus", axis.bus);
  fields.add("node", axis.node);
  fields.add("model", axis.model);
  add_scale_and_limits(fields, axis);
  if (axis.homing) add_homing(fields, *axis.homing);
  add_terminals(fields, "inputs", axis.inputs);
  add_terminals(fields, "outputs", axis.outputs);
  add_policies(fields, axis);
  if (axis.segments) add_segments(fields, *axis.segments);
  fields.enter("drive");
  for (const auto& [key, value] : axis.model_settings) {
    const bool file = axis.own_descriptor && is_path(*axis.own_descriptor, key);
    fields.add(key,
               file ? fmt::format("{} {:x}", to_text(value), axis.own_descriptor_source) : to_text(value));
  }
}

Section section_of(const AxisEntry& entry) {
  Fields fields("axes", entry.axis.name);
  add_axis(fields, entry.axis);
  fields.enter("simulate");
  const auto& simulation = entry.simulation;
  fields.add("home_switch", simulation.home_switch);
  fields.add("home_width", simulation.home_width);
  fields.add("positive_limit", simulation.positive_limit);
  fields.add("negative_limit", simulation.negative_limit);
  fields.add("start_position", simulation.start_position);
  fields.add("velocity_unit", simulation.velocity_unit);
  fields.add("acceleration_unit", simulation.acceleration_unit);
  fields.add("enabled_at_power_up", simulation.enabled_at_power_up);
  return fields.take();
}

void add_budget(Fields& fields, const BudgetPolicy& budget) {
  fields.add("budget", budget.refuse);
  fields.add("stop_bound", budget.stop_bound);
  fields.add("refresh_bound", budget.refresh_bound);
  fields.add("host_allowance", budget.host_allowance);
}

Section section_of(const modbus_rtu::LineSettings& bus) {
  Fields fields("buses", bus.name);
  fields.enter("modbus_rtu");
  fields.add("port", bus.port);
  fields.add("baud", bus.baud);
  fields.add("format", modbus_rtu::to_string(bus.format));
  fields.add("turnaround_max", bus.turnaround_max);
  add_budget(fields, bus.budget);
  return fields.take();
}

Section section_of(const canopen::NetworkSettings& bus) {
  Fields fields("buses", bus.name);
  fields.enter("canopen");
  fields.add("interface", bus.interface);
  fields.add("bitrate", bus.bitrate);
  fields.add("sync_period", bus.sync_period);
  fields.add("sdo_timeout", bus.sdo_timeout);
  fields.add("sdo_answer", bus.sdo_answer);
  add_budget(fields, bus.budget);
  return fields.take();
}

Section section_of(const DeviceSettings& device) {
  Fields fields("devices", device.name);
  fields.add("bus", device.bus);
  fields.add("model", device.kind);
  fields.add("node", device.node);
  fields.add("poll", device.poll);
  fields.add("turnaround_max", device.turnaround_max);
  const bool registers = device.kind == BusKind::modbus_rtu;
  for (const auto& entry : device.values) {
    fields.enter(fmt::format("{}.{}", registers ? "registers" : "objects", entry.name));
    fields.add(registers ? "address" : "object", entry.address);
    fields.add("type", entry.type);
    fields.add("scale", entry.scale);
    fields.add("unit", entry.unit);
    fields.add("access", entry.writable);
  }
  return fields.take();
}

Section section_of(const GroupSettings& group) {
  Fields fields("groups", group.name);
  fields.add("axes", fmt::format("{}", fmt::join(group.axes, ", ")));
  fields.add("max_arrival_error", group.max_arrival_error);
  return fields.take();
}

Section section_of(const ServerSettings& server) {
  Fields fields("server", {});
  fields.add("listen", server.listen);
  fields.add("stop_listen", server.stop_listen);
  fields.add("plaintext", server.plaintext);
  fields.add("reflection", server.reflection);
  fields.add("metrics.listen", server.metrics.listen);
  fields.add("metrics.remote", server.metrics.remote);
  fields.add("limits.calls", server.limits.calls);
  fields.add("limits.streams", server.limits.streams);
  fields.add("limits.connections", server.limits.connections);
  fields.add("limits.request_ids", server.limits.request_ids);
  fields.add("limits.stalled_reader", server.limits.stalled_reader);
  if (!server.tls) return fields.take();
  fields.add("tls.certificate", server.tls->certificate);
  fields.add("tls.key", server.tls->key);
  fields.add("tls.client_ca", server.tls->client_ca);
  fields.add("tls.crl", server.tls->crl);
  return fields.take();
}

std::string to_text(const Roles& roles) {
  std::string text;
  for (const auto& [client, role] : roles) text += fmt::format("{}: {}\n", client, axisd::to_string(role));
  return text;
}

Section section_of(const AccessSettings& access) {
  Fields fields("access", {});
  fields.add("roles", to_text(access.roles));
  fields.add("delegates", to_text(access.delegates));
  for (const auto& [axis, roles] : access.axes)
    fields.add(fmt::format("axes.{}.roles", axis), to_text(roles));
  return fields.take();
}

/// A key at the top of the file that is a value itself.
Section single(std::string key, std::string value) {
  return {.section = std::move(key), .name = {}, .fields = {{"", std::move(value)}}};
}

std::vector<std::string> keys_that_differ(const Section& before, const Section& after) {
  std::vector<std::string> keys;
  const auto look = [&](const Section& here, const Section& there) {
    for (const auto& [key, value] : here.fields) {
      const auto found = there.fields.find(key);
      if (found == there.fields.end() || found->second != value) keys.push_back(key);
    }
  };
  look(before, after);
  look(after, before);
  std::ranges::sort(keys);
  keys.erase(std::ranges::unique(keys).begin(), keys.end());
  return keys;
}

const Section* find(const std::vector<Section>& all, const Section& like) {
  const auto found = std::ranges::find_if(
      all, [&](const Section& each) { return each.section == like.section && each.name == like.name; });
  return found == all.end() ? nullptr : &*found;
}

}  // namespace

std::vector<Section> sections(const Configuration& configuration) {
  std::vector<Section> all{single("machine", configuration.machine),
                           single("state_directory", configuration.state_directory),
                           section_of(configuration.server)};
  if (configuration.access) all.push_back(section_of(*configuration.access));
  Fields recorder("flight_recorder", {});
  recorder.add("memory", configuration.flight_recorder.memory);
  recorder.add("files", configuration.flight_recorder.files);
  all.push_back(recorder.take());
  Fields audit("audit", {});
  audit.add("files", configuration.audit.files);
  audit.add("file_size", configuration.audit.file_size);
  all.push_back(audit.take());
  const auto& leased = configuration.leases;
  all.push_back(single("control", leased.required ? "leased" : "open"));
  Fields leases("leases", {});
  leases.add("shortest_ttl", leased.shortest_ttl);
  leases.add("default_ttl", leased.default_ttl);
  leases.add("longest_ttl", leased.longest_ttl);
  all.push_back(leases.take());
  for (const auto& bus : configuration.lines) all.push_back(section_of(bus));
  for (const auto& bus : configuration.networks) all.push_back(section_of(bus));
  for (const auto& axis : configuration.axes) all.push_back(section_of(axis));
  for (const auto& device : configuration.devices) all.push_back(section_of(device));
  for (const auto& group : configuration.groups) all.push_back(section_of(group));
  return all;
}

std::vector<ConfigurationChange> differences(const Configuration& before, const Configuration& after) {
  using Kind = ConfigurationChangeKind;
  const auto old = sections(before), now = sections(after);
  std::vector<ConfigurationChange> changes;
  for (const auto& section : old) {
    const auto* other = find(now, section);
    if (other == nullptr) {
      changes.push_back({.section = section.section, .name = section.name, .kind = Kind::removed});
    } else if (other->fields != section.fields) {
      auto keys = keys_that_differ(section, *other);
      std::erase(keys, std::string());
      changes.push_back(
          {.section = section.section, .name = section.name, .kind = Kind::changed, .keys = std::move(keys)});
    }
  }
  for (const auto& section : now)
    if (find(old, section) == nullptr)
      changes.push_back({.section = section.section, .name = section.name, .kind = Kind::added});
  return changes;
}

}  // namespace axisd::config
