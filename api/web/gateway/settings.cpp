#include "api/web/gateway/settings.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <charconv>
#include <fstream>
#include <iterator>
#include <set>
#include <span>

#include "config/document.hpp"
#include "config/quantity.hpp"
#include "config/text.hpp"

namespace axisd::web {
namespace {

using config::Diagnostics;
using config::Mark;
using config::Node;

struct Key {
  std::string_view path;
  std::string* (*text)(Settings&) = nullptr;
  int* (*number)(Settings&) = nullptr;
  Duration* (*duration)(Settings&) = nullptr;
  std::int64_t minimum = 0, maximum = 0;  ///< of a number; of a duration in ms
};

TlsSettings& tls_of(Settings& settings) { return settings.tls ? *settings.tls : settings.tls.emplace(); }

constexpr std::int64_t day = std::int64_t{24} * 3600 * 1000;

constexpr Key keys[] = {
    {.path = "listen", .text = [](Settings& s) { return &s.listen; }},
    {.path = "tls.certificate", .text = [](Settings& s) { return &tls_of(s).certificate; }},
    {.path = "tls.key", .text = [](Settings& s) { return &tls_of(s).key; }},
    {.path = "tls.client_ca", .text = [](Settings& s) { return &tls_of(s).client_ca; }},
    {.path = "axisd.server", .text = [](Settings& s) { return &s.axisd.server; }},
    {.path = "axisd.stop_server", .text = [](Settings& s) { return &s.axisd.stop_server; }},
    {.path = "axisd.tls.ca", .text = [](Settings& s) { return &s.axisd.ca; }},
    {.path = "axisd.tls.certificate", .text = [](Settings& s) { return &s.axisd.certificate; }},
    {.path = "axisd.tls.key", .text = [](Settings& s) { return &s.axisd.key; }},
    {.path = "files", .text = [](Settings& s) { return &s.files; }},
    {.path = "users", .text = [](Settings& s) { return &s.users; }},
    {.path = "sessions.idle",
     .duration = [](Settings& s) { return &s.session_idle; },
     .minimum = 1000,
     .maximum = 7 * day},
    {.path = "sessions.longest",
     .duration = [](Settings& s) { return &s.session_longest; },
     .minimum = 1000,
     .maximum = 7 * day},
    {.path = "limits.connections",
     .number = [](Settings& s) { return &s.limits.connections; },
     .minimum = 8,
     .maximum = 4096},
    {.path = "limits.connections_each",
     .number = [](Settings& s) { return &s.limits.connections_each; },
     .minimum = 8,
     .maximum = 4096},
    {.path = "limits.streams",
     .number = [](Settings& s) { return &s.limits.streams; },
     .minimum = 8,
     .maximum = 4096},
    {.path = "limits.streams_each",
     .number = [](Settings& s) { return &s.limits.streams_each; },
     .minimum = 8,
     .maximum = 4096},
    {.path = "limits.lanes",
     .number = [](Settings& s) { return &s.limits.lanes; },
     .minimum = 1,
     .maximum = 4096},
    {.path = "limits.lanes_each",
     .number = [](Settings& s) { return &s.limits.lanes_each; },
     .minimum = 1,
     .maximum = 4096},
    {.path = "limits.body",
     .number = [](Settings& s) { return &s.limits.body; },
     .minimum = 16,
     .maximum = 4096},
    {.path = "limits.log_in",
     .duration = [](Settings& s) { return &s.limits.log_in; },
     .minimum = 1000,
     .maximum = day},
    {.path = "limits.request",
     .duration = [](Settings& s) { return &s.limits.request; },
     .minimum = 1000,
     .maximum = day},
    {.path = "limits.idle",
     .duration = [](Settings& s) { return &s.limits.idle; },
     .minimum = 1000,
     .maximum = day},
    {.path = "limits.stalled",
     .duration = [](Settings& s) { return &s.limits.stalled; },
     .minimum = 1000,
     .maximum = day},
};

class Reader {
 public:
  Reader(Settings& settings, Diagnostics& diagnostics) : settings_(settings), diagnostics_(diagnostics) {}

  /// `path`: of the section, with a point behind it; empty: the whole file.
  void read_section(const Node& section, const std::string& path) {
    if (section.kind == Node::Kind::null && path.empty()) return;
    if (section.kind != Node::Kind::section) {
      diagnostics_.add(section.mark, path.empty() ? "the file is no section" : "this has to be a section",
                       "write keys with their values below it");
      return;
    }
    std::set<std::string_view> seen;
    for (const auto& [key, value] : section.entries) {
      if (!seen.insert(key->text).second)
        diagnostics_.add(key->mark, fmt::format("{} for the second time", config::quoted(key->text)),
                         "once is enough");
      else
        read_entry(*key, *value, path);
    }
  }

 private:
  void read_entry(const Node& name, const Node& value, const std::string& path) {
    const auto full = path + name.text;
    const auto key = std::ranges::find(keys, full, &Key::path);
    if (key != std::end(keys)) return read_value(*key, value);
    if (std::ranges::any_of(keys, [&](const Key& k) { return k.path.starts_with(full + '.'); }))
      return read_section(value, full + '.');
    diagnostics_.add(name.mark, fmt::format("unknown key {}", config::quoted(name.text)),
                     config::suggest(name.text, candidates(path)));
  }

  static std::vector<std::string_view> candidates(const std::string& path) {
    std::vector<std::string_view> names;
    for (const auto& key : keys) {
      if (!key.path.starts_with(path)) continue;
      const auto rest = key.path.substr(path.size());
      const auto word = rest.substr(0, rest.find('.'));
      if (std::ranges::find(names, word) == names.end()) names.push_back(word);
    }
    return names;
  }

