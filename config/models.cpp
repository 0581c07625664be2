#include "config/models.hpp"

#include "devices/descriptor.hpp"

namespace axisd::config {

bool is_described_by_file(std::string_view model) {
  const auto* found = find_drive_model(model);
  return found != nullptr && found->specialise != nullptr;
}

}  // namespace axisd::config
