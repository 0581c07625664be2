#include "daemon/metrics/axis_families.hpp"

#include <array>
#include <optional>
#include <string>
#include <string_view>

namespace axisd::metrics {
namespace {

constexpr std::array states = {
    AxisState::disabled,        AxisState::standstill,        AxisState::homing,
    AxisState::discrete_motion, AxisState::continuous_motion, AxisState::synchronized_motion,
    AxisState::stopping,        AxisState::error_stop};
constexpr std::array links = {LinkState::offline, LinkState::configuring, LinkState::online};

/// All axes, with their labels.
class AxisWriter {
 public:
  AxisWriter(Exposition& to, const std::vector<AxisSnapshotPtr>& axes) : to_(&to), axes_(&axes) {
    for (const auto& axis : axes) {
      labels_.push_back(Labels().with("axis", axis->name));
      measured_.push_back(labels_.back().with("unit", axis->unit));
    }
  }

  /// `write`: writes the samples of one axis.
  template <class Write>
  void family(std::string_view name, MetricType type, std::string_view help, Write write) {
    to_->family(name, type, help);
    for (std::size_t i = 0; i < axes_->size(); ++i) write(*(*axes_)[i], labels_[i]);
  }
  /// Of one value of each.
  template <class Value>
  void values(std::string_view name, MetricType type, std::string_view help, Value value) {
    family(name, type, help,
           [&](const AxisSnapshot& axis, const Labels& labels) { to_->sample(labels, value(axis)); });
  }
  /// Of a value in the axis's unit, that not each has.
  template <class Value>
  void measured(std::string_view name, std::string_view help, Value value) {
    to_->family(name, MetricType::gauge, help);
    for (std::size_t i = 0; i < axes_->size(); ++i)
      if (const std::optional<double> known = value(*(*axes_)[i])) to_->sample(measured_[i], *known);
  }
  /// One sample of each possible value, of which one is 1.
  template <class Values, class Value>
  void state_set(std::string_view name, std::string_view help, const Values& possible, Value value) {
    family(name, MetricType::gauge, help, [&](const AxisSnapshot& axis, const Labels& labels) {
      for (const auto one : possible)
        to_->sample(labels.with("state", to_string(one)), value(axis) == one ? 1 : 0);
    });
  }

 private:
  Exposition* to_;
  const std::vector<AxisSnapshotPtr>* axes_;
  std::vector<Labels> labels_, measured_;
};

void write_state(AxisWriter& axes, Exposition& to) {
  axes.family("axisd_axis_info", MetricType::info, "Where an axis is, and what drives it.",
              [&](const AxisSnapshot& axis, const Labels& labels) {
                to.sample(labels.with("bus", axis.bus)
                              .with("node", std::to_string(axis.node))
                              .with("model", axis.model)
                              .with("unit", axis.unit),
                          1);
              });
  axes.state_set("axisd_axis_state", "PLCopen state of an axis: 1 for the one that it is in.", states,
                 [](const AxisSnapshot& axis) { return axis.state; });
  axes.state_set("axisd_axis_link", "Whether a drive answers and is configured: 1 for what is so.", links,
                 [](const AxisSnapshot& axis) { return axis.link; });
  axes.values("axisd_axis_enabled", MetricType::gauge, "The drive's power stage is on.",
              [](const AxisSnapshot& axis) { return axis.enabled ? 1 : 0; });
  axes.values("axisd_axis_moving", MetricType::gauge, "The drive says that it moves.",
              [](const AxisSnapshot& axis) { return axis.moving ? 1 : 0; });
  axes.values("axisd_axis_position_trusted", MetricType::gauge, "The position is set, homed or restored.",
              [](const AxisSnapshot& axis) { return axis.trust == PositionTrust::unknown ? 0 : 1; });
  axes.values("axisd_axis_drifted", MetricType::gauge, "The drive no longer holds what is configured.",
              [](const AxisSnapshot& axis) { return axis.drift.empty() ? 0 : 1; });
  axes.values("axisd_axis_alarm_code", MetricType::gauge, "Alarm of the drive by its manual; 0: none.",
              [](const AxisSnapshot& axis) { return axis.alarm_code; });
  axes.values("axisd_axis_leased", MetricType::gauge, "A client has the lease of the axis.",
              [](const AxisSnapshot& axis) { return axis.lease_holder.empty() ? 0 : 1; });
  axes.values("axisd_axis_stop_holds", MetricType::gauge, "Holders that keep the axis in Stopping.",
              [](const AxisSnapshot& axis) { return axis.holds.size(); });
}

void write_measured(AxisWriter& axes, Exposition& to, TimePoint now) {
  axes.measured("axisd_axis_position", "Position in the axis's unit, as it was last read.",
                [](const AxisSnapshot& axis) -> std::optional<double> {
                  if (!axis.sampled.known()) return std::nullopt;
                  return axis.position;
                });
  axes.measured("axisd_axis_velocity", "Velocity in the axis's unit per second, as it was last read.",
                [](const AxisSnapshot& axis) -> std::optional<double> {
                  if (!axis.sampled.known()) return std::nullopt;
                  return axis.velocity;
                });
  axes.measured("axisd_axis_following_error",
                "Commanded position less the measured one, where the drive tells both.",
                [](const AxisSnapshot& axis) { return axis.following_error; });
  axes.family("axisd_axis_sample_age_seconds", MetricType::gauge, "How old the drive's values are.",
              [&](const AxisSnapshot& axis, const Labels& labels) {
                if (axis.sampled.known()) to.sample(labels, in_seconds(now - axis.sampled.after()));
              });
}

void write_counted(AxisWriter& axes, const core::Tallies& tallies) {
  axes.values("axisd_axis_faults_total", MetricType::counter,
              "Times that an axis went into ErrorStop, or another cause took the place of the first.",
              [&](const AxisSnapshot& axis) { return tallies.of(axis.name).faults; });
  axes.values("axisd_axis_link_losses_total", MetricType::counter, "Times that a drive ceased to answer.",
              [&](const AxisSnapshot& axis) { return tallies.of(axis.name).link_losses; });
  axes.values("axisd_axis_reboots_total", MetricType::counter, "Reboots of a drive that were noticed.",
              [](const AxisSnapshot& axis) { return axis.reboots; });
  axes.values("axisd_axis_eeprom_writes_total", MetricType::counter,
              "Registers saved in a drive since the axis is known on this computer.",
              [](const AxisSnapshot& axis) { return axis.eeprom_writes; });
}

}  // namespace

void write_axes(Exposition& to, const std::vector<AxisSnapshotPtr>& axes, const core::Tallies& tallies,
                TimePoint now) {
  AxisWriter writer(to, axes);
  write_state(writer, to);
  write_measured(writer, to, now);
  write_counted(writer, tallies);
}

void write_devices(Exposition& to, const std::vector<DeviceSnapshotPtr>& devices) {
  to.family("axisd_device_online", MetricType::gauge, "A node of the section devices answers.");
  for (const auto& device : devices)
    to.sample(Labels().with("device", device->name), device->link == LinkState::online ? 1 : 0);
  to.family("axisd_device_value", MetricType::gauge,
            "Value of a device by its configured name and unit, as it was last read.");
  for (const auto& device : devices)
    for (const auto& value : device->values)
      if (value.value)
        to.sample(Labels().with("device", device->name).with("name", value.name).with("unit", value.unit),
                  *value.value);
}

}  // namespace axisd::metrics
