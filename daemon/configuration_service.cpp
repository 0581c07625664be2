#include "daemon/configuration_service.hpp"

#include <fmt/format.h>

#include <utility>

#include "config/configuration.hpp"
#include "daemon/store/line_text.hpp"

namespace axisd {

namespace {

std::string revision_of(std::string_view yaml) {
  return fmt::format("{:08x}-{}", store::crc32(yaml), yaml.size());
}

}  // namespace

ConfigurationService::ConfigurationService(std::string path, const std::string& yaml, WallTime since)
    : served_{.yaml = yaml, .path = std::move(path), .revision = revision_of(yaml), .served_since = since} {}

ConfigurationCheck ConfigurationService::check(std::string_view yaml) const {
  ConfigurationCheck result{.revision = revision_of(yaml)};
  for (auto& found : config::load_text(yaml, served_.path).diagnostics)
    result.findings.push_back({.line = static_cast<std::uint32_t>(found.line),
                               .column = static_cast<std::uint32_t>(found.column),
                               .message = std::move(found.message),
                               .suggestion = std::move(found.suggestion)});
  return result;
}

}  // namespace axisd
