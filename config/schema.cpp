#include "config/schema.hpp"

#include <algorithm>

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
     .apply = [](Target& t, const Value& v) { t.configuration->server.tls->certificate = v.text; }},
    {.key = "key",
     .kind = Kind::text,
     .required = true,
     .description = "Private key of the server (PEM file).",
     .example = "/etc/axisd/server.key",
     .pattern = path_pattern,
     .pattern_hint = path_hint,
     .apply = [](Target& t, const Value& v) { t.configuration->server.tls->key = v.text; }},
    {.key = "client_ca",
     .kind = Kind::text,
     .required = true,
     .description = "Authorities that sign the certificates of permitted clients (PEM file).",
     .example = "/etc/axisd/clients.crt",
     .pattern = path_pattern,
     .pattern_hint = path_hint,
     .apply = [](Target& t, const Value& v) { t.configuration->server.tls->client_ca = v.text; }},
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
     .apply = [](Target& t,
                 const Value& v) { t.configuration->server.limits.calls = static_cast<int>(v.integer); }},
    {.key = "streams",
     .kind = Kind::integer,
     .description = "Streams that one client may have open at a time.",
     .example = "16",
     .default_value = "64",
     .minimum = 1,
     .maximum = 500,
     .apply = [](Target& t,
                 const Value& v) { t.configuration->server.limits.streams = static_cast<int>(v.integer); }},
    {.key = "connections",
     .kind = Kind::integer,
     .description = "Connections of all clients together, about; those beyond are closed at once.",
     .example = "32",
     .default_value = "256",
     .minimum = 4,
     .maximum = 10'000,
     .apply =
         [](Target& t, const Value& v) {
           t.configuration->server.limits.connections = static_cast<int>(v.integer);
         }},
    {.key = "stalled_reader",
     .kind = Kind::duration,
     .description = "A stream whose reader has not read for so long is cancelled.",
     .example = "5 s",
     .default_value = "2 s",
     .minimum = 100,
     .maximum = 60'000,
     .apply = [](Target& t, const Value& v) { t.configuration->server.limits.stalled_reader = v.duration; }},
};

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
     .apply = [](Target& t, const Value& v) { t.configuration->server.listen = v.text; }},
    {.key = "tls",
     .kind = Kind::section,
     .description = "Mutual TLS; required where the daemon can be reached from other machines.",
     .children = tls_keys,
     .apply = [](Target& t, const Value&) { t.configuration->server.tls.emplace(); }},
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
     .apply = [](Target& t,
                 const Value& v) { t.configuration->flight_recorder.memory = static_cast<int>(v.integer); }},
    {.key = "files",
     .kind = Kind::integer,
     .description = "Flight records that are kept in the state directory; the oldest are removed.",
     .example = "100",
     .default_value = "20",
     .minimum = 1,
     .maximum = 1000,
     .apply = [](Target& t,
                 const Value& v) { t.configuration->flight_recorder.files = static_cast<int>(v.integer); }},
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
     .apply = [](Target& t, const Value& v) { t.configuration->leases.shortest_ttl = v.duration; }},
    {.key = "default_ttl",
     .kind = Kind::duration,
     .description = "Time to live where the client asks for none.",
     .example = "1 s",
     .default_value = "2 s",
     .minimum = 10,
     .maximum = 3'600'000,
     .apply = [](Target& t, const Value& v) { t.configuration->leases.default_ttl = v.duration; }},
    {.key = "longest_ttl",
     .kind = Kind::duration,
     .description = "Longest time to live: so long may a client that is gone keep its axes from others.",
     .example = "5 s",
     .default_value = "60 s",
     .minimum = 10,
     .maximum = 3'600'000,
     .apply = [](Target& t, const Value& v) { t.configuration->leases.longest_ttl = v.duration; }},
};

constexpr KeySpec group_keys[] = {
    {.key = "axes",
     .kind = Kind::names,
     .required = true,
     .description = "Its members, on any bus.",
     .example = "[lifter, pusher]",
     .pattern = name_pattern,
     .apply = [](Target& t, const Value& v) { t.group->axes = v.items; }},
    {.key = "max_arrival_error",
     .kind = Kind::duration,
     .description =
         "A move whose members are to arrive together is refused where they would be further apart.",
     .example = "5 ms",
     .minimum = 1,
     .maximum = 60'000,
     .apply = [](Target& t, const Value& v) { t.group->max_arrival_error = v.duration; }},
};

constexpr std::string_view budget_policies[] = {"warn", "refuse"};

