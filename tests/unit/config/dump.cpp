#include "tests/unit/config/dump.hpp"

#include <fmt/format.h>

#include <optional>
#include <string_view>
#include <type_traits>
#include <variant>

namespace axisd::config {

namespace {

class Dump {
 public:
  template <class T>
  void field(std::string_view name, const T& value) {
    text_ += fmt::format("{}{} = {}\n", prefix_, name, to_text(value));
  }
  void enter(std::string_view name) { prefix_ = fmt::format("{}.", name); }
  [[nodiscard]] std::string text() const { return text_; }

 private:
  template <class T>
  static std::string to_text(const T& value) {
    if constexpr (std::is_enum_v<T>) {
      return std::to_string(static_cast<int>(value));
    } else if constexpr (std::is_same_v<T, Duration>) {
      return fmt::format("{} ns", value.count());
    } else {
      return fmt::format("{}", value);
    }
  }
  template <class T>
  static std::string to_text(const std::optional<T>& value) {
    return value ? to_text(*value) : "none";
  }
  static std::string to_text(const SettingValue& value) {
    return fmt::format("{}:{}", value.index(),
                       std::visit([](const auto& v) { return fmt::format("{}", v); }, value));
  }

  std::string prefix_, text_;
};

void dump_terminals(Dump& dump, std::string_view section, const std::vector<TerminalSettings>& terminals) {
  for (const auto& t : terminals) {
    dump.field(fmt::format("{}.{}", section, t.terminal), fmt::format("{} low={}", t.function, t.active_low));
  }
}

void dump_homing(Dump& dump, const HomingSettings& homing) {
  dump.field("homing.method", homing.method);
  dump.field("homing.velocity", homing.velocity);
  dump.field("homing.search_velocity", homing.search_velocity);
  dump.field("homing.acceleration_time", homing.acceleration_time);
  dump.field("homing.position", homing.position);
  dump.field("homing.offset", homing.offset);
  dump.field("homing.backoff", homing.backoff);
  dump.field("homing.max_travel", homing.max_travel);
  dump.field("homing.timeout", homing.timeout);
}

void dump_scale_and_limits(Dump& dump, const AxisSettings& axis) {
  dump.field("pulses_per_revolution", axis.scale.pulses_per_revolution);
  dump.field("gear_motor", axis.scale.gear_motor);
  dump.field("gear_output", axis.scale.gear_output);
  dump.field("travel_numerator", axis.scale.travel_numerator);
  dump.field("travel_denominator", axis.scale.travel_denominator);
  dump.field("invert", axis.scale.invert);
  dump.field("modulo", axis.scale.modulo);
  dump.field("unit", axis.scale.unit);
  dump.field("position_minimum", axis.limits.position_minimum);
  dump.field("position_maximum", axis.limits.position_maximum);
  dump.field("velocity", axis.limits.velocity);
  dump.field("acceleration_time", axis.limits.acceleration_time);
  dump.field("deceleration_time", axis.limits.deceleration_time);
  dump.field("start_speed_rpm", axis.limits.start_speed_rpm);
}

void dump_segments(Dump& dump, const SegmentSettings& segments) {
  dump.field("segments.absolute", segments.absolute);
  for (const auto& row : segments.positions) {
    const auto path = fmt::format("segments.positions.{}.", row.number);
    dump.field(path + "target", row.target);
    dump.field(path + "velocity", row.velocity);
    dump.field(path + "acceleration_time", row.acceleration_time);
  }
  for (const auto& row : segments.velocities) {
    const auto path = fmt::format("segments.velocities.{}.", row.number);
    dump.field(path + "velocity", row.velocity);
    dump.field(path + "acceleration_time", row.acceleration_time);
  }
}

void dump_budget(Dump& dump, const BudgetPolicy& budget) {
  dump.field("budget.refuse", budget.refuse);
  dump.field("budget.stop_bound", budget.stop_bound);
  dump.field("budget.refresh_bound", budget.refresh_bound);
  dump.field("budget.host_allowance", budget.host_allowance);
}

void dump_device(Dump& dump, const DeviceSettings& device) {
  dump.enter(fmt::format("devices.{}", device.name));
  dump.field("bus", device.bus);
  dump.field("kind", device.kind);
  dump.field("node", device.node);
  dump.field("poll", device.poll);
  dump.field("turnaround_max", device.turnaround_max);
  for (const auto& entry : device.values) {
    const auto path = fmt::format("values.{}.", entry.name);
    dump.field(path + "address", entry.address);
    dump.field(path + "type", entry.type);
    dump.field(path + "scale", entry.scale);
    dump.field(path + "unit", entry.unit);
    dump.field(path + "writable", entry.writable);
  }
}

void dump_axis(Dump& dump, const AxisSettings& axis) {
  dump.enter(fmt::format("axes.{}", axis.name));
  dump.field("bus", axis.bus);
  dump.field("node", axis.node);
  dump.field("model", axis.model);
  dump_scale_and_limits(dump, axis);
  if (axis.homing) dump_homing(dump, *axis.homing);
  dump_terminals(dump, "inputs", axis.inputs);
  dump_terminals(dump, "outputs", axis.outputs);
  dump.field("vertical", axis.vertical);
  dump.field("on_lease_loss", axis.on_lease_loss);
  dump.field("stop_escalation_release", axis.stop_escalation_release);
  dump.field("require_trust", axis.require_trust);
  dump.field("jog_travel", axis.jog_travel);
  dump.field("position_tolerance", axis.position_tolerance);
  dump.field("turnaround_max", axis.turnaround_max);
  dump.field("poll_moving", axis.poll_moving);
  dump.field("poll_idle", axis.poll_idle);
  dump.field("reboot_guard", axis.reboot_guard);
  dump.field("stop_margin", axis.stop_margin);
  dump.field("drift_check", axis.drift_check);
  dump.field("persist", fmt::format("terminals={} segments={} homing={} drive={}", axis.persist.terminals,
                                    axis.persist.segments, axis.persist.homing, axis.persist.drive));
  dump.field("release_time", axis.brake.release_time);
  dump.field("engage_time", axis.brake.engage_time);
  if (axis.segments) dump_segments(dump, *axis.segments);
  for (const auto& [key, value] : axis.model_settings) dump.field("drive." + key, value);
}

}  // namespace

std::string dump(const Configuration& configuration) {
  Dump dump;
  dump.field("machine", configuration.machine);
  dump.field("state_directory", configuration.state_directory);
  dump.field("flight_recorder.memory", configuration.flight_recorder.memory);
  dump.field("flight_recorder.files", configuration.flight_recorder.files);
  dump.field("leases.required", configuration.leases.required);
  dump.field("leases.shortest_ttl", configuration.leases.shortest_ttl);
  dump.field("leases.default_ttl", configuration.leases.default_ttl);
  dump.field("leases.longest_ttl", configuration.leases.longest_ttl);
  dump.field("listen", configuration.server.listen);
  const auto& limits = configuration.server.limits;
  dump.field("limits.calls", limits.calls);
  dump.field("limits.streams", limits.streams);
  dump.field("limits.connections", limits.connections);
  dump.field("limits.stalled_reader", limits.stalled_reader);
  if (const auto& tls = configuration.server.tls) {
    dump.field("tls", fmt::format("{} {} {}", tls->certificate, tls->key, tls->client_ca));
  }
  for (const auto& bus : configuration.lines) {
    dump.enter(fmt::format("buses.{}", bus.name));
    dump.field("port", bus.port);
    dump.field("baud", bus.baud);
    dump.field("parity", bus.format.parity);
    dump.field("stop_bits", bus.format.stop_bits);
    dump.field("turnaround_max", bus.turnaround_max);
    dump_budget(dump, bus.budget);
  }
  for (const auto& bus : configuration.networks) {
    dump.enter(fmt::format("buses.{}", bus.name));
    dump.field("interface", bus.interface);
    dump.field("bitrate", bus.bitrate);
    dump.field("sync_period", bus.sync_period);
    dump.field("sdo_timeout", bus.sdo_timeout);
    dump_budget(dump, bus.budget);
  }
  for (const auto& [axis, simulation] : configuration.axes) {
    dump_axis(dump, axis);
    dump.field("home_switch", simulation.home_switch);
    dump.field("home_width", simulation.home_width);
    dump.field("positive_limit", simulation.positive_limit);
    dump.field("negative_limit", simulation.negative_limit);
    dump.field("start_position", simulation.start_position);
  }
  for (const auto& device : configuration.devices) dump_device(dump, device);
  for (const auto& group : configuration.groups) {
    dump.enter(fmt::format("groups.{}", group.name));
    dump.field("axes", fmt::format("{}", fmt::join(group.axes, " ")));
    dump.field("max_arrival_error", group.max_arrival_error);
  }
  return dump.text();
}

}  // namespace axisd::config
