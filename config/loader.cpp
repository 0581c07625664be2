#include <fcntl.h>
#include <fmt/format.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <exception>
#include <expected>
#include <map>
#include <memory>
#include <set>
#include <system_error>
#include <utility>
#include <variant>

#include "buses/canopen/eds.hpp"
#include "buses/clock.hpp"
#include "config/checks.hpp"
#include "config/clients_text.hpp"
#include "config/configuration.hpp"
#include "config/document.hpp"
#include "config/named_files.hpp"
#include "config/reader.hpp"
#include "config/text.hpp"
#include "devices/descriptor.hpp"

namespace axisd::config {

namespace {

/// At most one byte more than is accepted: the file may be endless.
std::expected<std::string, std::error_code> read_file(const std::string& path) {
  const auto failed = [] { return std::unexpected(std::error_code(errno, std::generic_category())); };
  const int file = ::open(path.c_str(), O_RDONLY | O_CLOEXEC);
  if (file < 0) return failed();
  std::string text(largest_text + 1, '\0');
  std::size_t size = 0;
  while (size < text.size()) {
    const auto count = ::read(file, text.data() + size, text.size() - size);
    if (count < 0 && errno == EINTR) continue;
    if (count < 0) {
      const auto error = failed();
      ::close(file);
      return error;
    }
    if (count == 0) break;
    size += static_cast<std::size_t>(count);
  }
  ::close(file);
  text.resize(size);
  return text;
}

/// One line about a file that the configuration names.
constexpr std::size_t longest_problem = 600;

/// Data sheets that simulated drives are made of: whoever makes the drives must not wait for files.
void read_sheets(Configuration& configuration, Diagnostics& diagnostics) {
  std::map<std::string, std::shared_ptr<const canopen::Eds>> sheets;
  for (auto& [axis, simulation] : configuration.axes) {
    const auto bus = std::ranges::find(configuration.networks, axis.bus, &canopen::NetworkSettings::name);
    if (axis.own_descriptor == nullptr || bus == configuration.networks.end() || !bus->simulated()) continue;
    const auto file = std::ranges::find(axis.own_descriptor->settings, "path", &SettingSpec::kind);
    if (file == axis.own_descriptor->settings.end()) continue;
    const auto& path = std::get<std::string>(axis.model_settings.at(std::string(file->key)));
    auto& sheet = sheets[path];
    if (!sheet) {
      auto read = canopen::load_eds(path);
      if (!read) {  // it could be read a moment ago
        diagnostics.add(Mark{}, printable(read.error().message, longest_problem), read.error().remedy);
        return;
      }
      sheet = std::make_shared<const canopen::Eds>(std::move(*read));
    }
    simulation.sheet = sheet;
  }
}

/// `others`: the text is a client's, see load_clients_text().
LoadResult load(std::string_view text, const std::string& file_name, const TlsCheck& check_tls,
                Duration longest, const std::set<std::string>* others) try {
  Diagnostics diagnostics(file_name);
  const auto document = parse_document(text);
  if (!document) {
    diagnostics.add(document.error().mark, document.error().message, document.error().suggestion);
    return {{}, diagnostics.sorted()};
  }
  Configuration configuration;
  Places places;
  Reader(configuration, diagnostics, places).read(**document);
  if (others != nullptr) check_named_files(configuration, *others, diagnostics, places);
  // Each may name a file of its own that takes its time.
  const auto begun = monotonic_now();
  for (auto& entry : configuration.axes) {
    complete_axis(entry, diagnostics, places);
    if (monotonic_now() - begun <= longest) continue;
    diagnostics.add(Mark{}, fmt::format("checking {} axes takes too long", configuration.axes.size()),
                    "use smaller files in drive: { eds: ... }, or fewer axes");
    break;
  }
  check_devices(configuration, diagnostics, places);
  check_machine(configuration, diagnostics, places);
  if (check_tls) check_tls_files(configuration, check_tls, diagnostics, places);
  if (diagnostics.empty()) read_sheets(configuration, diagnostics);
  if (!diagnostics.empty()) return {{}, diagnostics.sorted()};
  check_budgets(configuration, diagnostics, places);
  if (!diagnostics.empty())
    return {.diagnostics = diagnostics.sorted(), .over_budget = std::move(configuration)};
  return {std::move(configuration), {}};
} catch (const std::exception& error) {  // out of memory
  return {{}, {{file_name, 0, 0, fmt::format("cannot be loaded: {}", printable(error.what())), ""}}};
}

}  // namespace

LoadResult load_text(std::string_view text, const std::string& file_name, const TlsCheck& check_tls,
                     Duration longest) {
  return load(text, file_name, check_tls, longest, nullptr);
}

LoadResult load_clients_text(std::string_view text, const std::string& file_name,
                             const std::set<std::string>& others, const TlsCheck& check_tls,
                             Duration longest) {
  return load(text, file_name, check_tls, longest, &others);
}

LoadResult load_file(const std::string& path, const std::string& original, const TlsCheck& check_tls) try {
  const auto text = read_file(path);
  if (!text) {
    return {{},
            {{path, 0, 0, fmt::format("cannot be read: {}", text.error().message()),
              "check path and permissions"}}};
  }
  auto result = load_text(*text, original.empty() ? path : original, check_tls);
  result.text = *text;
  return result;
} catch (const std::exception& error) {
  return {{}, {{path, 0, 0, fmt::format("cannot be read: {}", printable(error.what())), ""}}};
}

}  // namespace axisd::config
