#include "api/cell/settings.hpp"

#include <fmt/format.h>
#include <unistd.h>

#include <array>
#include <utility>

#include "api/cell/names.hpp"
#include "api/settings/key_table.hpp"
#include "api/transport/address.hpp"

namespace axisd::cell {
namespace {

using config::Diagnostics;
using config::Node;
using Key = settings::Key<Settings>;

tls::Files& tls_of(Settings& settings) { return settings.tls ? *settings.tls : settings.tls.emplace(); }

void read_peer(PeerSettings& peer, const Node& section, Diagnostics& diagnostics) {
  settings::for_each_entry(
      section, diagnostics, "this has to be a section", [&](const Node& key, const Node& value) {
        constexpr std::array<std::string_view, 3> names{"axisd", "stop", "cell"};
        auto* to = key.text == "axisd"  ? &peer.axisd
                   : key.text == "stop" ? &peer.stop
                   : key.text == "cell" ? &peer.cell
                                        : nullptr;
        if (to == nullptr)
          diagnostics.add(key.mark, fmt::format("unknown key {}", config::quoted(key.text)),
                          config::suggest(key.text, names));
        else if (const auto text = settings::text_of(value, key.text, diagnostics)) {
          if (!is_address(*text))
            diagnostics.add(value.mark, fmt::format("'{}' cannot be {}", key.text, config::quoted(*text)),
                            "write HOST:PORT");
          *to = *text;
        }
      });
  if (peer.axisd.empty()) diagnostics.add(section.mark, "a peer needs 'axisd'", "write axisd: HOST:7443");
  if (peer.stop.empty()) peer.stop = transport::stop_lane_next_to(peer.axisd);
}

void read_peers(Settings& settings, const Node& section, Diagnostics& diagnostics) {
  settings::for_each_entry(
      section, diagnostics, "this has to be a section", [&](const Node& key, const Node& value) {
        if (!is_machine_name(key.text))
          diagnostics.add(key.mark, fmt::format("{} is no name of a machine", config::quoted(key.text)),
                          "a letter, then letters, digits, - or _; lower case");
        read_peer(settings.peers[key.text], value, diagnostics);
      });
}

void read_roles(Settings& settings, const Node& section, Diagnostics& diagnostics) {
  settings::for_each_entry(
      section, diagnostics, "this has to be a section", [&](const Node& key, const Node& value) {
        constexpr std::array roles{CellRole::viewer, CellRole::operator_, CellRole::maintainer};
        const auto text = settings::text_of(value, key.text, diagnostics);
        if (!text) return;
        const auto* const role = std::ranges::find(roles, *text, [](CellRole r) { return to_string(r); });
        if (role == roles.end())
          diagnostics.add(
              value.mark, fmt::format("{} is no role", config::quoted(*text)),
              config::suggest(*text, config::names_of(roles, [](CellRole r) { return to_string(r); })));
        else
          settings.roles[key.text] = *role;
      });
}

constexpr Key keys[] = {
    {.path = "cell", .text = [](Settings& s) { return &s.cell; }},
    {.path = "machine", .text = [](Settings& s) { return &s.machine; }},
    {.path = "listen", .text = [](Settings& s) { return &s.listen; }},
    {.path = "advertise", .text = [](Settings& s) { return &s.advertise; }},
    {.path = "tls.certificate", .text = [](Settings& s) { return &tls_of(s).certificate; }},
    {.path = "tls.key", .text = [](Settings& s) { return &tls_of(s).key; }},
    {.path = "tls.client_ca", .text = [](Settings& s) { return &tls_of(s).client_ca; }},
    {.path = "tls.crl", .text = [](Settings& s) { return &tls_of(s).crl; }},
    {.path = "axisd.server", .text = [](Settings& s) { return &s.axisd.server; }},
    {.path = "axisd.stop_server", .text = [](Settings& s) { return &s.axisd.stop_server; }},
    {.path = "axisd.advertise", .text = [](Settings& s) { return &s.axisd.advertise; }},
    {.path = "axisd.stop_advertise", .text = [](Settings& s) { return &s.axisd.stop_advertise; }},
    {.path = "axisd.tls.ca", .text = [](Settings& s) { return &s.axisd.tls.ca; }},
    {.path = "axisd.tls.certificate", .text = [](Settings& s) { return &s.axisd.tls.certificate; }},
    {.path = "axisd.tls.key", .text = [](Settings& s) { return &s.axisd.tls.key; }},
    {.path = "etcd.endpoints", .texts = [](Settings& s) { return &s.etcd.endpoints; }},
    {.path = "etcd.tls.ca", .text = [](Settings& s) { return &s.etcd.tls.ca; }},
    {.path = "etcd.tls.certificate", .text = [](Settings& s) { return &s.etcd.tls.certificate; }},
    {.path = "etcd.tls.key", .text = [](Settings& s) { return &s.etcd.tls.key; }},
    {.path = "etcd.ttl",
     .duration = [](Settings& s) { return &s.etcd.ttl; },
     .minimum = 5000,
     .maximum = 300'000},
    {.path = "peers", .value = read_peers},
    {.path = "roles", .value = read_roles},
    {.path = "state", .text = [](Settings& s) { return &s.state; }},
    {.path = "metrics.listen", .text = [](Settings& s) { return &s.metrics; }},
    {.path = "limits.calls", .number = [](Settings& s) { return &s.calls; }, .minimum = 16, .maximum = 65536},
    {.path = "limits.calls_each",
     .number = [](Settings& s) { return &s.calls_each; },
     .minimum = 16,
     .maximum = 65536},
};

/// What no single key can tell. Each of its parts adds what it finds.
class Checks {
 public:
  Checks(const Settings& settings, Diagnostics& diagnostics, const Node& root)
      : settings_(settings), diagnostics_(diagnostics), root_(root) {}

  void run() {
    names();
    way_in();
    addresses();
    certificates(settings_.axisd.tls, "axisd");
    certificates(settings_.etcd.tls, "etcd");
    if (settings_.etcd.ttl % std::chrono::seconds(1) != Duration::zero())
      wrong("etcd", "'etcd.ttl' has to be whole seconds", "write ttl: 15 s");
    if (settings_.calls_each > settings_.calls)
      wrong("limits", "'limits.calls_each' is more than 'limits.calls'", "");
    if (settings_.state.empty() || settings_.state.front() != '/')
      wrong("state", "'state' has to be an absolute path", "write state: /var/lib/axisd-cell");
  }

 private:
  void wrong(std::string_view key, std::string message, std::string suggestion) {
    diagnostics_.add(settings::mark_of(root_, key), std::move(message), std::move(suggestion));
  }
  void names() {
    for (const auto& [key, name] :
         {std::pair("cell", &settings_.cell), std::pair("machine", &settings_.machine)})
      if (name->empty())
        wrong(key, fmt::format("'{}' is missing", key), fmt::format("write {}: {}", key, "a-name"));
      else if (!is_machine_name(*name))
        wrong(key, fmt::format("'{}' cannot be {}", key, config::quoted(*name)),
              "a letter, then letters, digits, - or _; lower case; at most 64");
    if (settings_.peers.contains(settings_.machine))
      wrong("peers", "this machine itself is among 'peers'", "it is 'axisd'");
  }
  void way_in() {
    const auto listen = transport::host_and_port(settings_.listen);
    if (!listen)
      wrong("listen", fmt::format("'listen' cannot be {}", config::quoted(settings_.listen)),
            "write HOST:PORT, for example localhost:7445");
    else if (!settings_.tls && !transport::is_loopback(*listen))
      wrong("listen", "without TLS only this computer is served",
            "write tls: { certificate, key, client_ca }, or listen: localhost:7445");
    if (settings_.tls && (settings_.tls->certificate.empty() || settings_.tls->key.empty() ||
                          settings_.tls->client_ca.empty()))
      wrong("tls", "'tls' needs 'certificate', 'key' and 'client_ca'", "whoever calls shows a certificate");
  }
  void addresses() {
    const std::pair<std::string_view, const std::string*> all[] = {
        {"advertise", &settings_.advertise},
        {"axisd.server", &settings_.axisd.server},
        {"axisd.stop_server", &settings_.axisd.stop_server},
        {"axisd.advertise", &settings_.axisd.advertise},
        {"axisd.stop_advertise", &settings_.axisd.stop_advertise}};
    for (const auto& [key, address] : all)
      if (!address->empty() && !is_address(*address))
        wrong(key.substr(0, key.find('.')), fmt::format("'{}' cannot be {}", key, config::quoted(*address)),
              "write HOST:PORT");
    for (const auto& endpoint : settings_.etcd.endpoints)
      if (!is_address(endpoint) || endpoint.starts_with("unix:"))
        wrong("etcd", fmt::format("'etcd.endpoints' cannot have {}", config::quoted(endpoint)),
              "write HOST:2379");
    if (!settings_.etcd.endpoints.empty() && settings_.axisd.advertise.empty())
      wrong("axisd", "'axisd.advertise' is missing: with etcd other machines have to reach this one",
            "write advertise: HOST:7443, as other machines call it");
  }
  void certificates(const transport::ClientFiles& files, std::string_view key) {
    if (files.certificate.empty() != files.key.empty())
      wrong(key, fmt::format("'{0}.tls.certificate' and '{0}.tls.key' belong together", key), "");
    if (!files.certificate.empty() && files.ca.empty())
      wrong(key, fmt::format("'{}.tls' needs 'ca'", key),
            "the authority that the other's certificate is checked with");
  }

  const Settings& settings_;
  Diagnostics& diagnostics_;
  const Node& root_;
};

/// "press-1.factory:7445" for this computer and "0.0.0.0:7445".
std::string advertised(const std::string& listen) {
  const auto address = transport::host_and_port(listen);
  if (!address || address->port == "0") return {};
  if (transport::is_loopback(*address)) return listen;
  std::array<char, 256> host{};
  if (gethostname(host.data(), host.size() - 1) != 0) return {};
  return fmt::format("{}:{}", host.data(), address->port);
}

void fill_in(Settings& settings) {
  auto& axisd = settings.axisd;
  if (axisd.stop_server.empty()) axisd.stop_server = transport::stop_lane_next_to(axisd.server);
  if (axisd.stop_advertise.empty()) axisd.stop_advertise = transport::stop_lane_next_to(axisd.advertise);
  if (settings.advertise.empty()) settings.advertise = advertised(settings.listen);
}

}  // namespace

std::string_view to_string(CellRole role) {
  switch (role) {
    case CellRole::viewer:
      return "viewer";
    case CellRole::operator_:
      return "operator";
    case CellRole::maintainer:
      return "maintainer";
  }
  return "viewer";
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
  Checks(settings, diagnostics, **document).run();
  if (!diagnostics.empty()) return {{}, diagnostics.sorted()};
  fill_in(settings);
  return {std::move(settings), {}};
}

LoadedSettings load_settings(const std::string& path) {
  const auto text = settings::text_of_file(path);
  if (!text) return {{}, {{path, 0, 0, text.error(), "deploy/cell/cell.yaml is an example"}}};
  return read_settings(*text, path);
}

std::vector<std::string_view> setting_keys() {
  std::vector<std::string_view> paths;
  paths.reserve(std::size(keys));
  for (const auto& key : keys) paths.push_back(key.path);
  return paths;
}

CellRole role_of(const Settings& settings, std::string_view name) {
  const auto found = settings.roles.find(name);
  return found == settings.roles.end() ? CellRole::viewer : found->second;
}

}  // namespace axisd::cell
