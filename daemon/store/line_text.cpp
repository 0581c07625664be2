#include "daemon/store/line_text.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>

namespace axisd::store {
namespace {

constexpr std::array<std::uint32_t, 256> crc_table = [] {
  std::array<std::uint32_t, 256> table{};
  for (std::uint32_t i = 0; i < table.size(); ++i) {
    std::uint32_t value = i;
    for (int bit = 0; bit < 8; ++bit) value = (value >> 1U) ^ ((value & 1U) != 0 ? 0xEDB88320U : 0U);
    table[i] = value;
  }
  return table;
}();

}  // namespace

std::uint32_t crc32(std::string_view bytes) {
  std::uint32_t crc = 0xFFFFFFFFU;
  for (const char c : bytes) crc = (crc >> 8U) ^ crc_table[(crc ^ static_cast<unsigned char>(c)) & 0xFFU];
  return ~crc;
}

bool plain(char c) {
  return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9') ||
         std::string_view("_-.:@/").contains(c);
}

std::string escape(std::string_view text) {
  std::string out;
  out.reserve(text.size());
  for (const char c : text) {
    if (plain(c))
      out += c;
    else
      out += fmt::format("%{:02x}", static_cast<unsigned char>(c));
  }
  return out;
}

std::string mark_text(const ContinuityMark& mark) {
  static const ContinuityMark none(6, 0);
  return fmt::format("{:04x}", fmt::join(mark.empty() ? none : mark, "."));
}

bool LineReader::mark(ContinuityMark& value) {
  value.clear();
  do {
    if (value.size() == longest_mark || !number(value.emplace_back(), 16)) return false;
  } while (literal("."));
  if (std::ranges::all_of(value, [](auto word) { return word == 0; })) value.clear();
  return true;
}

bool LineReader::word(std::string& value) {
  value.clear();
  while (!rest_.empty() && (plain(rest_.front()) || rest_.front() == '%')) {
    if (!literal("%")) {
      value += rest_.front();
      rest_.remove_prefix(1);
      continue;
    }
    unsigned char byte = 0;
    const auto digits = rest_.substr(0, 2);
    const auto [end, error] = std::from_chars(digits.data(), digits.data() + digits.size(), byte, 16);
    if (error != std::errc{} || end != digits.data() + 2) return false;
    value += static_cast<char>(byte);
    rest_.remove_prefix(2);
  }
  return true;
}

}  // namespace axisd::store
