#include "devices/yako_rtu/register_blocks.hpp"

#include <algorithm>

namespace axisd::yako_rtu {

namespace {

constexpr int longest_read = 16;

}  // namespace

std::int64_t number_of(const ParameterSpec& parameter, std::uint16_t word) {
  return is_signed(parameter.type) ? static_cast<std::int16_t>(word) : word;
}

std::vector<RegisterBlock> blocks_of(std::vector<std::uint16_t> addresses,
                                     const std::function<bool(std::uint32_t)>& readable) {
  std::ranges::sort(addresses);
  std::vector<RegisterBlock> blocks;
  for (const auto address : addresses) {
    if (!readable(address)) continue;
    if (!blocks.empty()) {
      auto& last = blocks.back();
      std::uint32_t next = last.address + last.count;
      while (next <= address && readable(next)) ++next;
      const auto length = address + 1 - last.address;
      if (next > address && length <= longest_read) {
        last.count = std::max(last.count, static_cast<std::uint16_t>(length));
        continue;
      }
    }
    blocks.push_back({.address = address, .count = 1});
  }
  return blocks;
}

}  // namespace axisd::yako_rtu
