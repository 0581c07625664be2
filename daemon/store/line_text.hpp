// Words of the store's files: pure functions.
#pragma once

#include <charconv>
#include <cstdint>
#include <string>
#include <string_view>

#include "devices/drive_values.hpp"

namespace axisd::store {

/// CRC-32 as in IEEE 802.3: finds every error burst of up to 32 bits, so every flipped bit.
std::uint32_t crc32(std::string_view bytes);

/// Free text as one word: whatever could end a word or a line is written as %XX.
std::string escape(std::string_view text);
/// Words in hexadecimal with points between them; none at all as six zeros, which releases before this one
/// need.
std::string mark_text(const ContinuityMark& mark);
/// Is written as itself.
bool plain(char c);

/// Reads the text from the front; after the first mismatch everything fails.
class LineReader {
 public:
  explicit LineReader(std::string_view rest) : rest_(rest) {}

  bool literal(std::string_view text) {
    if (!rest_.starts_with(text)) return false;
    rest_.remove_prefix(text.size());
    return true;
  }
  template <class Integer>
  bool number(Integer& value, int base = 10) {
    const auto [end, error] = std::from_chars(rest_.data(), rest_.data() + rest_.size(), value, base);
    if (error != std::errc{}) return false;
    rest_.remove_prefix(static_cast<std::size_t>(end - rest_.data()));
    return true;
  }
  /// As escape() writes it; may be empty.
  bool word(std::string& value);
  bool flag(bool& value) {
    unsigned digit = 0;
    if (!number(digit) || digit > 1) return false;
    value = digit == 1;
    return true;
  }
  /// As {:a} writes it.
  bool real(double& value) {
    const bool negative = literal("-");
    if (!literal("0x")) return false;
    const auto [end, error] =
        std::from_chars(rest_.data(), rest_.data() + rest_.size(), value, std::chars_format::hex);
    if (error != std::errc{}) return false;
    rest_.remove_prefix(static_cast<std::size_t>(end - rest_.data()));
    if (negative) value = -value;
    return true;
  }
  /// As mark_text() writes it.
  bool mark(ContinuityMark& value);
  [[nodiscard]] bool at_end() const { return rest_.empty(); }

 private:
  std::string_view rest_;
};

}  // namespace axisd::store
