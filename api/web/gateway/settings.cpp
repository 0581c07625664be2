#include "api/web/gateway/settings.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <utility>

#include "api/settings/key_table.hpp"
#include "api/transport/address.hpp"
#include "config/document.hpp"
#include "config/text.hpp"

namespace axisd::web {
namespace {

using config::Diagnostics;
using config::Mark;
using config::Node;

using Key = settings::Key<Settings>;

TlsSettings& tls_of(Settings& settings) { return settings.tls ? *settings.tls : settings.tls.emplace(); }

void read_machine(DaemonSettings& machine, const Node& value, Diagnostics& diagnostics) {
  machine.server.clear();
  if (value.kind == Node::Kind::scalar) {
    machine.server = value.text;
  } else {
    settings::for_each_entry(
        value, diagnostics, "this has to be an address, or a section", [&](const Node& key, const Node& of) {
          constexpr std::array<std::string_view, 2> names{"server", "stop_server"};
          const auto known = std::ranges::find(names, key.text);
          if (known == names.end())
            return diagnostics.add(key.mark, fmt::format("unknown key {}", config::quoted(key.text)),
                                   config::suggest(key.text, names));
          if (const auto text = settings::text_of(of, key.text, diagnostics))
            (known == names.begin() ? machine.server : machine.stop_server) = *text;
        });
  }
  if (machine.server.empty())
    diagnostics.add(value.mark, "a machine needs 'server'", "write press-1: HOST:7443");
}

void read_machines(Settings& settings, const Node& section, Diagnostics& diagnostics) {
  settings::for_each_entry(
      section, diagnostics, "this has to be a section", [&](const Node& key, const Node& value) {
        if (!is_machine_name(key.text))
          diagnostics.add(key.mark, fmt::format("{} is no name of a machine", config::quoted(key.text)),
                          "a letter, then letters, digits, - or _; lower case");
        read_machine(settings.machines[key.text], value, diagnostics);
      });
}

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
    {.path = "machines", .value = read_machines},
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

/// What no single key can tell. `at`: the mark of a key at the top of the file.
void check(const Settings& settings, Diagnostics& diagnostics, const Node& root) {
  const auto mark = [&](std::string_view key) {
    const auto* found = root.find(key);
    return found == nullptr ? Mark{} : found->mark;
  };
  const auto listen = transport::host_and_port(settings.listen);
  if (!listen)
    diagnostics.add(mark("listen"), fmt::format("'listen' cannot be {}", config::quoted(settings.listen)),
                    "write HOST:PORT, for example localhost:7480");
  else if (!settings.tls && !transport::is_loopback(*listen))
    diagnostics.add(mark("listen"), "without TLS only this computer is served",
                    "write tls: { certificate, key }, or listen: localhost:7480");
  if (settings.tls && (settings.tls->certificate.empty() || settings.tls->key.empty()))
    diagnostics.add(mark("tls"), "'tls' needs 'certificate' and 'key'", "");
  const auto* axisd = root.find("axisd");
  if (!settings.machines.empty() && axisd != nullptr && axisd->kind == Node::Kind::section &&
      (axisd->find("server") != nullptr || axisd->find("stop_server") != nullptr))
    diagnostics.add(mark("machines"), "'machines' are several, and 'axisd.server' is one",
                    "write each of them below 'machines'");
  if (settings.axisd.certificate.empty() != settings.axisd.key.empty())
    diagnostics.add(mark("axisd"), "'axisd.tls.certificate' and 'axisd.tls.key' belong together", "");
  if (!settings.axisd.certificate.empty() && settings.axisd.ca.empty())
    diagnostics.add(mark("axisd"), "'axisd.tls' needs 'ca'",
                    "the authority that the daemon's certificate is checked with");
  if (settings.session_idle > settings.session_longest)
    diagnostics.add(mark("sessions"), "'sessions.idle' is longer than 'sessions.longest'", "");
}

}  // namespace

bool is_machine_name(std::string_view name) {
  constexpr std::size_t longest = 64;
  const auto is_letter = [](char c) { return c >= 'a' && c <= 'z'; };
  return !name.empty() && name.size() <= longest && is_letter(name.front()) &&
         std::ranges::all_of(
             name, [&](char c) { return is_letter(c) || (c >= '0' && c <= '9') || c == '_' || c == '-'; });
}

LoadedSettings read_settings(std::string_view text, const std::string& file_name) {
  Diagnostics diagnostics(file_name);
  const auto document = config::parse_document(text);
  if (!document) {
    diagnostics.add(document.error().mark, document.error().message, document.error().suggestion);
    return {{}, diagnostics.sorted()};
  }
  Settings settings;
  settings::read_keys<Settings>(**document, keys, settings, diagnostics);
  settings.users_named = (*document)->kind == Node::Kind::section && (*document)->find("users") != nullptr;
  check(settings, diagnostics, **document);
  for (auto& [name, machine] : settings.machines) {
    machine.ca = settings.axisd.ca;
    machine.certificate = settings.axisd.certificate;
    machine.key = settings.axisd.key;
  }
  if (!diagnostics.empty()) return {{}, diagnostics.sorted()};
  return {std::move(settings), {}};
}

LoadedSettings load_settings(const std::string& path) {
  const auto text = settings::text_of_file(path);
  if (!text) return {{}, {{path, 0, 0, text.error(), "deploy/web.yaml is an example"}}};
  return read_settings(*text, path);
}

std::vector<std::string_view> setting_keys() {
  std::vector<std::string_view> paths;
  for (const auto& key : keys) paths.push_back(key.path);
  return paths;
}

}  // namespace axisd::web
