#include "api/server/serial_format.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>

namespace axisd::server {
namespace {

using modbus_rtu::Format;
using modbus_rtu::Parity;

char letter(Parity parity) {
  switch (parity) {
    case Parity::even:
      return 'E';
    case Parity::odd:
      return 'O';
    case Parity::none:
      return 'N';
  }
  return '?';
}

// With parity there is no room for a second stop bit in the eleven bits of an RTU character.
constexpr std::array formats{Format{Parity::none, 1}, Format{Parity::none, 2}, Format{Parity::even, 1},
                             Format{Parity::odd, 1}};

}  // namespace

Result<Format> parse_format(std::string_view text) {
  const auto found = std::ranges::find(formats, text, to_text);
  if (found != formats.end()) return *found;
  return fail(Reason::invalid_argument, fmt::format("{:?} is no serial format", text.substr(0, 16)),
              "permitted: 8N1, 8N2, 8E1, 8O1");
}

std::string to_text(Format format) { return fmt::format("8{}{}", letter(format.parity), format.stop_bits); }

}  // namespace axisd::server
