// One target each file: run() takes bytes that anybody may have sent, and must come back. A violated
// expectation ends the program, as a fault that a sanitizer finds does.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <string_view>

namespace axisd::fuzz {

/// Bytes, taken from the front; behind their end are zeros.
class Input {
 public:
  explicit Input(std::span<const std::uint8_t> bytes) : bytes_(bytes) {}

  std::uint8_t byte() {
    if (bytes_.empty()) return 0;
    const auto first = bytes_.front();
    bytes_ = bytes_.subspan(1);
    return first;
  }
  std::uint16_t word() {
    const auto high = byte();
    return static_cast<std::uint16_t>(high << 8U | byte());
  }
  std::span<const std::uint8_t> take(std::size_t most) {
    const auto taken = bytes_.first(most < bytes_.size() ? most : bytes_.size());
    bytes_ = bytes_.subspan(taken.size());
    return taken;
  }
  std::span<const std::uint8_t> rest() { return take(bytes_.size()); }
  [[nodiscard]] bool empty() const { return bytes_.empty(); }

 private:
  std::span<const std::uint8_t> bytes_;
};

inline std::string_view text(std::span<const std::uint8_t> bytes) {
  return {reinterpret_cast<const char*>(bytes.data()), bytes.size()};
}

/// Ends the program if it is not so.
void expect(bool is_so, std::string_view what);

/// The target.
void run(Input input);

}  // namespace axisd::fuzz
