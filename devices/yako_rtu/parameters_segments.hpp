// The rows of the multi-position (PT) and multi-speed (PV) segments: manual 6.1 prints each block of 16
// registers as one line, and so does this file; the 16 rows are made from it at compile time.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <string_view>

#include "devices/descriptor.hpp"
#include "devices/parameter_rows.hpp"

namespace axisd::yako_rtu {

inline constexpr std::size_t segment_count = 16;

/// One line of the manual: 16 registers, one for each segment.
struct SegmentBlock {
  std::uint32_t address;          ///< of segment 1
  std::string_view name;          ///< follows "segment_1_"
  std::int32_t minimum, maximum;  ///< default is 0 in all of them
  std::string_view unit;
  std::string_view mode;     ///< "PT": precedes " segment 1: "
  std::string_view meaning;  ///< the rest of the description
};

inline constexpr SegmentBlock segment_pulses_high{
    0x0090, "pulses_high", 0, 65535, "pulse", "PT", "distance or target, high word"};
inline constexpr SegmentBlock segment_pulses_low{
    0x00A0, "pulses_low", 0, 65535, "pulse", "PT", "distance or target, low word"};
inline constexpr SegmentBlock segment_speed{0x00B0, "speed", 0, 3000, "r/min", "PT", "speed"};
inline constexpr SegmentBlock segment_time{
    0x00C0, "time", 0, 2000, "ms", "PT and PV", "acceleration and deceleration time"};
inline constexpr SegmentBlock segment_pv_speed{0x00E0, "pv_speed", 0, 3000, "r/min", "PV", "speed"};

consteval std::array<RowText, segment_count> segment_texts(std::string_view before, std::string_view between,
                                                           std::string_view after) {
  std::array<RowText, segment_count> texts{};
  for (std::size_t i = 0; i < segment_count; ++i) {
    texts[i].append(before);
    texts[i].append_number(i + 1);
    texts[i].append(between);
    texts[i].append(after);
  }
  return texts;
}

consteval RowText segment_prefix(std::string_view mode) {
  RowText prefix;
  prefix.append(mode);
  prefix.append(" segment ");
  return prefix;
}

template <const SegmentBlock& block>
inline constexpr auto segment_names = segment_texts("segment_", "_", block.name);
template <const SegmentBlock& block>
inline constexpr auto segment_descriptions =
    segment_texts(segment_prefix(block.mode).view(), ": ", block.meaning);

/// The 16 rows of a block.
template <const SegmentBlock& block>
consteval std::array<ParameterSpec, segment_count> segment_rows() {
  std::array<ParameterSpec, segment_count> rows{};
  for (std::size_t i = 0; i < segment_count; ++i)
    rows[i] = {block.address + static_cast<std::uint32_t>(i),
               segment_names<block>[i].view(),
               Access::rw_saved,
               block.minimum,
               block.maximum,
               0,
               block.unit,
               segment_descriptions<block>[i].view()};
  return rows;
}

}  // namespace axisd::yako_rtu
