#include "api/server/parameter_type.hpp"

namespace axisd::server {

v1::ParameterType to_proto(ParameterType type) {
  switch (type) {  // the contract grew: its numbers are not in order of size
    case ParameterType::u8:
      return v1::PARAMETER_TYPE_UINT8;
    case ParameterType::i8:
      return v1::PARAMETER_TYPE_INT8;
    case ParameterType::u16:
      return v1::PARAMETER_TYPE_UINT16;
    case ParameterType::i16:
      return v1::PARAMETER_TYPE_INT16;
    case ParameterType::u32:
      return v1::PARAMETER_TYPE_UINT32;
    case ParameterType::i32:
      return v1::PARAMETER_TYPE_INT32;
  }
  return v1::PARAMETER_TYPE_UNSPECIFIED;
}
std::optional<ParameterType> from_proto(v1::ParameterType type) {
  for (const auto known : {ParameterType::u8, ParameterType::i8, ParameterType::u16, ParameterType::i16,
                           ParameterType::u32, ParameterType::i32})
    if (to_proto(known) == type) return known;
  return std::nullopt;
}

std::size_t size_of(v1::ParameterType type) {
  const auto known = from_proto(type);
  return known ? axisd::size_of(*known) : 0;
}

bool is_signed(v1::ParameterType type) {
  const auto known = from_proto(type);
  return known && axisd::is_signed(*known);
}

}  // namespace axisd::server
