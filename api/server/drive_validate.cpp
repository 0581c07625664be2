#include "api/server/drive_validate.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <set>
#include <utility>

#include "api/server/convert.hpp"
#include "api/server/serial_format.hpp"
#include "api/server/validate.hpp"
#include "devices/nearest.hpp"

namespace axisd::server {
namespace {

using namespace std::chrono_literals;

constexpr Duration longest_verify = 10min;
constexpr Duration default_segment_time = 100ms;
constexpr Duration longest_segment_time = 1h;  // the drives take less; this only keeps sums in range

double in_milliseconds(Duration duration) {
  return std::chrono::duration<double, std::milli>(duration).count();
}

/// An error that keeps the address of the parameter that it is about.
std::unexpected<Error> refuse(const KnownDrive& drive, const ParameterSpec& spec, Reason reason,
                              std::string message, std::string remedy) {
  return fail({.reason = reason,
               .message = std::move(message),
               .remedy = std::move(remedy),
               .where = {.bus = drive.axis->bus, .node = drive.axis->node, .object = spec.address}});
}

Result<const ParameterSpec*> find_parameter(const KnownDrive& drive, std::string_view name) {
  const auto& all = drive.model->parameters;
  if (const auto found = std::ranges::find(all, name, &ParameterSpec::name); found != all.end())
    return &*found;
  std::vector<std::string_view> names;
  for (const auto& spec : all) names.push_back(spec.name);
  const auto near = nearest(name, names);
  return fail(Reason::invalid_argument,
              name.empty() ? "a parameter without a name"
                           : fmt::format("{} has no parameter {:?}", drive.model->model, name.substr(0, 64)),
              near.empty() ? "ListParameters names all" : fmt::format("did you mean {}?", near));
}

/// Looks up names that must differ from each other.
class Lookup {
 public:
  explicit Lookup(const KnownDrive& drive) : drive_(drive) {}
  Result<const ParameterSpec*> operator()(std::string_view name) {
    auto spec = find_parameter(drive_, name);
    if (spec && !seen_.insert((*spec)->address).second)
      return refuse(drive_, **spec, Reason::invalid_argument, fmt::format("{} is named twice", name),
                    "name each parameter once");
    return spec;
  }

 private:
  const KnownDrive& drive_;
  std::set<std::uint32_t> seen_;
};

Result<void> check_writable(const KnownDrive& drive, const ParameterSpec& spec) {
  if (!spec.instead.empty())
    return refuse(drive, spec, Reason::invalid_argument, fmt::format("{} triggers an action", spec.name),
                  fmt::format("use {}", spec.instead));
  if (spec.access == Access::ro || spec.access == Access::wo)
    return refuse(drive, spec, Reason::invalid_argument,
                  fmt::format("{} is {}", spec.name, spec.access == Access::ro ? "read-only" : "a trigger"),
                  "ListParameters tells which can be written");
  return {};
}

Result<void> check_range(const KnownDrive& drive, const ParameterSpec& spec, std::int64_t value) {
  if (value >= spec.minimum && value <= spec.maximum) return {};
  return fail({.reason = Reason::out_of_range,
               .message = fmt::format("{} = {} is out of range", spec.name, value),
               .remedy = "give a value in the permitted range",
               .where = {.bus = drive.axis->bus, .node = drive.axis->node, .object = spec.address},
               .permitted = Range{double(spec.minimum), double(spec.maximum), std::string(spec.unit)}});
}

Result<Duration> verify_time(bool present, const google::protobuf::Duration& from) {
  if (!present) return Duration::zero();
  const auto time = from_proto(from);
  if (!time)
    return fail(Reason::invalid_argument, "verify is not a valid duration",
                "seconds and nanos must have the same sign and |nanos| be below 10^9");
  if (*time < 0s || *time > longest_verify)
    return fail({.reason = Reason::out_of_range,
                 .message = "verify is out of range",
                 .remedy = "give a duration in the permitted range, or none",
                 .permitted = Range{0, 600, "s"}});
  return *time;
}

/// What positions and velocities have in common.
template <class Row>
class RowCheck {
 public:
  RowCheck(const DriveDescriptor& model, std::string_view kind) : model_(model), kind_(kind) {}

