#include "config/field.hpp"
#include "config/quantity.hpp"

// The keys of nodes that are not axes. What depends on other keys is in device_checks.cpp.
namespace axisd::config {

namespace {

constexpr std::string_view models[] = {"modbus-generic", "canopen-generic"};  // in the order of BusKind
constexpr std::string_view object_types[] = {"u16", "i16", "u32", "i32", "f32", "u8", "i8"};  // of ValueType
constexpr std::span<const std::string_view> register_types = std::span(object_types).first(5);
constexpr std::string_view accesses[] = {"ro", "rw"};

// What registers and objects have alike.
constexpr Field type_field = choice_field([](auto& t) -> auto& { return t.device_value->type; });
constexpr KeySpec scale_key{.key = "scale",
                            .kind = Kind::number,
                            .description = "Value = raw number x scale.",
                            .example = "0.1",
                            .default_value = "1",
                            .field = field([](auto& t) -> auto& { return t.device_value->scale; })};
constexpr KeySpec unit_key{
    .key = "unit",
    .kind = Kind::text,
    .description = "Of the value; only shown.",
    .example = "degC",
    .pattern = "[A-Za-z%][A-Za-z0-9%/*^._-]{0,15}",
    .pattern_hint = "use up to 16 letters, digits or any of % / * ^ . _ -, such as degC or l/min",
    .field = field([](auto& t) -> auto& { return t.device_value->unit; })};
constexpr KeySpec access_key{
    .key = "access",
    .kind = Kind::choice,
    .description = "rw: may be written, too.",
    .example = "rw",
    .default_value = "ro",
    .choices = accesses,
    .field = choice_field([](auto& t) -> auto& { return t.device_value->writable; })};

constexpr Field values = list_of<&Target::device_value>([](auto& t) -> auto& { return t.device->values; },
                                                        [](auto& value) -> auto& { return value.name; });
/// Them, as the key for this kind of bus has them.
template <BusKind kind>
consteval Field values_of() {
  return {.apply = values.apply, .inside = [](const Target& t) {
            return t.device->kind == kind ? values.inside(t) : std::vector<NamedTarget>{};
          }};
}

constexpr KeySpec register_keys[] = {
    {.key = "address",
     .kind = Kind::register_address,
     .required = true,
     .description = "Of the holding register, as on the wire: the first one is 0. Decimal or hexadecimal.",
     .example = "0x0100",
     .minimum = 0,
     .maximum = 65535,
     .field = field([](auto& t) -> auto& { return t.device_value->address; })},
    {.key = "type",
     .kind = Kind::choice,
     .description = "How the value lies in the registers; 32 bits take two, high word first.",
     .example = "i32",
     .default_value = "u16",
     .choices = register_types,
     .field = type_field},
    scale_key,
    unit_key,
    access_key,
};

constexpr KeySpec object_keys[] = {
    {.key = "object",
     .kind = Kind::text,
     .required = true,
     .description = "Index and sub-index, both hexadecimal.",
     .example = "6401h:01",
     .pattern = "[0-9A-Fa-f]{4}h:[0-9A-Fa-f]{2}",
     .pattern_hint = "write INDEXh:SUB, both hexadecimal, such as 6401h:01",
     .field = {
         .apply = [](Target& t, const Value& v) { t.device_value->address = *parse_object_address(v.text); },
         .show = [](const Target& t) { return to_text(t.device_value->address); }}},
    {.key = "type",
     .kind = Kind::choice,
     .required = true,
     .description = "Of the object; its size must be right, too.",
     .example = "i32",
     .choices = object_types,
     .field = type_field},
    scale_key,
    unit_key,
    access_key,
};

constexpr KeySpec device_keys[] = {
    {.key = "bus",
     .kind = Kind::text,
     .required = true,
     .description = "Name of the bus that the device is on.",
     .example = "line-b",
     .pattern = name_pattern,
     .pattern_hint = "write the name of one of the buses",
     .field = field([](auto& t) -> auto& { return t.device->bus; })},
    {.key = "node",
     .kind = Kind::integer,
     .required = true,
     .description = "Address of the device on its bus.",
     .example = "21",
     .minimum = 1,
     .maximum = 247,  // Modbus over serial line 2.2
     .field = field([](auto& t) -> auto& { return t.device->node; })},
    {.key = "model",
     .kind = Kind::choice,
     .required = true,
     .description = "modbus-generic: holding registers by name; canopen-generic: objects by name.",
     .example = "modbus-generic",
     .choices = models,
     .field = choice_field([](auto& t) -> auto& { return t.device->kind; })},
    {.key = "poll",
     .kind = Kind::duration,
     .description = "How often its values are read.",
     .example = "250 ms",
     .default_value = "500 ms",
     .minimum = 10,
     .maximum = 3'600'000,
     .field = field([](auto& t) -> auto& { return t.device->poll; })},
    {.key = "turnaround_max",
     .kind = Kind::duration,
     .description = "RS-485: longest time that this device takes before the first byte of its reply. "
                    "Default: its line's.",
     .example = "60 ms",
     .minimum = 1,
     .maximum = 1000,
     .field = field([](auto& t) -> auto& { return t.device->turnaround_max; })},
    {.key = "registers",
     .kind = Kind::named_sections,
     .description = "Of modbus-generic: its registers, by name.",
     .children = register_keys,
     .field = values_of<BusKind::modbus_rtu>()},
    {.key = "objects",
     .kind = Kind::named_sections,
     .description = "Of canopen-generic: its objects, by name.",
     .children = object_keys,
     .field = values_of<BusKind::canopen>()},
};

}  // namespace

std::span<const KeySpec> device_schema() { return device_keys; }

}  // namespace axisd::config
