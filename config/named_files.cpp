#include "config/named_files.hpp"

#include <fmt/format.h>

#include <array>
#include <filesystem>
#include <functional>
#include <string_view>
#include <utility>
#include <variant>

#include "config/clients_text.hpp"
#include "config/text.hpp"
#include "devices/descriptor.hpp"

namespace axisd::config {
namespace {

namespace fs = std::filesystem;

fs::path full(const fs::path& path) { return fs::absolute(path).lexically_normal(); }

/// With its key, and its path as it is opened.
void each_file(const Configuration& configuration,
               const std::function<void(const std::string& key, const fs::path& path)>& visit) {
  for (const auto& [axis, simulation] : configuration.axes) {
    const auto* model = find_drive_model(axis.model);
    if (model == nullptr) continue;
    for (const auto& setting : model->settings) {
      const auto given = axis.model_settings.find(std::string(setting.key));
      if (setting.kind != "path" || given == axis.model_settings.end()) continue;
      visit(fmt::format("axes.{}.drive.{}", axis.name, setting.key), std::get<std::string>(given->second));
    }
  }
  if (!configuration.server.tls) return;
  const auto& tls = *configuration.server.tls;
  const std::array<std::pair<std::string_view, std::string_view>, 4> files{
      {{"certificate", tls.certificate}, {"key", tls.key}, {"client_ca", tls.client_ca}, {"crl", tls.crl}}};
  for (const auto& [key, path] : files)
    if (!path.empty()) visit(fmt::format("server.tls.{}", key), path);
}

}  // namespace

std::set<std::string> named_files(const Configuration& configuration) {
  std::set<std::string> files;
  each_file(configuration, [&](const auto&, const fs::path& path) { files.insert(full(path).string()); });
  return files;
}

void check_named_files(const Configuration& configuration, const std::set<std::string>& others,
                       Diagnostics& diagnostics, Places& places) {
  const auto folder = full(diagnostics.file()).parent_path();
  each_file(configuration, [&](const std::string& key, const fs::path& path) {
    const auto file = full(path);
    const auto below = file.lexically_relative(folder);
    if (others.contains(file.string()) || (!below.empty() && *below.begin() != "..")) return;
    diagnostics.add(places.mark(key),
                    fmt::format("{} is not below {}, the folder of the file that is served",
                                printable(path.string(), 200), printable(folder.string(), 200)),
                    "put it there, or check the configuration on that computer: axisctl check");
    places.mark_bad(key);
  });
}

}  // namespace axisd::config