/// Of either kind of bus: `Bus` is the member of Target that points to it.
template <auto Bus>
constexpr KeySpec budget_key{
    .key = "budget",
    .kind = Kind::choice,
    .description =
        "Whether a configuration that asks more of the bus than it can do is refused, or only warned of.",
    .example = "refuse",
    .default_value = "warn",
    .choices = budget_policies,
    .apply = [](Target& t, const Value& v) { (t.*Bus)->budget.refuse = v.text == "refuse"; }};
template <auto Bus>
constexpr KeySpec stop_bound_key{
    .key = "stop_bound",
    .kind = Kind::duration,
    .description =
        "Within this after its request the last frame of a stop of all axes must have gone out, at worst.",
    .example = "400 ms",
    .minimum = 1,
    .maximum = 60'000,
    .apply = [](Target& t, const Value& v) { (t.*Bus)->budget.stop_bound = v.duration; }};
template <auto Bus>
constexpr KeySpec refresh_bound_key{
    .key = "refresh_bound",
    .kind = Kind::duration,
    .description = "While all axes move, each must be read this often, at worst.",
    .example = "3 s",
    .minimum = 1,
    .maximum = 60'000,
    .apply = [](Target& t, const Value& v) { (t.*Bus)->budget.refresh_bound = v.duration; }};
template <auto Bus>
constexpr KeySpec host_allowance_key{
    .key = "host_allowance",
    .kind = Kind::duration,
    .description =
        "What this computer may take of a stop's time, from its request to the wire; part of every stop "
        "bound. 1 ms for a real-time kernel that has nothing else to do.",
    .example = "1 ms",
    .default_value = "5 ms",
    .minimum = 1,
    .maximum = 1000,
    .apply = [](Target& t, const Value& v) { (t.*Bus)->budget.host_allowance = v.duration; }};

constexpr std::string_view formats[] = {"8N1", "8N2", "8E1", "8O1"};
constexpr modbus_rtu::Format format_values[] = {{modbus_rtu::Parity::none, 1},
                                                {modbus_rtu::Parity::none, 2},
                                                {modbus_rtu::Parity::even, 1},
                                                {modbus_rtu::Parity::odd, 1}};

constexpr KeySpec modbus_rtu_keys[] = {
    {.key = "port",
     .kind = Kind::text,
     .required = true,
     .description = "Serial device, best by /dev/serial/by-id; or 'sim' for simulated drives.",
     .example = "/dev/serial/by-id/usb-FTDI_0002",
     .pattern = "sim|/.+",
     .pattern_hint = "write an absolute path such as /dev/ttyUSB0, or sim",
     .apply = [](Target& t, const Value& v) { t.line->port = v.text; }},
    {.key = "baud",
     .kind = Kind::integer,
     .description = "Bit rate, as set at the drives.",
     .example = "9600",
     .default_value = "115200",
     .minimum = 1200,
     .maximum = 1'000'000,
     .apply = [](Target& t, const Value& v) { t.line->baud = static_cast<int>(v.integer); }},
    {.key = "format",
     .kind = Kind::choice,
     .description = "Data bits, parity and stop bits, as set at the drives.",
     .example = "8E1",
     .default_value = "8N1",
     .choices = formats,
     .apply = [](Target& t,
                 const Value& v) { t.line->format = format_values[choice_index(formats, v.text)]; }},
    {.key = "turnaround_max",
     .kind = Kind::duration,
     .description =
         "Longest time that a node takes before the first byte of its reply; part of every stop bound.",
     .example = "30 ms",
     .default_value = "20 ms",
     .minimum = 1,
     .maximum = 1000,
     .apply = [](Target& t, const Value& v) { t.line->turnaround_max = v.duration; }},
    budget_key<&Target::line>,
    stop_bound_key<&Target::line>,
    refresh_bound_key<&Target::line>,
    host_allowance_key<&Target::line>,
};