  void read_value(const Key& key, const Node& value) {
    if (value.kind != Node::Kind::scalar || value.text.empty()) {
      diagnostics_.add(value.mark, fmt::format("'{}' has to be a single value", key.path), "");
      return;
    }
    if (key.text != nullptr)
      *key.text(settings_) = value.text;
    else if (key.number != nullptr)
      read_number(key, value);
    else
      read_duration(key, value);
  }

  void read_number(const Key& key, const Node& value) {
    int number = 0;
    const auto* end = value.text.data() + value.text.size();
    const auto [read, error] = std::from_chars(value.text.data(), end, number);
    if (error != std::errc() || read != end || number < key.minimum || number > key.maximum)
      diagnostics_.add(value.mark, fmt::format("'{}' cannot be {}", key.path, config::quoted(value.text)),
                       fmt::format("a whole number from {} to {}", key.minimum, key.maximum));
    else
      *key.number(settings_) = number;
  }

  void read_duration(const Key& key, const Node& value) {
    const auto duration = config::parse_duration(value.text);
    const std::chrono::milliseconds least(key.minimum), most(key.maximum);
    if (!duration)
      diagnostics_.add(value.mark, fmt::format("'{}': {}", key.path, duration.error().message),
                       duration.error().suggestion);
    else if (*duration < least || *duration > most)
      diagnostics_.add(
          value.mark, fmt::format("'{}' cannot be {}", key.path, config::quoted(value.text)),
          fmt::format("from {} to {}", config::format_duration(least), config::format_duration(most)));
    else
      *key.duration(settings_) = *duration;
  }

  Settings& settings_;
  Diagnostics& diagnostics_;
};

/// What no single key can tell. `at`: the mark of a key at the top of the file.
void check(const Settings& settings, Diagnostics& diagnostics, const Node& root) {
  const auto mark = [&](std::string_view key) {
    const auto* found = root.find(key);
    return found == nullptr ? Mark{} : found->mark;
  };
  const auto listen = host_and_port(settings.listen);
  if (!listen)
    diagnostics.add(mark("listen"), fmt::format("'listen' cannot be {}", config::quoted(settings.listen)),
                    "write HOST:PORT, for example localhost:7480");
  else if (!settings.tls && !is_loopback(*listen))
    diagnostics.add(mark("listen"), "without TLS only this computer is served",
                    "write tls: { certificate, key }, or listen: localhost:7480");
  if (settings.tls && (settings.tls->certificate.empty() || settings.tls->key.empty()))
    diagnostics.add(mark("tls"), "'tls' needs 'certificate' and 'key'", "");
  if (settings.axisd.certificate.empty() != settings.axisd.key.empty())
    diagnostics.add(mark("axisd"), "'axisd.tls.certificate' and 'axisd.tls.key' belong together", "");
  if (!settings.axisd.certificate.empty() && settings.axisd.ca.empty())
    diagnostics.add(mark("axisd"), "'axisd.tls' needs 'ca'",
                    "the authority that the daemon's certificate is checked with");
  if (settings.session_idle > settings.session_longest)
    diagnostics.add(mark("sessions"), "'sessions.idle' is longer than 'sessions.longest'", "");
}

}  // namespace

LoadedSettings read_settings(std::string_view text, const std::string& file_name) {
  Diagnostics diagnostics(file_name);
  const auto document = config::parse_document(text);
  if (!document) {
    diagnostics.add(document.error().mark, document.error().message, document.error().suggestion);
    return {{}, diagnostics.sorted()};
  }
  Settings settings;
  Reader(settings, diagnostics).read_section(**document, {});
  settings.users_named = (*document)->kind == Node::Kind::section && (*document)->find("users") != nullptr;
  check(settings, diagnostics, **document);
  if (!diagnostics.empty()) return {{}, diagnostics.sorted()};
  return {std::move(settings), {}};
}

LoadedSettings load_settings(const std::string& path) {
  std::ifstream file(path, std::ios::binary);
  std::string text(config::largest_text + 1, '\0');
  file.read(text.data(), static_cast<std::streamsize>(text.size()));
  text.resize(static_cast<std::size_t>(file.gcount()));
  if (text.empty())
    return {{}, {{path, 0, 0, "cannot be read, or is empty", "deploy/web.yaml is an example"}}};
  return read_settings(text, path);
}

std::optional<HostAndPort> host_and_port(std::string_view address) {
  const auto colon = address.rfind(':');
  if (colon == std::string_view::npos || colon == 0) return std::nullopt;
  auto host = address.substr(0, colon);
  const auto port = address.substr(colon + 1);
  unsigned number = 0;
  const auto [read, error] = std::from_chars(port.data(), port.data() + port.size(), number);
  if (error != std::errc() || read != port.data() + port.size() || number > 65535) return std::nullopt;
  if (host.starts_with('[') && host.ends_with(']'))
    host = host.substr(1, host.size() - 2);
  else if (host.find(':') != std::string_view::npos)
    return std::nullopt;
  if (host.empty()) return std::nullopt;
  return HostAndPort{std::string(host), std::string(port)};
}

bool is_loopback(const HostAndPort& address) {
  return address.host == "localhost" || address.host == "::1" || address.host.starts_with("127.");
}

std::string stop_lane_next_to(const std::string& server) {
  if (server.starts_with("unix:")) return server + ".stop";
  const auto address = host_and_port(server);
  if (!address) return {};
  const auto next = std::stoi(address->port) + 1;
  if (next > 65535) return {};
  return server.substr(0, server.rfind(':') + 1) + std::to_string(next);
}

std::vector<std::string_view> setting_keys() {
  std::vector<std::string_view> paths;
  for (const auto& key : keys) paths.push_back(key.path);
  return paths;
}

}  // namespace axisd::web
