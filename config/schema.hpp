// The definition of the file, as data. Loader, suggestions, JSON Schema and tests walk it; README.md says how
// to add a key.
#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <string_view>

#include "config/configuration.hpp"

namespace axisd::config {

enum class Kind : std::uint8_t {
  section,         ///< `children` under fixed keys
  named_sections,  ///< any number of sections with `children`, under names
  terminals,       ///< terminals of the model: function, or {function, active}
  model_settings,  ///< keys of the model's descriptor
  text,            ///< matches `pattern`, at most longest_text_value characters
  model,           ///< name of a drive model
  integer,         ///< minimum..maximum
  boolean,
  choice,          ///< one of `choices`
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
  std::string text = {};     ///< text, choice
  std::int64_t integer = 0;  ///< integer, motor_speed (r/min), microstep
  bool boolean = false;
  double number = 0;                            ///< position, velocity; first of a position_range
  double second = 0;                            ///< of a position_range
  std::int64_t numerator = 0, denominator = 1;  ///< ratio, travel
  Duration duration{};
};

/// Where values go. `bus`, `axis` and `terminal` are set inside of one.
struct Target {
  Configuration* configuration = nullptr;
  modbus_rtu::LineSettings* bus = nullptr;
  AxisEntry* axis = nullptr;
  TerminalSettings* terminal = nullptr;
};

struct KeySpec {
  std::string_view key;
  Kind kind = Kind::text;
  bool required = false;
  std::string_view description = {};
  std::string_view example = {};  ///< as written in YAML; never the default
  std::string_view default_value =
      {};  ///< as written in YAML; empty if there is none or the description says it
  std::optional<double> minimum = std::nullopt, maximum = std::nullopt;
  bool above_minimum = false;  ///< the minimum itself is excluded
  std::span<const std::string_view> choices = {};
  std::string_view pattern = {};       ///< of a text: ECMAScript regular expression, whole text
  std::string_view pattern_hint = {};  ///< what to say when it does not match
  std::span<const KeySpec> children = {};
  /// Stores a value; of a section: prepares it. Of named_sections: unused. nullptr: nothing to store.
  void (*apply)(Target&, const Value&) = nullptr;
};

/// The keys of the file's top level.
std::span<const KeySpec> schema();
/// The keys of one axis, in the order in which they are read: unit and model come before what depends on
/// them.
std::span<const KeySpec> axis_schema();
/// Names of buses, axes and the machine.
inline constexpr std::string_view name_pattern = "[a-z][a-z0-9_-]*";
inline constexpr std::size_t longest_name = 64;
inline constexpr std::size_t longest_text_value = 255;
/// Where a choice stands in its list. Precondition: it does.
std::size_t choice_index(std::span<const std::string_view> choices, std::string_view choice);
/// Spellings of HomingMethod, in its order.
std::span<const std::string_view> homing_methods();

}  // namespace axisd::config
