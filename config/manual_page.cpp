// axisd.yaml(5), from the tables that the loader uses, so that it cannot fall behind.
#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <string>
#include <vector>

#include "config/configuration.hpp"
#include "config/quantity.hpp"
#include "config/reader.hpp"
#include "config/roff.hpp"
#include "config/schema.hpp"
#include "config/text.hpp"
#include "devices/descriptor.hpp"

namespace axisd::config {

namespace {

constexpr std::string_view introduction = R"(.SH SYNOPSIS
.I /etc/axisd/axisd.yaml
.SH DESCRIPTION
The file describes one machine to
.BR axisd (8):
its buses, the drives on them as axes, and where clients reach the daemon.
It is YAML.
A key that is not described here, a value out of its range, and what would have no effect are errors:
.B axisctl check
.I FILE
prints all of them at once, each with its place and with what to write instead.
.PP
Times and velocities always have their unit
.RB ( "150 ms" ", " "50 mm/s" ).
Positions and distances are in the unit of their axis, and may leave it out.
Only
.B true
and
.B false
are booleans.
Plain aliases
.RB ( *name )
stand for their value; merge keys, tags and second documents are refused.
Names begin with a lower-case letter, and go on with lower-case letters, digits, hyphens and underscores.
.PP
.B systemctl reload axisd
takes over what has changed: all of the file or nothing, and no axis that moves.
)";

constexpr std::string_view closing = R"(.SH EXAMPLE
One drive on an RS\-485 line, simulated.
With
.B port: /dev/serial/by\-id/...
in place of
.B port: sim
it is a real one.
.PP
.nf
machine: press\-1
buses:
  line\-a:
    modbus_rtu: { port: sim }
axes:
  feeder:
    bus: line\-a
    node: 1
    model: ykd2405pr
    unit: mm
    scale: { microstep: 10000 pulses/rev, travel: 5 mm/rev }
    limits: { position: [0, 400], velocity: 100 mm/s, acceleration_time: 150 ms }
.fi
.SH FILES
.TP
.I /usr/share/doc/axisd/examples/reference.yaml
shows every key.
.TP
.I /usr/share/doc/axisd/examples/demo.yaml
runs without hardware.
.SH SEE ALSO
.BR axisd (8),
.BR axisctl (1)
)";

std::string bold(std::string_view text) { return fmt::format("\\fB{}\\fR", roff(text)); }

/// What a value looks like.
std::string form(const KeySpec& spec) {
  switch (spec.kind) {
    case Kind::section:
      return "section";
    case Kind::named_sections:
      return spec.one_of ? "sections by name, each with one of the keys below" : "sections by name";
    case Kind::numbered_sections:
      return "sections by number";
    case Kind::terminals:
      return "terminals of the model, each with a function, or with { function, active: high or low }";
    case Kind::model_settings:
      return "keys of the model";
    case Kind::model_objects:
      return "sections by object, such as 6084h or 6099h:01, each with some of the keys below";
    case Kind::text:
      return "text";
    case Kind::model:
      return "name of a model";
    case Kind::integer:
      return "whole number";
    case Kind::register_address:
      return "register, decimal or hexadecimal";
    case Kind::number:
      return "number";
    case Kind::boolean:
      return "true or false";
    case Kind::choice:
      return alternatives(spec.choices) + (spec.maximum ? ", or whole number" : "");
    case Kind::names:
      return "list of names";
    case Kind::roles:
      return fmt::format("names of clients, each with its role: {}", alternatives(spec.choices));
    case Kind::parts:
      return fmt::format("true, false, or a list of {}", fmt::join(spec.choices, ", "));
    case Kind::duration:
      return "time in us, ms, s or min";
    case Kind::motor_speed:
      return "speed of the motor in r/min";
    case Kind::microstep:
      return "pulses/rev";
    case Kind::ratio:
      return "ratio";
    case Kind::travel:
      return "unit per revolution";
    case Kind::position:
      return "position or distance";
    case Kind::position_range:
      return "[lowest, highest]";
    case Kind::velocity:
      return "unit per second";
  }
  return {};
}

