// The files of ids that the journal leaves behind, as a disk may give them back.
#include "daemon/store/id_blocks.hpp"

#include <cstdint>
#include <string>
#include <string_view>

#include "daemon/store/line_text.hpp"
#include "tests/fuzz/target.hpp"

namespace axisd::fuzz {
namespace {

void decode(std::string_view bytes) {
  const auto decoded = store::decode_ids(bytes);
  expect(decoded.good <= bytes.size(), "what is intact is part of the file");
  expect(decoded.good > 0 || decoded.runs.empty(), "what is damaged says nothing");
  const auto encoded = store::encode_ids(decoded.runs);
  const auto again = store::decode_ids(encoded);
  expect(again.good == encoded.size() && store::encode_ids(again.runs) == encoded,
         "what is read survives being written");
}

}  // namespace

void run(Input input) {
  const auto bytes = text(input.rest());
  decode(bytes);
  // With its length and checksum right, the content is looked at, too.
  std::string block;
  for (const auto word : {static_cast<std::uint32_t>(bytes.size()), store::crc32(bytes)})
    block.append(reinterpret_cast<const char*>(&word), sizeof word);
  decode(block.append(bytes));
}

}  // namespace axisd::fuzz
