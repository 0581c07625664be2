#include "devices/axis/drive_operations.hpp"

#include <fmt/format.h>
#include <spdlog/spdlog.h>

#include <algorithm>

#include "devices/axis/segments.hpp"

namespace axisd {

Error DriveOperations::error(Reason reason, std::string message, std::string remedy) const {
  const auto& settings = axis_->settings();
  return {.reason = reason,
          .message = fmt::format("{}: {}", settings.name, message),
          .remedy = std::move(remedy),
          .where = {.bus = settings.bus, .node = settings.node}};
}

/// The one place that says what a model lacks.
template <class Facet>
Result<Facet*> DriveOperations::needed(Facet* facet, std::string_view what, std::string remedy) const {
  if (facet != nullptr) return facet;
  const auto& settings = axis_->settings();
  return fail(Error{.reason = Reason::not_supported,
                    .message = fmt::format("{} has no {}", axis_->descriptor().model, what),
                    .remedy = std::move(remedy),
                    .where = {.bus = settings.bus, .node = settings.node}});
}

Result<ParametersFacet*> DriveOperations::parameters() const {
  return needed(axis_->drive().facets().parameters, "parameters", "see the drive's manual");
}

Result<SegmentsFacet*> DriveOperations::segments_facet() const {
  return needed(axis_->drive().facets().segments, "table of segments", "give each motion as a command");
}

Result<MemoryFacet*> DriveOperations::memory() const {
  return needed(axis_->drive().facets().memory, "memory that can be saved or restored over the bus",
                "see the drive's manual");
}

const ParameterSpec* DriveOperations::find(std::uint32_t address) const {
  return find_parameter(axis_->descriptor().parameters, address);
}

DriveInfo DriveOperations::info() const {
  DriveInfo info{.descriptor = &axis_->descriptor(),
                 .identity = axis_->identity(),
                 .eeprom_writes = axis_->eeprom_writes(),
                 .persist = axis_->settings().persist.any()};
  const auto* facet = axis_->drive().facets().parameters;
  if (facet == nullptr) return info;
  for (const auto& parameter : info.descriptor->parameters)
    if (auto owner = facet->configured_by(parameter.address); !owner.empty())
      info.configured_by.emplace(parameter.address, std::move(owner));
  return info;
}

Task<Result<std::vector<ParameterValue>>> DriveOperations::read_parameters(
    std::vector<std::uint32_t> addresses) const {
  for (const auto address : addresses) {
    const auto* parameter = find(address);
    if (parameter == nullptr || parameter->access == Access::wo)
      co_return fail(
          error(Reason::invalid_argument,
                fmt::format("parameter {} cannot be read",
                            parameter == nullptr ? object_text(address) : std::string(parameter->name)),
                "list them: axisctl drive parameters"));
  }
  const auto facet = parameters();
  if (!facet) co_return fail(facet.error());
  if (auto online = axis_->check_online(); !online) co_return fail(online.error());
  co_return co_await (*facet)->read_parameters(std::move(addresses));
}

Result<void> DriveOperations::check_write(const ParameterValue& value) const {
  const auto* parameter = find(value.address);
  const auto named = [&](std::string_view what, std::string remedy,
                         Reason reason = Reason::invalid_argument) {
    auto refusal = error(reason, fmt::format("{} {}", parameter->name, what), std::move(remedy));
    refusal.where.object = value.address;
    return fail(std::move(refusal));
  };
  if (parameter == nullptr)
    return fail(error(Reason::invalid_argument,
                      fmt::format("there is no parameter {}", object_text(value.address)),
                      "list them: axisctl drive parameters"));
  if (parameter->access == Access::ro) return named("is read-only", "leave it out");
  if (parameter->access == Access::wo)
    return named("triggers an action and is no parameter", fmt::format("use {}", parameter->instead));
  if (value.value < parameter->minimum || value.value > parameter->maximum) {
    auto refusal = named(fmt::format("= {} is out of range", value.value),
                         fmt::format("permitted: {} to {}", parameter->minimum, parameter->maximum),
                         Reason::out_of_range);
    refusal.error().permitted = Range{.minimum = static_cast<double>(parameter->minimum),
                                      .maximum = static_cast<double>(parameter->maximum),
                                      .unit = std::string(parameter->unit)};
    return refusal;
  }
  const auto facet = parameters();
  if (!facet) return fail(facet.error());
  if (const auto owner = (*facet)->configured_by(value.address); !owner.empty())
    return named(fmt::format("is decided by {}", owner), "change it there");
  return {};
}

Task<Result<std::vector<ParameterValue>>> DriveOperations::write_parameters(
    std::vector<ParameterValue> values, std::vector<ParameterValue>* before) const {
  for (const auto& value : values)
    if (auto allowed = check_write(value); !allowed) co_return fail(allowed.error());
  const auto facet = parameters();
  if (!facet) co_return fail(facet.error());
  const auto maintenance = axis_->begin_maintenance();
  if (!maintenance) co_return fail(maintenance.error());
  if (before != nullptr) {
    std::vector<std::uint32_t> addresses;
    for (const auto& value : values) addresses.push_back(value.address);
    auto read = co_await (*facet)->read_parameters(std::move(addresses));
    if (!read) co_return fail(read.error());
    *before = *std::move(read);
  }
  co_return co_await (*facet)->write_parameters(std::move(values));
}

Task<Result<SegmentSettings>> DriveOperations::read_segments() const {
  if (auto online = axis_->check_online(); !online) co_return fail(online.error());
  const auto facet = segments_facet();
  if (!facet) co_return fail(facet.error());
  const auto segments = co_await (*facet)->read_segments();
  if (!segments) co_return fail(segments.error());
  co_return from_drive(*segments, axis_->settings(), axis_->scale());
}

Task<Result<SegmentSettings>> DriveOperations::write_segments(SegmentSettings segments) const {
  if (axis_->descriptor().capabilities.maximum_segments == 0)
    co_return fail(
        error(Reason::not_supported, "the drive has no table of segments", "give each motion as a command"));
  if (axis_->settings().segments)
    co_return fail(error(Reason::invalid_argument, "the segments are decided by the configuration",
                         "change them there"));
  const auto facet = segments_facet();
  if (!facet) co_return fail(facet.error());
  const auto table = to_drive(segments, axis_->settings(), axis_->scale(), axis_->descriptor());
  if (!table) co_return fail(table.error());
  const auto maintenance = axis_->begin_maintenance();
  if (!maintenance) co_return fail(maintenance.error());
  if (segments.absolute && !axis_->position_is_from_home())
    co_return fail(error(Reason::not_trusted,
                         "absolute segments count from home, but the position was declared elsewhere",
                         "home the axis first"));
  axis_->set_absolute_segments(segments.absolute);
  const auto written = co_await (*facet)->write_segments(*table);
  if (!written) co_return fail(written.error());
  co_return co_await read_segments();
}

Task<Result<void>> DriveOperations::save_parameters() const {
  const auto facet = memory();
  if (!facet) co_return fail(facet.error());
  const auto maintenance = axis_->begin_maintenance();
  if (!maintenance) co_return fail(maintenance.error());
  const auto saved = co_await (*facet)->save_parameters();
  const bool unknown = !saved && saved.error().outcome == Outcome::unknown;
  if (unknown && !axis_->drive().continuity_mark())
    axis_->reconfigure("whether the drive was restarted as it saved is not known", true);
  axis_->memory_marked();
  co_return saved;
}

Task<Result<std::string>> DriveOperations::restore_factory(std::vector<std::uint8_t> taken) const {
  const auto facet = memory();
  if (!facet) co_return fail(facet.error());
  auto maintenance = axis_->begin_maintenance();
  if (!maintenance) co_return fail(maintenance.error());
  auto restored = co_await (*facet)->restore_factory(std::move(taken));
  // Without a reply it may have been restored all the same.
  if (restored || restored.error().outcome == Outcome::unknown)
    axis_->reconfigure("the factory settings were restored", true);
  co_return restored;
}

Task<Result<std::string>> DriveOperations::change_serial(SerialChange change,
                                                         std::vector<std::uint8_t> taken) const {
  if (change.node && std::ranges::find(taken, *change.node) != taken.end())
    co_return fail(error(Reason::invalid_argument,
                         fmt::format("address {} belongs to another node of this bus", *change.node),
                         "choose a free one: axisctl bus scan"));
  const auto facet =
      needed(axis_->drive().facets().serial, "address that is set over the bus", "use the drive's switches");
  if (!facet) co_return fail(facet.error());
  const auto maintenance = axis_->begin_maintenance();
  if (!maintenance) co_return fail(maintenance.error());
  co_return co_await (*facet)->change_serial(change);
}

}  // namespace axisd
