// The persistent state, as a disk may give it back.
#include <fmt/format.h>

#include <string>

#include "daemon/store/state_text.hpp"
#include "tests/fuzz/target.hpp"

namespace axisd::fuzz {
namespace {

void decode(std::string_view bytes) {
  (void)store::newer_format(bytes);
  const auto decoded = store::decode(bytes);
  if (decoded) expect(store::encode(*decoded) == bytes, "what is accepted is what encode() produces");
}

}  // namespace

void run(Input input) {
  const auto bytes = text(input.rest());
  decode(bytes);
  // With its checksum right, the content is looked at, too.
  decode(fmt::format("{}crc32 {:08x}\n", bytes, store::crc32(bytes)));
}

}  // namespace axisd::fuzz
