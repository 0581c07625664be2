#include <algorithm>

#include "config/field.hpp"

// One entry per key: what it looks like and where its value goes. What depends on other keys is in
// machine_checks.cpp.
namespace axisd::config {

namespace {

constexpr std::string_view path_pattern = "/.+";
constexpr std::string_view path_hint = "write an absolute path, starting with /";

constexpr KeySpec tls_keys[] = {
    {.key = "certificate",
     .kind = Kind::text,
     .required = true,
     .description = "Certificate of the server, with its chain (PEM file).",
     .example = "/etc/axisd/server.crt",
     .pattern = path_pattern,
     .pattern_hint = path_hint,
     .field = field([](auto& t) -> auto& { return t.configuration->server.tls->certificate; })},
    {.key = "key",
     .kind = Kind::text,
     .required = true,
     .description = "Private key of the server (PEM file). Others than its owner and group must not read it.",
     .example = "/etc/axisd/server.key",
     .pattern = path_pattern,
     .pattern_hint = path_hint,
     .field = field([](auto& t) -> auto& { return t.configuration->server.tls->key; })},
    {.key = "client_ca",
     .kind = Kind::text,
     .required = true,
     .description = "Authorities that sign the certificates of permitted clients (PEM file).",
     .example = "/etc/axisd/clients.crt",
     .pattern = path_pattern,
     .pattern_hint = path_hint,
     .field = field([](auto& t) -> auto& { return t.configuration->server.tls->client_ca; })},
    {.key = "crl",
     .kind = Kind::text,
     .description =
         "Certificates of clients that their authorities have revoked (PEM file, CRL). Without it none is.",
     .example = "/etc/axisd/clients.crl",
     .pattern = path_pattern,
     .pattern_hint = path_hint,
     .field = field([](auto& t) -> auto& { return t.configuration->server.tls->crl; })},
};

constexpr KeySpec limit_keys[] = {
    {.key = "calls",
     .kind = Kind::integer,
     .description =
         "Calls that one client may have waiting at a time. Stops, and renewals of leases, are not counted.",
     .example = "32",
     .default_value = "256",
     .minimum = 1,
     .maximum = 1000,
     .field = field([](auto& t) -> auto& { return t.configuration->server.limits.calls; })},
    {.key = "streams",
     .kind = Kind::integer,
     .description = "Streams that one client may have open at a time.",
     .example = "16",
     .default_value = "64",
     .minimum = 1,
     .maximum = 500,
     .field = field([](auto& t) -> auto& { return t.configuration->server.limits.streams; })},
    {.key = "connections",
     .kind = Kind::integer,
     .description = "Connections of all clients together; those beyond are closed at once, or take the "
                    "place of one that says nothing. One address has three quarters of them at most.",
     .example = "32",
     .default_value = "256",
     .minimum = 4,
     .maximum = 10'000,
     .field = field([](auto& t) -> auto& { return t.configuration->server.limits.connections; })},
    {.key = "request_ids",
     .kind = Kind::integer,
     .description =
         "Request ids that are remembered of all clients together, at 20 bytes each; a client may have "
         "twice as many as are free. Each is remembered for 11 minutes at least. Stops need none.",
     .example = "100000",
     .default_value = "1048576",
     .minimum = 1'000,
     .maximum = 10'000'000,
     .field = field([](auto& t) -> auto& { return t.configuration->server.limits.request_ids; })},
    {.key = "stalled_reader",
     .kind = Kind::duration,
     .description = "A stream whose reader has not read for so long is cancelled.",
     .example = "5 s",
     .default_value = "2 s",
     .minimum = 100,
     .maximum = 60'000,
     .field = field([](auto& t) -> auto& { return t.configuration->server.limits.stalled_reader; })},
};

constexpr KeySpec metrics_keys[] = {
    {.key = "listen",
     .kind = Kind::text,
     .required = true,
     .description =
         "HOST:PORT. Only loopback addresses, unless `remote` is true. Port 0: the system chooses.",
     .example = "localhost:9000",
     .pattern = "(\\[[0-9A-Fa-f:.]+\\]|[A-Za-z0-9._-]+):[0-9]{1,5}",
     .pattern_hint = "write HOST:PORT or [IPV6]:PORT",
     .field = field([](auto& t) -> auto& { return t.configuration->server.metrics.listen; })},
    {.key = "remote",
     .kind = Kind::boolean,
     .description =
         "Other computers may connect: everybody who can reach the address reads the names and the "
         "state of all axes. Nothing can be commanded there.",
     .example = "true",
     .default_value = "false",
     .field = field([](auto& t) -> auto& { return t.configuration->server.metrics.remote; })},
};
constexpr std::string_view plaintexts[] = {"loopback", "unix"};

constexpr KeySpec server_keys[] = {
    {.key = "listen",
     .kind = Kind::text,
     .description =
         "HOST:PORT or unix:/PATH. Without tls only loopback addresses and unix sockets. Port 0: the system "
         "chooses.",
     .example = "127.0.0.1:7444",
     .default_value = "localhost:7443",
     .pattern = "unix:/.+|(\\[[0-9A-Fa-f:.]+\\]|[A-Za-z0-9._-]+):[0-9]{1,5}",
     .pattern_hint = "write HOST:PORT, [IPV6]:PORT or unix:/PATH",
     .field = field([](auto& t) -> auto& { return t.configuration->server.listen; })},
    {.key = "stop_listen",
     .kind = Kind::text,
     .description =
         "Where stops are taken as well, whatever happens at `listen`. Without it the port after that of "
         "`listen`, or its path with .stop behind it, where clients look for it.",
     .example = "127.0.0.1:7500",
     .pattern = "unix:/.+|(\\[[0-9A-Fa-f:.]+\\]|[A-Za-z0-9._-]+):[0-9]{1,5}",
     .pattern_hint = "write HOST:PORT, [IPV6]:PORT or unix:/PATH",
     .field = field([](auto& t) -> auto& { return t.configuration->server.stop_listen; })},
    {.key = "tls",
     .kind = Kind::section,
     .description = "Mutual TLS; required where the daemon can be reached from other machines.",
     .children = tls_keys,
     .field = optional_section([](auto& t) -> auto& { return t.configuration->server.tls; })},
    {.key = "plaintext",
     .kind = Kind::choice,
     .description =
         "Where TLS may be left out. loopback: on loopback addresses and unix sockets; unix: on unix sockets "
         "only, whose clients are known by their user.",
     .example = "unix",
     .default_value = "loopback",
     .choices = plaintexts,
     .field = choice_field([](auto& t) -> auto& { return t.configuration->server.plaintext; })},
    {.key = "reflection",
     .kind = Kind::boolean,
     .description =
         "Serves gRPC's reflection, by which tools such as grpcurl read the contract from the daemon. "
         "For development: clients know it from the .proto files.",
     .example = "true",
     .default_value = "false",
     .field = field([](auto& t) -> auto& { return t.configuration->server.reflection; })},
    {.key = "metrics",
     .kind = Kind::section,
     .description =
         "Figures for Prometheus at http://HOST:PORT/metrics. Without this section there are none.",
     .children = metrics_keys},
    {.key = "limits",
     .kind = Kind::section,
     .description = "What clients may take of the daemon; refusals name the key.",
     .children = limit_keys},
};

constexpr KeySpec flight_recorder_keys[] = {
    {.key = "memory",
     .kind = Kind::integer,
     .description = "KiB that the newest frames of each bus may take; 384 hold some 4000 exchanges.",
     .example = "64",
     .default_value = "384",
     .minimum = 16,
     .maximum = 1024,
     .field = field([](auto& t) -> auto& { return t.configuration->flight_recorder.memory; })},
    {.key = "files",
     .kind = Kind::integer,
     .description = "Flight records that are kept in the state directory; the oldest are removed.",
     .example = "100",
     .default_value = "20",
     .minimum = 1,
     .maximum = 1000,
     .field = field([](auto& t) -> auto& { return t.configuration->flight_recorder.files; })},
};

constexpr KeySpec audit_keys[] = {
    {.key = "files",
     .kind = Kind::integer,
     .description = "Files of the audit that are kept in the state directory; the oldest are removed.",
     .example = "64",
     .default_value = "16",
     .minimum = 2,
     .maximum = 10000,
     .field = field([](auto& t) -> auto& { return t.configuration->audit.files; })},
    {.key = "file_size",
     .kind = Kind::integer,
     .description = "KiB that each of them comes to; a command takes about 1.5.",
     .example = "1024",
     .default_value = "8192",
     .minimum = 256,
     .maximum = 65536,
     .field = field([](auto& t) -> auto& { return t.configuration->audit.file_size; })},
};

constexpr std::string_view controls[] = {"open", "leased"};

constexpr KeySpec lease_keys[] = {
    {.key = "shortest_ttl",
     .kind = Kind::duration,
     .description = "Shortest time to live that a client may ask for.",
     .example = "500 ms",
     .default_value = "100 ms",
     .minimum = 10,
     .maximum = 3'600'000,
     .field = field([](auto& t) -> auto& { return t.configuration->leases.shortest_ttl; })},
    {.key = "default_ttl",
     .kind = Kind::duration,
     .description = "Time to live where the client asks for none.",
     .example = "1 s",
     .default_value = "2 s",
     .minimum = 10,
     .maximum = 3'600'000,
     .field = field([](auto& t) -> auto& { return t.configuration->leases.default_ttl; })},
    {.key = "longest_ttl",
     .kind = Kind::duration,
     .description = "Longest time to live: so long may a client that is gone keep its axes from others.",
     .example = "5 s",
     .default_value = "60 s",
     .minimum = 10,
     .maximum = 3'600'000,
     .field = field([](auto& t) -> auto& { return t.configuration->leases.longest_ttl; })},
};

constexpr KeySpec group_keys[] = {
    {.key = "axes",
     .kind = Kind::names,
     .required = true,
     .description = "Its members, on any bus.",
     .example = "[lifter, pusher]",
     .pattern = name_pattern,
     .field = field([](auto& t) -> auto& { return t.group->axes; })},
    {.key = "max_arrival_error",
     .kind = Kind::duration,
     .description =
         "A move whose members are to arrive together is refused where they would be further apart.",
     .example = "5 ms",
     .minimum = 1,
     .maximum = 60'000,
     .field = field([](auto& t) -> auto& { return t.group->max_arrival_error; })},
};

constexpr KeySpec machine_key = {.key = "machine",
                                 .kind = Kind::text,
                                 .required = true,
                                 .description = "Name of this machine.",
                                 .example = "press-2",
                                 .pattern = name_pattern,
                                 .pattern_hint = "a letter, then letters, digits, - or _; lower case",
                                 .field = field([](auto& t) -> auto& { return t.configuration->machine; })};

constexpr KeySpec state_directory_key = {
    .key = "state_directory",
    .kind = Kind::text,
    .description = "Where the daemon keeps what must survive a restart.",
    .example = "/var/lib/axisd-2",
    .default_value = "/var/lib/axisd",
    .pattern = path_pattern,
    .pattern_hint = path_hint,
    .field = field([](auto& t) -> auto& { return t.configuration->state_directory; })};

constexpr KeySpec control_key = {
    .key = "control",
    .kind = Kind::choice,
    .description =
        "open: an axis that nobody leases may be commanded by every client; leased: only under a lease.",
    .example = "leased",
    .default_value = "open",
    .choices = controls,
    .field = choice_field([](auto& t) -> auto& { return t.configuration->leases.required; })};

constexpr KeySpec groups_key = {
    .key = "groups",
    .kind = Kind::named_sections,
    .description = "Axes that are moved and stopped together, by name.",
    .children = group_keys,
    .field = list_of<&Target::group>([](auto& t) -> auto& { return t.configuration->groups; },
                                     [](auto& group) -> auto& { return group.name; })};

/// Of both kinds.
std::vector<NamedTarget> buses(const Target& t) {
  std::vector<NamedTarget> all;
  for (auto& line : t.configuration->lines)
    all.push_back({line.name, {.configuration = t.configuration, .line = &line}});
  for (auto& network : t.configuration->networks)
    all.push_back({network.name, {.configuration = t.configuration, .network = &network}});
  return all;
}

}  // namespace

std::span<const KeySpec> schema() {
  static const KeySpec top_keys[] = {
      machine_key,
      state_directory_key,
      {.key = "server",
       .kind = Kind::section,
       .description = "Where the gRPC API is served.",
       .children = server_keys},
      {.key = "access",
       .kind = Kind::section,
       .description = "Who may do what. Without this section everybody may do everything; with it, clients "
                      "that it does not "
                      "name can stop and nothing else.",
       .children = access_schema(),
       .field = optional_section([](auto& t) -> auto& { return t.configuration->access; })},
      {.key = "flight_recorder",
       .kind = Kind::section,
       .description = "The newest frames of each bus, written to a file after a fault.",
       .children = flight_recorder_keys},
      {.key = "audit",
       .kind = Kind::section,
       .description = "Who asked for what, and what became of it, in files of the state directory.",
       .children = audit_keys},
      control_key,
      {.key = "leases",
       .kind = Kind::section,
       .description = "How long a client's lease may last before it has to be renewed.",
       .children = lease_keys},
      {.key = "buses",
       .kind = Kind::named_sections,
       .required = true,
       .one_of = true,
       .description = "The wires, by name, each of one kind.",
       .children = bus_schema(),
       .field = {.apply = [](Target& t, const Value& v) { t.bus_name = v.text; }, .inside = &buses}},
      {.key = "axes",
       .kind = Kind::named_sections,
       .may_be_empty = true,  // a machine builder starts with the buses and scans them
       .description = "The axes, by name.",
       .children = axis_schema(),
       .field = list_of<&Target::axis>([](auto& t) -> auto& { return t.configuration->axes; },
                                       [](auto& entry) -> auto& { return entry.axis.name; })},
      {.key = "devices",
       .kind = Kind::named_sections,
       .description = "Nodes on the buses that are not axes, by name.",
       .children = device_schema(),
       .field = list_of<&Target::device>([](auto& t) -> auto& { return t.configuration->devices; },
                                         [](auto& device) -> auto& { return device.name; })},
      groups_key,
  };
  return top_keys;
}

std::size_t choice_index(std::span<const std::string_view> choices, std::string_view choice) {
  return static_cast<std::size_t>(std::ranges::find(choices, choice) - choices.begin());
}

}  // namespace axisd::config
