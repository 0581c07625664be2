// The drive's own segment table between user units and drive units. Pure.
#pragma once

#include "buses/error.hpp"
#include "devices/axis/settings.hpp"
#include "devices/descriptor.hpp"
#include "devices/drive.hpp"
#include "devices/units/scale.hpp"

namespace axisd {

/// Absolute targets count from the drive's own zero, which homing puts at `homing.position`; a position that
/// SetPosition declared is the daemon's alone and does not move them. Errors: out_of_range with the permitted
/// range (number, speed, time, distance), invalid_argument (a number twice, different times of position and
/// velocity segment).
Result<DriveSegments> to_drive(const SegmentSettings& segments, const AxisSettings& axis, const Scale& scale,
                               const DriveDescriptor& descriptor);
/// Rows without a speed are left out.
SegmentSettings from_drive(const DriveSegments& segments, const AxisSettings& axis, const Scale& scale);

}  // namespace axisd
