// The definition of the file, as data. Loader, suggestions, JSON Schema and tests walk it; README.md says how
// to add a key.
#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "config/configuration.hpp"

namespace axisd::config {

enum class Kind : std::uint8_t {
  section,            ///< `children` under fixed keys
  named_sections,     ///< any number of sections with `children`, under names
  numbered_sections,  ///< the same under numbers, minimum..maximum
  terminals,          ///< terminals of the model: function, or {function, active}
  model_settings,     ///< keys of the model's descriptor
  model_objects,      ///< of these: sections with `children`, under objects of the model's file
  text,               ///< matches `pattern`, at most longest_text_value characters
  model,              ///< name of a drive model
  integer,            ///< minimum..maximum
  register_address,   ///< 256 or 0x0100; minimum..maximum
  number,             ///< "-0.1": a decimal number without unit, not 0
  boolean,
  choice,          ///< one of `choices`; with a maximum also a whole number, minimum..maximum
  names,           ///< a list of at least two names, each once
  roles,           ///< for each of some clients, whose names match `pattern`, one of `choices`
  parts,           ///< true (all `choices`), false (none), or a list of some of them
  duration,        ///< "150 ms"; minimum..maximum in ms
  motor_speed,     ///< "5 r/min"; whole numbers
  microstep,       ///< "10000 pulses/rev"
  ratio,           ///< "10/1"
  travel,          ///< "5 mm/rev"; the axis's unit
  position,        ///< "12 mm" or 12; the axis's unit
  position_range,  ///< [0, 400]
  velocity,        ///< "50 mm/s"; the axis's unit per second
};

/// A value as read, in the form that its kind has.
struct Value {
  std::string text = {};     ///< text, choice; name of a named section
  std::int64_t integer = 0;  ///< integer, register_address, motor_speed (r/min), microstep; of a numbered
                             ///< section; of a choice where it stands in its list
  bool boolean = false;
  std::vector<std::string> items = {};  ///< parts, names
  Roles roles = {};
  double number = 0;                            ///< number, position, velocity; first of a position_range
  double second = 0;                            ///< of a position_range
  std::int64_t numerator = 0, denominator = 1;  ///< ratio, travel
  Duration duration{};
};

/// Where values go. All but `configuration` are set inside of one only.
struct Target {
  Configuration* configuration = nullptr;
  std::string bus_name = {};
  modbus_rtu::LineSettings* line = nullptr;
  canopen::NetworkSettings* network = nullptr;
  AxisEntry* axis = nullptr;
  TerminalSettings* terminal = nullptr;
  PositionSegment* position_segment = nullptr;
  VelocitySegment* velocity_segment = nullptr;
  DeviceSettings* device = nullptr;
  GroupSettings* group = nullptr;
  std::string access_axis = {};  ///< or group
  ValueSettings* device_value = nullptr;
  std::string object = {};  ///< of `drive: { objects: ... }`: its settings begin with this
};

/// Inside of one section.
struct NamedTarget {
  std::string name;  ///< or number; empty: it has none
  Target target;
};

/// How a key is tied to its place in the configuration; config/field.hpp makes them.
struct Field {
  /// Stores a value; of a section: prepares it; of named and numbered ones: prepares each, by its `text` or
  /// `integer`. nullptr: nothing to store.
  void (*apply)(Target&, const Value&) = nullptr;
  /// The value there as text: equal exactly for equal values, defaults included. Not of sections.
  std::string (*show)(const Target&) = nullptr;
  /// The sections that there are. nullptr: the one, always.
  std::vector<NamedTarget> (*inside)(const Target&) = nullptr;
};

struct KeySpec {
  std::string_view key;
  Kind kind = Kind::text;
  bool required = false;
  bool may_be_empty = false;   ///< of named_sections
  bool one_of = false;         ///< of named_sections: each has exactly one of the `children`
  bool above_minimum = false;  ///< the minimum itself is excluded
  std::string_view description = {};
  std::string_view example = {};  ///< as written in YAML; never the default
  std::string_view default_value =
      {};  ///< as written in YAML; empty if there is none or the description says it
  std::optional<double> minimum = std::nullopt, maximum = std::nullopt;
  std::span<const std::string_view> choices = {};
  std::string_view pattern = {};       ///< of a text, names, roles: ECMAScript regular expression, whole text
  std::string_view pattern_hint = {};  ///< what to say when it does not match
  std::span<const KeySpec> children = {};
  Field field = {};
};

/// The keys of the file's top level.
std::span<const KeySpec> schema();
/// The keys of `access`.
std::span<const KeySpec> access_schema();
/// The keys of one bus.
std::span<const KeySpec> bus_schema();
/// The keys of one axis, in the order in which they are read: unit and model come before what depends on
/// them.
std::span<const KeySpec> axis_schema();
/// The keys of an axis's `homing`.
std::span<const KeySpec> homing_schema();
/// The keys of an axis's `segments`.
std::span<const KeySpec> segment_schema();
/// The keys of one device that is not an axis.
std::span<const KeySpec> device_schema();
/// Names of buses, axes and the machine.
inline constexpr std::string_view name_pattern = "[a-z][a-z0-9_-]*";
inline constexpr std::size_t longest_name = 64;
inline constexpr std::size_t longest_text_value = 255;
/// Where a choice stands in its list. Precondition: it does.
std::size_t choice_index(std::span<const std::string_view> choices, std::string_view choice);
/// Spellings of HomingMethod, in its order.
std::span<const std::string_view> homing_methods();
/// Parts of `persist`.
inline constexpr std::string_view persist_parts[] = {"terminals", "segments", "homing", "drive"};

}  // namespace axisd::config
