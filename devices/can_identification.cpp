#include "devices/can_identification.hpp"

#include <algorithm>

namespace axisd {

const DriveDescriptor* find_can_model(const canopen::Identity& identity) {
  const auto fits = [&](const DriveDescriptor* model) {
    const auto& expected = model->can_identification;
    return expected && identity.vendor == expected->vendor && identity.product == expected->product &&
           identity.profile() == expected->profile();
  };
  const auto found = std::ranges::find_if(drive_models(), fits);
  return found == drive_models().end() ? nullptr : *found;
}

}  // namespace axisd