  [[nodiscard]] Result<void> operator()(const Row& row) {
    const auto name = fmt::format("{} segment {}", kind_, row.number());
    const auto most = static_cast<std::uint32_t>(model_.capabilities.maximum_segments);
    if (row.number() < 1 || row.number() > most)
      return fail({.reason = Reason::out_of_range,
                   .message = name + ": there is no such segment",
                   .remedy = fmt::format("the inputs of {} can select 1 to {}", model_.model, most),
                   .permitted = Range{1, double(most), ""}});
    if (!seen_.insert(row.number()).second)
      return fail(Reason::invalid_argument, name + " is given twice", "give each number once");
    if (!std::isfinite(row.velocity()) || row.velocity() <= 0)
      return fail(Reason::invalid_argument, name + ": velocity is not a number above 0",
                  "give a positive velocity; the sign of the target or pv_direction gives the direction");
    if constexpr (requires { row.target(); })
      if (!std::isfinite(row.target()))
        return fail(Reason::invalid_argument, name + ": target is not a finite number",
                    "give a finite number");
    return {};
  }

 private:
  const DriveDescriptor& model_;
  const std::string_view kind_;
  std::set<std::uint32_t> seen_;
};

/// The acceleration times by number: one register pair holds that of both tables.
class Times {
 public:
  explicit Times(const DriveDescriptor& model) : model_(model) {}

  template <class Row>
  Result<void> take(const Row& row) {
    if (!row.has_acceleration_time()) return {};
    const auto time = from_proto(row.acceleration_time());
    if (!time)
      return fail(Reason::invalid_argument,
                  fmt::format("segment {}: acceleration_time is not a valid duration", row.number()),
                  "seconds and nanos must have the same sign and |nanos| be below 10^9");
    const Duration least = std::chrono::milliseconds(model_.capabilities.minimum_segment_time_ms);
    if (*time < least || *time > longest_segment_time)
      return fail({.reason = Reason::out_of_range,
                   .message = fmt::format("segment {}: acceleration_time is out of range", row.number()),
                   .remedy = "give a duration in the permitted range",
                   .permitted = Range{in_milliseconds(least), in_milliseconds(longest_segment_time), "ms"}});
    const auto [known, added] = times_.emplace(row.number(), *time);
    if (added || known->second == *time) return {};
    return fail(
        Reason::invalid_argument,
        fmt::format("segment {}: position and velocity have different acceleration times", row.number()),
        "the drive has one for both: give the same, or only one");
  }
  [[nodiscard]] Duration of(std::uint32_t number) const {
    const auto known = times_.find(number);
    return known == times_.end() ? default_segment_time : known->second;
  }

