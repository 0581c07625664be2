// The command journal, as a disk may give it back.
#include <fmt/format.h>

#include <string>
#include <string_view>

#include "daemon/store/journal_model.hpp"
#include "daemon/store/journal_text.hpp"
#include "daemon/store/line_text.hpp"
#include "tests/fuzz/target.hpp"

namespace axisd::fuzz {
namespace {

/// Without its end.
std::string_view take_line(std::string_view& rest) {
  const auto end = rest.find('\n');
  const auto line = rest.substr(0, end);
  rest = end == std::string_view::npos ? std::string_view{} : rest.substr(end + 1);
  return line;
}

}  // namespace

void run(Input input) {
  store::JournalModel model;
  for (auto rest = text(input.rest()); !rest.empty();) {
    // With its checksum right, the content is looked at, too.
    const auto line = take_line(rest);
    auto decoded = store::decode_line(line);
    if (!decoded) decoded = store::decode_line(fmt::format("{:08x} {}", store::crc32(line), line));
    if (!decoded) continue;
    const auto encoded = store::encode_line(decoded->number, decoded->line);
    expect(encoded.ends_with('\n'), "a line has an end");
    const auto again = store::decode_line(std::string_view(encoded).substr(0, encoded.size() - 1));
    expect(again && store::encode_line(again->number, again->line) == encoded,
           "a line survives being written");
    model.apply(decoded->line);
  }
  for (const auto& line : model.lines()) (void)store::encode_line(1, line);
  (void)model.content();
}

}  // namespace axisd::fuzz
