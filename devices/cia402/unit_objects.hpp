// What a CiA 402 drive's own objects say of its units, and whether that is what an axis was planned with.
// Pure.
#pragma once

#include <cstdint>
#include <map>
#include <optional>
#include <span>
#include <string>
#include <string_view>

#include "buses/canopen/object.hpp"
#include "devices/cia402/units.hpp"

namespace axisd::cia402 {

/// Values of objects by Object::key(), with their signs.
using Values = std::map<std::uint32_t, std::int64_t>;

/// What a drive's own objects say of a unit.
struct UnitTold {
  enum class Kind : std::uint8_t {
    nothing,
    unit,
    unclear,  ///< something that is no unit of a rotation, or is scaled once more
  };
  Kind kind = Kind::nothing;
  Rate unit{};
  canopen::Object object{};  ///< that says it, or leaves it unclear
  std::string what{};        ///< "60A9h:00 is 00B44700h"
};
/// SI unit (60A9h; CiA 402-2, unit codes of CiA 303-2), else notation and dimension index (608Bh, 608Ch).
/// With a factor (6093h to 6096h) other than 1:1 it is unclear.
UnitTold told_velocity(const Values& values);
/// 60AAh, else 608Dh and 608Eh; with the factor 6097h.
UnitTold told_acceleration(const Values& values);

/// Counts of 6064h for one revolution of the shaft, as a ratio.
struct RevolutionTold {
  std::int64_t counts = 0, revolutions = 1;
  canopen::Object object{};
  std::string what{};
  [[nodiscard]] bool fits(std::int64_t pulses_per_revolution) const;
};
/// By the unit of positions (60A8h), else the feed (6092h), else encoder (608Fh) and gear (6091h). Nothing:
/// they say nothing, or are as templates have them (1 for 1), or a factor (6093h) scales positions.
std::optional<RevolutionTold> told_revolution(const Values& values);

/// The drive does not count, or brake, as the axis was planned.
struct PlanConflict {
  canopen::Object object;
  std::string message, remedy;
};
/// The first contradiction between what was planned and what objects hold. `pulses_per_revolution`: nothing
/// leaves positions out.
std::optional<PlanConflict> find_conflict(const Units& planned,
                                          std::optional<std::int64_t> pulses_per_revolution,
                                          const Values& values);

/// The objects that these functions look at.
std::span<const canopen::Object> unit_objects();
/// The key of the configuration that has to agree with one of them.
std::string_view key_of(canopen::Object object);
/// "60A9h: { access: none }": what takes the object out of the drive's data sheet.
std::string without(canopen::Object object);

}  // namespace axisd::cia402
