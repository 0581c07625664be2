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
  DataType type = DataType::domain;
  Access access = Access::read_write;
  bool mappable = false;
  std::optional<EdsNumber> low{}, high{}, initial{};  ///< of integers and booleans
  std::optional<double> real_initial{};               ///< of real types
  std::string text_initial{};                         ///< of other types, as it stands in the file
};

struct Eds {
  std::string vendor_name, product_name;
  std::optional<std::uint32_t> vendor{}, product{}, revision{};
  std::map<Object, EdsObject> objects;
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
inline constexpr std::size_t eds_size_limit = 4U << 20U, eds_object_limit = 65536, eds_problem_limit = 50;

/// Reads an EDS; or everything that is wrong with it, up to eds_problem_limit problems in the order of lines.
/// Numbers are decimal, octal (0...) or hexadecimal (0x...), as CiA 306 has them. Pure.
std::expected<Eds, std::vector<EdsProblem>> parse_eds(std::string_view text);

/// Reads the file. Errors (invalid_argument) name it, with "file:line: problem" for each problem. It blocks:
/// never on the core thread after start-up.
Result<Eds> load_eds(const std::string& path);

}  // namespace axisd::canopen
