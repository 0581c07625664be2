// Electronic data sheets (CiA 306-1): the object dictionary of a device from an EDS or DCF file.
#pragma once

#include <expected>
#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "buses/canopen/object.hpp"
#include "buses/error.hpp"

namespace axisd::canopen {

enum class Access : std::uint8_t {
  read_only,
  write_only,
  read_write,
  read_write_input,   ///< rwr: goes into a TPDO when mapped
  read_write_output,  ///< rww: comes out of an RPDO when mapped
  constant,
};
[[nodiscard]] constexpr bool readable(Access access) { return access != Access::write_only; }
[[nodiscard]] constexpr bool writable(Access access) {
  return access != Access::read_only && access != Access::constant;
}

/// A number of the file: a constant, to which $NODEID may be added.
struct EdsNumber {
  std::int64_t value = 0;  ///< as the type of the object has it (signed types: two's complement is resolved)
  bool plus_node_id = false;
  [[nodiscard]] std::int64_t resolved(std::uint8_t node) const { return plus_node_id ? value + node : value; }
  friend bool operator==(const EdsNumber&, const EdsNumber&) = default;
};

struct EdsObject {
  Object object;
  std::string name;
  DataType type = DataType::domain;  ///< also where the file has none that can be read
  Access access = Access::read_write;
  bool mappable = false;
  std::optional<EdsNumber> low{}, high{}, initial{};  ///< of integers and booleans
  std::optional<EdsNumber> configured{};              ///< of a DCF: ParameterValue
  std::optional<double> real_initial{};               ///< of real types
  std::string text_initial{};                         ///< of other types, as it stands in the file
  /// What the object holds by the file: as it is configured, else as it leaves the factory.
  [[nodiscard]] const std::optional<EdsNumber>& known() const { return configured ? configured : initial; }
};

/// What the file says of an object.
enum class EdsPart : std::uint8_t { none, type, access, low, high, value, mapping };

/// A line that contradicts CiA 306, or another line. What it says is left out; the rest of the file stands.
struct EdsFlaw {
  int line = 0;  ///< 1..; 0: not known
  std::string message;
  EdsPart part = EdsPart::none;  ///< which is not known, or doubtful, of `object`; none: nothing is lost
  Object object{};
  std::uint8_t last_sub = 0;  ///< of that index, for entries that are described together
  [[nodiscard]] bool concerns(Object other) const {
    return part != EdsPart::none && other.index == object.index && other.sub >= object.sub &&
           other.sub <= last_sub;
  }
};

struct Eds {
  std::string vendor_name, product_name;
  std::optional<std::uint32_t> vendor{}, product{}, revision{};
  std::map<Object, EdsObject> objects;
  std::vector<EdsFlaw> flaws;  ///< in the order of lines
  [[nodiscard]] const EdsObject* find(Object object) const {
    const auto found = objects.find(object);
    return found == objects.end() ? nullptr : &found->second;
  }
};

struct EdsProblem {
  int line = 0;  ///< 1..; 0: not known
  std::string message;
};

/// Bounds of what is read; beyond them the file is refused.
inline constexpr std::size_t eds_size_limit = 4U << 20U, eds_object_limit = 65536, eds_flaw_limit = 10000,
                             eds_problem_limit = 50;

/// Reads an EDS as makers ship it, with its flaws; or says why it is none, in up to eds_problem_limit
/// problems. Numbers are decimal, octal (0...) or hexadecimal (0x...), as CiA 306 has them. Pure.
std::expected<Eds, std::vector<EdsProblem>> parse_eds(std::string_view text);

/// Reads the file. Errors (invalid_argument) name it, with "file:line: problem" for each problem. It blocks:
/// never on the core thread after start-up.
Result<Eds> load_eds(const std::string& path);

}  // namespace axisd::canopen
