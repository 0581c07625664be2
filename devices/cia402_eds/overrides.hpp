// What the configuration says of a drive's objects in place of its data sheet: drive: { objects: ... }.
#pragma once

#include <map>
#include <optional>
#include <string>
#include <vector>

#include "buses/canopen/eds.hpp"
#include "devices/descriptor.hpp"

namespace axisd::cia402_eds {

struct Override {
  bool absent = false;  ///< the drive does not have it, whatever the file says
  std::optional<canopen::DataType> type{};
  std::optional<canopen::Access> access{};
  std::optional<std::int64_t> low{}, high{}, value{};
  std::optional<bool> mappable{};
  /// Whether it says what a flaw of the file leaves open.
  [[nodiscard]] bool has(canopen::EdsPart part) const;
};
using Overrides = std::map<canopen::Object, Override>;

/// Of the settings "objects.6084h:00.access" and so on, which the configuration has checked one by one.
Overrides overrides_of(const std::map<std::string, SettingValue>& settings);

/// Changes the objects. Returns what cannot be so, one text each: an object that the file does not have and
/// that gets no type or no access, a value that the type cannot hold, a minimum above the maximum.
std::vector<std::string> apply_overrides(const Overrides& overrides, canopen::Eds& eds);

}  // namespace axisd::cia402_eds
