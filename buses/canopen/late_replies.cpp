#include "buses/canopen/late_replies.hpp"

#include <array>

namespace axisd::canopen {

std::optional<Object> LateReplies::probe(TimePoint now) const {
  // Mandatory for every node (CiA 301 7.5.1), then sub-indices that do not exist: their abort names them.
  static constexpr std::array<Object, 4> mandatory{{{0x1000, 0}, {0x1001, 0}, {0x1018, 0}, {0x1018, 1}}};
  for (const auto object : mandatory)
    if (!may_come(object, now)) return object;
  for (std::uint8_t sub = 1; sub < 0xFF; ++sub)
    if (const Object object{0x1000, sub}; !may_come(object, now)) return object;
  return std::nullopt;
}

}  // namespace axisd::canopen
