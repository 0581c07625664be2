#include "config/schema.hpp"

// The keys of nodes that are not axes. What depends on other keys is in device_checks.cpp.
namespace axisd::config {

namespace {

constexpr std::string_view models[] = {"modbus-generic"};
constexpr std::string_view types[] = {"u16", "i16", "u32", "i32", "f32"};  // in the order of RegisterType
constexpr std::string_view accesses[] = {"ro", "rw"};

constexpr KeySpec register_keys[] = {
    {.key = "address",
     .kind = Kind::register_address,
     .required = true,
     .description = "Of the holding register, as on the wire: the first one is 0. Decimal or hexadecimal.",
     .example = "0x0100",
     .minimum = 0,
     .maximum = 65535,
     .apply = [](Target& t,
                 const Value& v) { t.device_register->address = static_cast<std::uint16_t>(v.integer); }},
    {.key = "type",
     .kind = Kind::choice,
     .description = "How the value lies in the registers; 32 bits take two, high word first.",
     .example = "i32",
     .default_value = "u16",
     .choices = types,
     .apply =
         [](Target& t, const Value& v) {
           t.device_register->type = static_cast<RegisterType>(choice_index(types, v.text));
         }},
    {.key = "scale",
     .kind = Kind::number,
     .description = "Value = register x scale.",
     .example = "0.1",
     .default_value = "1",
     .apply = [](Target& t, const Value& v) { t.device_register->scale = v.number; }},
    {.key = "unit",
     .kind = Kind::text,
     .description = "Of the value; only shown.",
     .example = "degC",
     .pattern = "[A-Za-z%][A-Za-z0-9%/*^._-]{0,15}",
     .pattern_hint = "use up to 16 letters, digits or any of % / * ^ . _ -, such as degC or l/min",
     .apply = [](Target& t, const Value& v) { t.device_register->unit = v.text; }},
    {.key = "access",
     .kind = Kind::choice,
     .description = "rw: may be written, too.",
     .example = "rw",
     .default_value = "ro",
     .choices = accesses,
     .apply = [](Target& t, const Value& v) { t.device_register->writable = v.text == "rw"; }},
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
     .description = "modbus-generic: holding registers by name.",
     .example = "modbus-generic",
     .choices = models},
    {.key = "poll",
     .kind = Kind::duration,
     .description = "How often the registers are read.",
     .example = "250 ms",
     .default_value = "500 ms",
     .minimum = 10,
     .maximum = 3'600'000,
     .apply = [](Target& t, const Value& v) { t.device->poll = v.duration; }},
    {.key = "registers",
     .kind = Kind::named_sections,
     .required = true,
     .description = "The device's registers, by name.",
     .children = register_keys,
     .apply =
         [](Target& t, const Value& v) {
           t.device_register = &t.device->registers.emplace_back();
           t.device_register->name = v.text;
         }},
};

}  // namespace

std::span<const KeySpec> device_schema() { return device_keys; }

}  // namespace axisd::config
