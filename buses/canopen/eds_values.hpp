// Values of an EDS file, one by one. Used by eds.cpp.
#pragma once

#include <optional>
#include <string>
#include <string_view>

#include "buses/canopen/eds.hpp"

namespace axisd::canopen {

std::string lower_case(std::string_view text);
std::string_view trimmed(std::string_view text);
/// What may be shown of a file's text: CiA 306 has ASCII, but files come with an editor's code page, or
/// damaged. Anything else is a '?', and the end of a long text is left out.
std::string printable(std::string_view text);

/// Decimal, octal (0...; decimal where it has an 8 or a 9) or hexadecimal (0x...), with a sign; nothing: not
/// a number, or beyond 64 bits. Numbers above the largest signed one wrap.
std::optional<std::int64_t> parse_integer(std::string_view text);
/// A constant, "$NODEID" (also without its sign), or a sum of constants and one of these in any order.
std::optional<EdsNumber> parse_number(std::string_view text);
/// The same, read as `type`: 0x80000000 of an INTEGER32 is negative. Nothing also where the type cannot hold
/// it.
std::optional<EdsNumber> parse_number(std::string_view text, DataType type);
std::optional<double> parse_real(std::string_view text);
/// As CiA 306 has it, or in words: "RO", "r/w", "read only".
std::optional<Access> parse_access(std::string_view text);

/// What CiA 306 calls the object code.
enum class ObjectKind : std::uint8_t { null, domain, type_definition, variable, composed };
/// Its number, or its name ("VAR").
std::optional<ObjectKind> parse_object_kind(std::string_view text);
/// Its number, or its name ("UNSIGNED32").
std::optional<DataType> parse_data_type(std::string_view text);
/// 0 or 1, or in words.
std::optional<bool> parse_flag(std::string_view text);

/// What the name of a section stands for: an object ("6040", "1018sub1", "0x1018 sub 1"); nothing: something
/// else.
struct ObjectSection {
  Object object;
  bool has_sub = false;
};
std::optional<ObjectSection> parse_object_section(std::string_view name);

}  // namespace axisd::canopen
