#include "config/field.hpp"

// The keys of one bus: what it is to its drives, and what is asked of it.
namespace axisd::config {

namespace {

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
    .field = choice_field([](auto& t) -> auto& { return (t.*Bus)->budget.refuse; })};
template <auto Bus>
constexpr KeySpec stop_bound_key{
    .key = "stop_bound",
    .kind = Kind::duration,
    .description =
        "Within this after its request the last frame of a stop of all axes must have gone out, at worst.",
    .example = "400 ms",
    .minimum = 1,
    .maximum = 60'000,
    .field = field([](auto& t) -> auto& { return (t.*Bus)->budget.stop_bound; })};
template <auto Bus>
constexpr KeySpec refresh_bound_key{
    .key = "refresh_bound",
    .kind = Kind::duration,
    .description = "While all axes move, each must be read this often, at worst.",
    .example = "3 s",
    .minimum = 1,
    .maximum = 60'000,
    .field = field([](auto& t) -> auto& { return (t.*Bus)->budget.refresh_bound; })};
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
    .field = field([](auto& t) -> auto& { return (t.*Bus)->budget.host_allowance; })};

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
     .field = field([](auto& t) -> auto& { return t.line->port; })},
    {.key = "baud",
     .kind = Kind::integer,
     .description = "Bit rate, as set at the drives.",
     .example = "9600",
     .default_value = "115200",
     .minimum = 1200,
     .maximum = 1'000'000,
     .field = field([](auto& t) -> auto& { return t.line->baud; })},
    {.key = "format",
     .kind = Kind::choice,
     .description = "Data bits, parity and stop bits, as set at the drives.",
     .example = "8E1",
     .default_value = "8N1",
     .choices = formats,
     .field = {.apply = [](Target& t, const Value& v) { t.line->format = format_values[v.integer]; },
               .show = [](const Target& t) { return modbus_rtu::to_string(t.line->format); }}},
    {.key = "turnaround_max",
     .kind = Kind::duration,
     .description =
         "Longest time that a node takes before the first byte of its reply; part of every stop bound.",
     .example = "30 ms",
     .default_value = "20 ms",
     .minimum = 1,
     .maximum = 1000,
     .field = field([](auto& t) -> auto& { return t.line->turnaround_max; })},
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
     .field = field([](auto& t) -> auto& { return t.network->interface; })},
    {.key = "bitrate",
     .kind = Kind::integer,
     .description = "In bit/s, as set at the drives and at the interface; axisd does not change it.",
     .example = "500000",
     .default_value = "1000000",
     .minimum = 10'000,
     .maximum = 1'000'000,
     .field = field([](auto& t) -> auto& { return t.network->bitrate; })},
    {.key = "sync_period",
     .kind = Kind::duration,
     .description = "How often axisd sends SYNC. Without it there is none, and drives report by events.",
     .example = "20 ms",
     .minimum = 1,
     .maximum = 1000,
     .field = field([](auto& t) -> auto& { return t.network->sync_period; })},
    {.key = "sdo_timeout",
     .kind = Kind::duration,
     .description = "Longest time that a node takes to answer an SDO request.",
     .example = "250 ms",
     .default_value = "100 ms",
     .minimum = 5,
     .maximum = 5000,
     .field = field([](auto& t) -> auto& { return t.network->sdo_timeout; })},
    {.key = "sdo_answer",
     .kind = Kind::duration,
     .description =
         "How long the slowest node takes to answer an SDO request as a rule. Where that is too long "
         "for reboot_guard or start_within of an axis, check says so.",
     .example = "40 ms",
     .default_value = "5 ms",
     .minimum = 1,
     .maximum = 1000,
     .field = field([](auto& t) -> auto& { return t.network->sdo_answer; })},
    budget_key<&Target::network>,
    stop_bound_key<&Target::network>,
    refresh_bound_key<&Target::network>,
    host_allowance_key<&Target::network>,
};

/// The section of a bus that says its kind.
template <auto Bus, class Get>
consteval Field bus_of_kind(Get) {
  return {.apply =
              [](Target& t, const Value&) {
                t.*Bus = &Get{}(t).emplace_back();
                (t.*Bus)->name = t.bus_name;
              },
          .inside =
              [](const Target& t) {
                return t.*Bus != nullptr ? std::vector<NamedTarget>{{{}, t}} : std::vector<NamedTarget>{};
              }};
}

constexpr KeySpec bus_keys[] = {
    {.key = "modbus_rtu",
     .kind = Kind::section,
     .description = "An RS-485 line.",
     .children = modbus_rtu_keys,
     .field = bus_of_kind<&Target::line>([](auto& t) -> auto& { return t.configuration->lines; })},
    {.key = "canopen",
     .kind = Kind::section,
     .description = "A CAN network.",
     .children = canopen_keys,
     .field = bus_of_kind<&Target::network>([](auto& t) -> auto& { return t.configuration->networks; })},
};

}  // namespace

std::span<const KeySpec> bus_schema() { return bus_keys; }

}  // namespace axisd::config
