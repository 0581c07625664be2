#pragma once

#include <string>

#include "devices/configuration_access.hpp"

namespace axisd {

/// The file that the daemon was started with, and the loader that judges others like it. Thread: any.
class ConfigurationService final : public ConfigurationAccess {
 public:
  ConfigurationService(std::string path, const std::string& yaml, WallTime since);
  [[nodiscard]] const ServedConfiguration& served() const override { return served_; }
  [[nodiscard]] ConfigurationCheck check(std::string_view yaml) const override;

 private:
  const ServedConfiguration served_;
};

}  // namespace axisd
