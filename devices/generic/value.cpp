#include "devices/generic/value.hpp"

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

Bounds raw_bounds(ValueType type) {
  switch (type) {
    case ValueType::u8:
      return bounds_of<std::uint8_t>();
    case ValueType::i8:
      return bounds_of<std::int8_t>();
    case ValueType::u16:
      return bounds_of<std::uint16_t>();
    case ValueType::i16:
      return bounds_of<std::int16_t>();
    case ValueType::u32:
      return bounds_of<std::uint32_t>();
    case ValueType::i32:
      return bounds_of<std::int32_t>();
    case ValueType::f32:
      return bounds_of<float>();
  }
  return {};
}

double unscaled(ValueType type, std::uint32_t raw) {
  switch (type) {
    case ValueType::u8:
      return static_cast<std::uint8_t>(raw);
    case ValueType::i8:
      return static_cast<std::int8_t>(raw);
    case ValueType::u16:
      return static_cast<std::uint16_t>(raw);
    case ValueType::i16:
      return static_cast<std::int16_t>(raw);
    case ValueType::u32:
      return raw;
    case ValueType::i32:
      return static_cast<std::int32_t>(raw);
    case ValueType::f32:
      return static_cast<double>(std::bit_cast<float>(raw));
  }
  return 0;
}

}  // namespace

double decode(const ValueSettings& settings, std::uint32_t raw) {
  return unscaled(settings.type, raw) * settings.scale;
}

Result<std::uint32_t> encode(const ValueSettings& settings, double value) {
  const bool is_float = settings.type == ValueType::f32;
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
  if (is_float) return std::bit_cast<std::uint32_t>(static_cast<float>(raw));
  const auto wide = static_cast<std::uint32_t>(static_cast<std::int64_t>(raw));
  return wide & (0xFFFFFFFFU >> (8U * (4U - byte_count(settings.type))));
}

std::uint32_t from_registers(std::span<const std::uint16_t> registers) {
  std::uint32_t raw = 0;
  for (const auto word : registers) raw = raw << 16U | word;
  return raw;
}

std::vector<std::uint16_t> to_registers(std::uint32_t raw, ValueType type) {
  const auto low_word = static_cast<std::uint16_t>(raw & 0xFFFFU);
  if (register_count(type) == 1) return {low_word};
  return {static_cast<std::uint16_t>(raw >> 16U), low_word};
}

std::vector<RegisterBlock> blocks_of(std::span<const ValueSettings> values) {
  std::vector<std::size_t> order(values.size());
  std::iota(order.begin(), order.end(), std::size_t{0});
  std::ranges::sort(order, {}, [&](std::size_t i) { return std::pair(values[i].address, i); });
  std::vector<RegisterBlock> blocks;
  for (const auto i : order) {
    const auto address = static_cast<std::uint16_t>(values[i].address);
    const int begin = address;
    const int end = begin + register_count(values[i].type);
    const bool joins = !blocks.empty() && begin <= blocks.back().address + blocks.back().count &&
                       end - blocks.back().address <= longest_block;
    if (!joins) blocks.push_back({.address = address, .count = 0, .values = {}});
    auto& block = blocks.back();
    block.count = static_cast<std::uint16_t>(std::max(end - block.address, int{block.count}));
    block.values.push_back(i);
  }
  return blocks;
}

}  // namespace axisd
