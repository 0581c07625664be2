#pragma once

#include <boost/smart_ptr/shared_ptr.hpp>
#include <map>
#include <string>
#include <string_view>
#include <vector>

#include "devices/axis/axis_face.hpp"
#include "devices/generic/device.hpp"
#include "devices/group/group.hpp"

namespace axisd::core {

/// What a machine consists of, as every thread may see it. Immutable: a reload publishes another one, and
/// whoever still holds this one finds what it names at rest, not destroyed.
struct MachineTable {
  std::vector<std::string> axes;  ///< in the order of the file
  std::map<std::string, AxisFacePtr, std::less<>> faces{};
  std::vector<DeviceFacePtr> devices{};
  std::vector<GroupSettings> groups{};

  /// nullptr: there is none.
  [[nodiscard]] AxisFace* find(std::string_view axis) const {
    const auto found = faces.find(axis);
    return found == faces.end() ? nullptr : found->second.get();
  }
};
/// boost's pointer: libstdc++ 12's atomic shared_ptr is a data race to ThreadSanitizer.
using MachineTablePtr = boost::shared_ptr<const MachineTable>;

}  // namespace axisd::core
