#include "devices/generic/register_value.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <bit>
#include <cmath>
#include <limits>
#include <numeric>
#include <utility>

namespace axisd {

namespace {

constexpr int longest_block = 16;  // what the smallest devices permit

struct Bounds {
  double minimum, maximum;
};

template <class T>
constexpr Bounds bounds_of() {
  return {static_cast<double>(std::numeric_limits<T>::lowest()),
          static_cast<double>(std::numeric_limits<T>::max())};
}

Bounds raw_bounds(RegisterType type) {
  switch (type) {
    case RegisterType::u16:
      return bounds_of<std::uint16_t>();
    case RegisterType::i16:
      return bounds_of<std::int16_t>();
    case RegisterType::u32:
      return bounds_of<std::uint32_t>();
    case RegisterType::i32:
      return bounds_of<std::int32_t>();
    case RegisterType::f32:
      return bounds_of<float>();
  }
  return {};
}

}  // namespace

double decode(const RegisterSettings& settings, std::span<const std::uint16_t> raw) {
  const auto wide = register_count(settings.type) == 2 ? std::uint32_t{raw[0]} << 16U | raw[1] : raw[0];
  switch (settings.type) {
    case RegisterType::u16:
    case RegisterType::u32:
      return wide * settings.scale;
    case RegisterType::i16:
      return static_cast<std::int16_t>(raw[0]) * settings.scale;
    case RegisterType::i32:
      return static_cast<std::int32_t>(wide) * settings.scale;
    case RegisterType::f32:
      return static_cast<double>(std::bit_cast<float>(wide)) * settings.scale;
  }
  return 0;
}

Result<std::vector<std::uint16_t>> encode(const RegisterSettings& settings, double value) {
  const bool is_float = settings.type == RegisterType::f32;
  const auto raw = is_float ? value / settings.scale : std::round(value / settings.scale);
  const auto bounds = raw_bounds(settings.type);
  if (!(raw >= bounds.minimum && raw <= bounds.maximum)) {  // also what is no number
    const auto [low, high] = std::minmax({bounds.minimum * settings.scale, bounds.maximum * settings.scale});
    Error error{.reason = Reason::out_of_range,
                .message = fmt::format("{} cannot be {} {}", settings.name, value, settings.unit),
                .remedy = "choose a value in the permitted range",
                .permitted = Range{.minimum = low, .maximum = high, .unit = settings.unit}};
    return fail(std::move(error));
  }
  const auto wide = is_float ? std::bit_cast<std::uint32_t>(static_cast<float>(raw))
                             : static_cast<std::uint32_t>(static_cast<std::int64_t>(raw));
  const auto low_word = static_cast<std::uint16_t>(wide & 0xFFFFU);
  if (register_count(settings.type) == 1) return std::vector{low_word};
  return std::vector{static_cast<std::uint16_t>(wide >> 16U), low_word};
}

std::vector<RegisterBlock> blocks_of(std::span<const RegisterSettings> registers) {
  std::vector<std::size_t> order(registers.size());
  std::iota(order.begin(), order.end(), std::size_t{0});
  std::ranges::sort(order, {}, [&](std::size_t i) { return std::pair(registers[i].address, i); });
  std::vector<RegisterBlock> blocks;
  for (const auto i : order) {
    const int begin = registers[i].address;
    const int end = begin + register_count(registers[i].type);
    const bool joins = !blocks.empty() && begin <= blocks.back().address + blocks.back().count &&
                       end - blocks.back().address <= longest_block;
    if (!joins) blocks.push_back({.address = registers[i].address, .count = 0, .values = {}});
    auto& block = blocks.back();
    block.count = static_cast<std::uint16_t>(std::max(end - block.address, int{block.count}));
    block.values.push_back(i);
  }
  return blocks;
}

}  // namespace axisd