std::string range(const KeySpec& spec) {
  const auto unit = spec.kind == Kind::duration ? " ms" : spec.kind == Kind::motor_speed ? " r/min" : "";
  const auto bound = [&](double value) { return format_number(value) + unit; };
  const auto least = spec.above_minimum ? "more than" : "at least";
  if (spec.minimum && spec.maximum && !spec.above_minimum)
    return fmt::format("{} to {}", bound(*spec.minimum), bound(*spec.maximum));
  if (spec.minimum && spec.maximum)
    return fmt::format("{} {}, at most {}", least, bound(*spec.minimum), bound(*spec.maximum));
  if (spec.minimum) return fmt::format("{} {}", least, bound(*spec.minimum));
  if (spec.maximum) return fmt::format("at most {}", bound(*spec.maximum));
  return {};
}

std::string entry(const KeySpec& spec) {
  std::string text = fmt::format(".TP\n{}: {}", bold(spec.key), roff(form(spec)));
  if (const auto bounds = range(spec); !bounds.empty()) text += fmt::format(", {}", roff(bounds));
  if (spec.required) text += "; required";
  text += fmt::format("\n{}", roff(spec.description));
  if (!spec.default_value.empty()) text += fmt::format("\nDefault: {}.", bold(spec.default_value));
  if (!spec.example.empty()) text += fmt::format("\nExample: {}.", bold(spec.example));
  return text + "\n";
}

/// The keys of a section, then each section below it under its own heading.
std::string section(std::span<const KeySpec> keys, const std::string& path) {
  std::string text;
  for (const auto& spec : keys) text += entry(spec);
  for (const auto& spec : keys) {
    if (spec.children.empty()) continue;
    auto below = path.empty() ? std::string(spec.key) : fmt::format("{}.{}", path, spec.key);
    if (spec.kind == Kind::named_sections) below += ".NAME";
    if (spec.kind == Kind::numbered_sections) below += ".NUMBER";
    text += fmt::format(".SS {}\n{}\n{}", roff(below), roff(spec.description), section(spec.children, below));
  }
  return text;
}

std::string terminals(std::string_view heading, std::span<const TerminalSpec> list,
                      std::span<const TerminalFunctionSpec> functions) {
  if (list.empty()) return {};
  std::vector<std::string> names;
  for (const auto& terminal : list)
    names.push_back(terminal.function.empty() ? std::string(terminal.name)
                                              : fmt::format("{} ({})", terminal.name, terminal.function));
  std::vector<std::string_view> possible;
  for (const auto& function : functions)
    if (function.unusable.empty()) possible.push_back(function.name);
  return fmt::format(".TP\n{}\n{}.\nFunctions: {}.\n", bold(heading),
                     roff(fmt::format("{}", fmt::join(names, ", "))),
                     roff(fmt::format("{}", fmt::join(possible, ", "))));
}

std::string of_model(const DriveDescriptor& model) {
  std::string text = fmt::format(".SS {}\n{}.\nNodes {} to {}.\n", roff(model.model), roff(model.title),
                                 model.minimum_node, model.maximum_node);
  text += terminals("inputs", model.inputs, model.input_functions);
  text += terminals("outputs", model.outputs, model.output_functions);
  for (const auto& setting : model.settings) {
    auto spec = setting_schema(setting);
    const auto key = fmt::format("drive.{}", setting.key);
    spec.key = key;
    spec.required = setting.required;
    text += entry(spec);
    for (auto child : spec.children) {
      const auto below = fmt::format("{}.OBJECT.{}", key, child.key);
      child.key = below;
      text += entry(child);
    }
  }
  return text;
}

}  // namespace

std::string manual_page() {
  std::string text = fmt::format(
      ".TH AXISD.YAML 5 \"\" \"axisd {}\" \"axisd\"\n.SH NAME\naxisd.yaml \\- configuration of axisd\n{}"
      ".SH KEYS\n{}.SH MODELS\nWhat an axis has by its\n.BR model .\n",
      AXISD_VERSION, introduction, section(schema(), {}));
  for (const auto* model : drive_models()) text += of_model(*model);
  return text + std::string(closing);
}

}  // namespace axisd::config
