#include "devices/can_identification.hpp"

#include <algorithm>

namespace axisd {

const DriveDescriptor* find_can_model(const canopen::Identity& identity) {
  const auto fits = [&](const DriveDescriptor* model) {
    const auto& expected = model->can_identification;
    return expected && identity.vendor == expected->vendor && identity.product == expected->product &&
           identity.profile() == expected->profile();
  };
  constexpr std::uint16_t drive_profile = 402;
  const auto described = [](const DriveDescriptor* model) {
    return model->bus == BusKind::canopen && model->specialise != nullptr;
  };
  auto found = std::ranges::find_if(drive_models(), fits);
  if (found == drive_models().end() && identity.profile() == drive_profile)
    found = std::ranges::find_if(drive_models(), described);
  return found == drive_models().end() ? nullptr : *found;
}

}  // namespace axisd