constexpr KeySpec canopen_keys[] = {
    {.key = "interface",
     .kind = Kind::text,
     .required = true,
     .description =
         "Network interface, which somebody else configures and sets up (deploy/); or 'sim' for simulated "
         "drives.",
     .example = "can1",
     .pattern = "[A-Za-z][A-Za-z0-9_.-]{0,14}",
     .pattern_hint = "write the name of a network interface such as can0, or sim",
     .apply = [](Target& t, const Value& v) { t.network->interface = v.text; }},
    {.key = "bitrate",
     .kind = Kind::integer,
     .description = "In bit/s, as set at the drives and at the interface; axisd does not change it.",
     .example = "500000",
     .default_value = "1000000",
     .minimum = 10'000,
     .maximum = 1'000'000,
     .apply = [](Target& t, const Value& v) { t.network->bitrate = static_cast<std::uint32_t>(v.integer); }},
    {.key = "sync_period",
     .kind = Kind::duration,
     .description = "How often axisd sends SYNC. Without it there is none, and drives report by events.",
     .example = "20 ms",
     .minimum = 1,
     .maximum = 1000,
     .apply = [](Target& t, const Value& v) { t.network->sync_period = v.duration; }},
    {.key = "sdo_timeout",
     .kind = Kind::duration,
     .description = "Longest time that a node takes to answer an SDO request.",
     .example = "250 ms",
     .default_value = "100 ms",
     .minimum = 5,
     .maximum = 5000,
     .apply = [](Target& t, const Value& v) { t.network->sdo_timeout = v.duration; }},
    budget_key<&Target::network>,
    stop_bound_key<&Target::network>,
    refresh_bound_key<&Target::network>,
    host_allowance_key<&Target::network>,
};

constexpr KeySpec bus_keys[] = {
    {.key = "modbus_rtu",
     .kind = Kind::section,
     .description = "An RS-485 line.",
     .children = modbus_rtu_keys,
     .apply =
         [](Target& t, const Value&) {
           t.line = &t.configuration->lines.emplace_back();
           t.line->name = t.bus_name;
         }},
    {.key = "canopen",
     .kind = Kind::section,
     .description = "A CAN network.",
     .children = canopen_keys,
     .apply =
         [](Target& t, const Value&) {
           t.network = &t.configuration->networks.emplace_back();
           t.network->name = t.bus_name;
         }},
};

}  // namespace

std::span<const KeySpec> schema() {
  static const KeySpec top_keys[] = {
      {.key = "machine",
       .kind = Kind::text,
       .required = true,
       .description = "Name of this machine.",
       .example = "press-2",
       .pattern = name_pattern,
       .pattern_hint = "a letter, then letters, digits, - or _; lower case",
       .apply = [](Target& t, const Value& v) { t.configuration->machine = v.text; }},
      {.key = "state_directory",
       .kind = Kind::text,
       .description = "Where the daemon keeps what must survive a restart.",
       .example = "/var/lib/axisd-2",
       .default_value = "/var/lib/axisd",
       .pattern = path_pattern,
       .pattern_hint = path_hint,
       .apply = [](Target& t, const Value& v) { t.configuration->state_directory = v.text; }},
      {.key = "server",
       .kind = Kind::section,
       .description = "Where the gRPC API is served.",
       .children = server_keys},
      {.key = "flight_recorder",
       .kind = Kind::section,
       .description = "The newest frames of each bus, written to a file after a fault.",
       .children = flight_recorder_keys},
      {.key = "control",
       .kind = Kind::choice,
       .description =
           "open: an axis that nobody leases may be commanded by every client; leased: only under a lease.",
       .example = "leased",
       .default_value = "open",
       .choices = controls,
       .apply = [](Target& t, const Value& v) { t.configuration->leases.required = v.text == "leased"; }},
      {.key = "leases",
       .kind = Kind::section,
       .description = "How long a client's lease may last before it has to be renewed.",
       .children = lease_keys},
      {.key = "buses",
       .kind = Kind::named_sections,
       .required = true,
       .one_of = true,
       .description = "The wires, by name, each of one kind.",
       .children = bus_keys,
       .apply = [](Target& t, const Value& v) { t.bus_name = v.text; }},
      {.key = "axes",
       .kind = Kind::named_sections,
       .may_be_empty = true,  // a machine builder starts with the buses and scans them
       .description = "The axes, by name.",
       .children = axis_schema(),
       .apply =
           [](Target& t, const Value& v) {
             t.axis = &t.configuration->axes.emplace_back();
             t.axis->axis.name = v.text;
           }},
      {.key = "devices",
       .kind = Kind::named_sections,
       .description = "Nodes on the buses that are not axes, by name.",
       .children = device_schema(),
       .apply =
           [](Target& t, const Value& v) {
             t.device = &t.configuration->devices.emplace_back();
             t.device->name = v.text;
           }},
      {.key = "groups",
       .kind = Kind::named_sections,
       .description = "Axes that are moved and stopped together, by name.",
       .children = group_keys,
       .apply =
           [](Target& t, const Value& v) {
             t.group = &t.configuration->groups.emplace_back();
             t.group->name = v.text;
           }},
  };
  return top_keys;
}

std::size_t choice_index(std::span<const std::string_view> choices, std::string_view choice) {
  return static_cast<std::size_t>(std::ranges::find(choices, choice) - choices.begin());
}

}  // namespace axisd::config
