#include "config/quantity.hpp"
#include "config/schema.hpp"

// The keys of nodes that are not axes. What depends on other keys is in device_checks.cpp.
namespace axisd::config {

namespace {

constexpr std::string_view models[] = {"modbus-generic", "canopen-generic"};  // in the order of BusKind
constexpr std::string_view object_types[] = {"u16", "i16", "u32", "i32", "f32", "u8", "i8"};  // of ValueType
constexpr std::span<const std::string_view> register_types = std::span(object_types).first(5);
constexpr std::string_view accesses[] = {"ro", "rw"};

void set_type(Target& t, const Value& v) {
  t.device_value->type = static_cast<ValueType>(choice_index(object_types, v.text));
}

// What registers and objects have alike.
constexpr KeySpec scale_key{.key = "scale",
                            .kind = Kind::number,
                            .description = "Value = raw number x scale.",
                            .example = "0.1",
                            .default_value = "1",
                            .apply = [](Target& t, const Value& v) { t.device_value->scale = v.number; }};
constexpr KeySpec unit_key{
    .key = "unit",
    .kind = Kind::text,
    .description = "Of the value; only shown.",
    .example = "degC",
    .pattern = "[A-Za-z%][A-Za-z0-9%/*^._-]{0,15}",
    .pattern_hint = "use up to 16 letters, digits or any of % / * ^ . _ -, such as degC or l/min",
    .apply = [](Target& t, const Value& v) { t.device_value->unit = v.text; }};
constexpr KeySpec access_key{
    .key = "access",
    .kind = Kind::choice,
    .description = "rw: may be written, too.",
    .example = "rw",
    .default_value = "ro",
    .choices = accesses,
    .apply = [](Target& t, const Value& v) { t.device_value->writable = v.text == "rw"; }};

void add_value(Target& t, const Value& v) {
  t.device_value = &t.device->values.emplace_back();
  t.device_value->name = v.text;
}

constexpr KeySpec register_keys[] = {
    {.key = "address",
     .kind = Kind::register_address,
     .required = true,
     .description = "Of the holding register, as on the wire: the first one is 0. Decimal or hexadecimal.",
     .example = "0x0100",
     .minimum = 0,
     .maximum = 65535,
     .apply = [](Target& t,
                 const Value& v) { t.device_value->address = static_cast<std::uint16_t>(v.integer); }},
    {.key = "type",
     .kind = Kind::choice,
     .description = "How the value lies in the registers; 32 bits take two, high word first.",
     .example = "i32",
     .default_value = "u16",
     .choices = register_types,
     .apply = &set_type},
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
     .apply = [](Target& t, const Value& v) { t.device_value->address = *parse_object_address(v.text); }},
    {.key = "type",
     .kind = Kind::choice,
     .required = true,
     .description = "Of the object; its size must be right, too.",
     .example = "i32",
     .choices = object_types,
     .apply = &set_type},
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
     .apply = [](Target& t, const Value& v) { t.device->bus = v.text; }},
    {.key = "node",
     .kind = Kind::integer,
     .required = true,
     .description = "Address of the device on its bus.",
     .example = "21",
     .minimum = 1,
     .maximum = 247,  // Modbus over serial line 2.2
     .apply = [](Target& t, const Value& v) { t.device->node = static_cast<std::uint8_t>(v.integer); }},
    {.key = "model",
     .kind = Kind::choice,
     .required = true,
     .description = "modbus-generic: holding registers by name; canopen-generic: objects by name.",
     .example = "modbus-generic",
     .choices = models,
     .apply = [](Target& t,
                 const Value& v) { t.device->kind = static_cast<BusKind>(choice_index(models, v.text)); }},
    {.key = "poll",
     .kind = Kind::duration,
     .description = "How often its values are read.",
     .example = "250 ms",
     .default_value = "500 ms",
     .minimum = 10,
     .maximum = 3'600'000,
     .apply = [](Target& t, const Value& v) { t.device->poll = v.duration; }},
    {.key = "turnaround_max",
     .kind = Kind::duration,
     .description = "RS-485: longest time that this device takes before the first byte of its reply. "
                    "Default: its line's.",
     .example = "60 ms",
     .minimum = 1,
     .maximum = 1000,
     .apply = [](Target& t, const Value& v) { t.device->turnaround_max = v.duration; }},
    {.key = "registers",
     .kind = Kind::named_sections,
     .description = "Of modbus-generic: its registers, by name.",
     .children = register_keys,
     .apply = &add_value},
    {.key = "objects",
     .kind = Kind::named_sections,
     .description = "Of canopen-generic: its objects, by name.",
     .children = object_keys,
     .apply = &add_value},
};

}  // namespace

std::span<const KeySpec> device_schema() { return device_keys; }

}  // namespace axisd::config
