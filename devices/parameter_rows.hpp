// Makes catalogues of parameters out of blocks, and the texts of rows that a manual prints as one line.
#pragma once

#include <array>
#include <cstddef>
#include <string_view>

#include "devices/descriptor.hpp"

namespace axisd {

/// Puts the blocks of a catalogue one after the other.
template <std::size_t... sizes>
consteval auto join(const std::array<ParameterSpec, sizes>&... blocks) {
  std::array<ParameterSpec, (sizes + ...)> all{};
  std::size_t next = 0;
  const auto append = [&](const auto& block) {
    for (const auto& row : block) all[next++] = row;
  };
  (append(blocks), ...);
  return all;
}

/// Characters that live as long as the program, so that a row can point to them.
struct RowText {
  std::array<char, 112> characters{};
  std::size_t size = 0;

  constexpr void append(std::string_view part) {
    for (const char one : part) characters.at(size++) = one;
  }
  /// From 0 to 99.
  constexpr void append_number(std::size_t number) {
    if (number >= 10) characters.at(size++) = static_cast<char>('0' + number / 10);
    characters.at(size++) = static_cast<char>('0' + number % 10);
  }
  constexpr std::string_view view() const { return {characters.data(), size}; }
};

}  // namespace axisd
