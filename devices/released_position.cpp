#include "devices/released_position.hpp"

#include <algorithm>

namespace axisd {

bool counts_released(const DriveDescriptor& drive, const std::map<std::string, SettingValue>& settings) {
  const auto& key = released_position_setting.key;
  if (std::ranges::find(drive.settings, key, &SettingSpec::key) == drive.settings.end()) return true;
  const auto found = settings.find(std::string(key));
  return found != settings.end() && found->second == SettingValue(std::string("counted"));
}

}  // namespace axisd
