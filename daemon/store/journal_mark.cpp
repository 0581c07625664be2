#include "daemon/store/journal_mark.hpp"

#include <fmt/format.h>

#include "daemon/store/line_text.hpp"

namespace axisd::store {

std::string encode_mark(const JournalMark& mark) {
  const auto text = fmt::format("axisd-mark 1 pair={} journal_line={:020}", escape(mark.pair), mark.line);
  return fmt::format("{} crc32={:08x}\n", text, crc32(text));
}

std::optional<JournalMark> decode_mark(std::string_view text) {
  JournalMark mark;
  LineReader reader(text);
  if (!reader.literal("axisd-mark 1 pair=") || !reader.word(mark.pair) || !reader.literal(" journal_line=") ||
      !reader.number(mark.line) || encode_mark(mark) != text)
    return std::nullopt;
  return mark;
}

}  // namespace axisd::store
