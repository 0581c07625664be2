// What the velocities and ramps of a drive count, by its configuration and its data sheet.
#pragma once

#include <map>
#include <optional>
#include <string>
#include <vector>

#include "buses/canopen/eds.hpp"
#include "devices/cia402/unit_objects.hpp"
#include "devices/descriptor.hpp"

namespace axisd::cia402_eds {

/// `velocity_unit` and `acceleration_unit`, else what the values of the file's unit objects say. Errors
/// (invalid_argument): nothing tells the unit of velocities, that of ramps is unclear, or a key contradicts
/// what the drive cannot change.
Result<cia402::Units> plan_units(const canopen::Eds& eds,
                                 const std::map<std::string, SettingValue>& settings);

/// Where a key says otherwise than the file's values of what the drive can change: the drive may have been
/// set so, or is refused at bring-up.
std::optional<cia402::PlanConflict> doubtful_units(const canopen::Eds& eds, const cia402::Units& planned);

/// The unit objects that the drive has and that can be read.
std::vector<canopen::Object> unit_objects_of(const canopen::Eds& eds);

}  // namespace axisd::cia402_eds