 private:
  const DriveDescriptor& model_;
  std::map<std::uint32_t, Duration> times_;
};

}  // namespace

Result<KnownDrive> find_drive(const Machine& machine, const std::string& axis) {
  auto snapshot = find_axis(machine, axis);
  if (!snapshot) return fail(std::move(snapshot).error());
  const auto* own = (*snapshot)->own_descriptor.get();
  const auto* model = own != nullptr ? own : find_drive_model((*snapshot)->model);
  if (model == nullptr)
    return fail(Reason::internal, fmt::format("{}: no data about model {}", axis, (*snapshot)->model),
                "report this");
  return KnownDrive{.axis = *std::move(snapshot), .model = model};
}

Result<std::vector<std::uint32_t>> parameters_to_read(const v1::ReadParametersRequest& from,
                                                      const KnownDrive& drive) {
  std::vector<std::uint32_t> addresses;
  if (from.names().empty())
    for (const auto& spec : drive.model->parameters)
      if (spec.access != Access::wo) addresses.push_back(spec.address);
  Lookup find(drive);
  for (const auto& name : from.names()) {
    const auto spec = find(name);
    if (!spec) return fail(spec.error());
    if ((*spec)->access == Access::wo)
      return refuse(drive, **spec, Reason::invalid_argument,
                    fmt::format("{} is write-only: the drive does not tell it", name),
                    "ListParameters tells which can be read");
    addresses.push_back((*spec)->address);
  }
  return addresses;
}

Result<std::vector<ParameterValue>> parameters_to_write(const v1::WriteParametersRequest& from,
                                                        const KnownDrive& drive) {
  if (from.values().empty())
    return fail(Reason::invalid_argument, "no values to write", "give at least one name and value");
  std::vector<ParameterValue> values;
  Lookup find(drive);
  for (const auto& value : from.values()) {
    const auto spec = find(value.name());
    if (!spec) return fail(spec.error());
    if (auto writable = check_writable(drive, **spec); !writable) return fail(std::move(writable).error());
    if (auto inside = check_range(drive, **spec, value.value()); !inside)
      return fail(std::move(inside).error());
    values.push_back({.address = (*spec)->address, .value = value.value()});
  }
  return values;
}

Result<void> check_confirmed(std::string_view axis, std::string_view confirm) {
  if (confirm == axis) return {};
  return fail(Reason::invalid_argument,
              confirm.empty() ? "confirm is missing"
                              : fmt::format("confirm is {:?}, not the axis's name", confirm.substr(0, 64)),
              fmt::format("repeat the axis's name in confirm: {}", axis));
}

Result<SegmentSettings> segments_to_write(const v1::SegmentTable& from, const KnownDrive& drive) {
  const auto& model = *drive.model;
  if (model.capabilities.maximum_segments == 0)
    return fail(Reason::not_supported, fmt::format("{} has no table of segments", model.model),
                "give each motion as a command");
  RowCheck<v1::PositionSegment> check_position(model, "position");
  RowCheck<v1::VelocitySegment> check_velocity(model, "velocity");
  Times times(model);
  for (const auto& row : from.positions()) {
    if (auto valid = check_position(row); !valid) return fail(std::move(valid).error());
    if (auto valid = times.take(row); !valid) return fail(std::move(valid).error());
  }
  for (const auto& row : from.velocities()) {
    if (auto valid = check_velocity(row); !valid) return fail(std::move(valid).error());
    if (auto valid = times.take(row); !valid) return fail(std::move(valid).error());
  }
  SegmentSettings settings{.absolute = from.absolute()};
  for (const auto& row : from.positions())
    settings.positions.push_back({.number = static_cast<int>(row.number()),
                                  .target = row.target(),
                                  .velocity = row.velocity(),
                                  .acceleration_time = times.of(row.number())});
  for (const auto& row : from.velocities())
    settings.velocities.push_back({.number = static_cast<int>(row.number()),
                                   .velocity = row.velocity(),
                                   .acceleration_time = times.of(row.number())});
  return settings;
}

Result<SerialChange> serial_change(const v1::ReaddressRequest& from, const KnownDrive& drive) {
  const auto& model = *drive.model;
  if (auto confirmed = check_confirmed(from.axis(), from.confirm()); !confirmed)
    return fail(std::move(confirmed).error());
  if (from.node() < model.minimum_node || from.node() > model.maximum_node)
    return fail({.reason = Reason::out_of_range,
                 .message = fmt::format("{} is no address for a {}", from.node(), model.model),
                 .remedy = "give a node in the permitted range; 0 would address all",
                 .permitted = Range{double(model.minimum_node), double(model.maximum_node), ""}});
  const auto verify = verify_time(from.has_verify(), from.verify());
  if (!verify) return fail(verify.error());
  return SerialChange{
      .node = static_cast<std::uint8_t>(from.node()), .baud = {}, .format = {}, .verify = *verify};
}

Result<SerialChange> serial_change(const v1::SetSerialRequest& from, const KnownDrive& drive) {
  const auto& model = *drive.model;
  if (auto confirmed = check_confirmed(from.axis(), from.confirm()); !confirmed)
    return fail(std::move(confirmed).error());
  SerialChange change;
  if (model.bus == BusKind::canopen && !from.format().empty())
    return fail(Reason::not_supported, "a drive on a CAN network has no serial format", "leave format out");
  if (!from.has_baud() && from.format().empty())
    return fail(Reason::invalid_argument, "neither baud nor format is given", "give what is to be changed");
  if (from.has_baud()) {
    if (std::ranges::find(model.bauds, static_cast<std::int64_t>(from.baud())) == model.bauds.end())
      return fail(Reason::invalid_argument, fmt::format("{} cannot do {} bit/s", model.model, from.baud()),
                  fmt::format("permitted: {}", fmt::join(model.bauds, ", ")));
    change.baud = static_cast<int>(from.baud());
  }
  if (!from.format().empty()) {
    const auto format = parse_format(from.format());
    if (!format) return fail(format.error());
    change.format = *format;
  }
  const auto verify = verify_time(from.has_verify(), from.verify());
  if (!verify) return fail(verify.error());
  change.verify = *verify;
  return change;
}

}  // namespace axisd::server
