// What must hold for the register catalogue of every model of the family.
#pragma once

#include <gtest/gtest.h>

#include <algorithm>
#include <cstdint>
#include <set>
#include <span>
#include <string>
#include <vector>

#include "devices/descriptor.hpp"

namespace axisd::yako_rtu {

/// Registers from `first` to `last` without a hole, as 6.1 prints them.
struct RegisterGroup {
  std::uint32_t first, last;
};

/// Exactly the registers of these groups, in order of address.
inline void expect_groups(std::span<const ParameterSpec> all, std::span<const RegisterGroup> groups) {
  std::vector<std::uint32_t> printed, ours;
  for (const auto& group : groups)
    for (auto address = group.first; address <= group.last; ++address) printed.push_back(address);
  for (const auto& one : all) ours.push_back(one.address);
  EXPECT_EQ(printed, ours);
}

inline void expect_names_and_texts(std::span<const ParameterSpec> all) {
  std::set<std::string> names;
  for (const auto& one : all) {
    EXPECT_TRUE(names.insert(std::string(one.name)).second) << one.name;
    EXPECT_EQ(std::string::npos, one.name.find_first_not_of("abcdefghijklmnopqrstuvwxyz0123456789_"))
        << one.name;
    EXPECT_FALSE(one.description.empty()) << one.name;
    EXPECT_LT(one.minimum, one.maximum) << one.name;
  }
}

/// 6.2.4, 7.6 and the "-" in the column of defaults: these are commands, each with the RPC that gives it.
inline void expect_triggers(std::span<const ParameterSpec> all) {
  std::set<std::uint32_t> triggers;
  for (const auto& one : all) {
    if (one.access == Access::wo) triggers.insert(one.address);
    EXPECT_EQ(one.access == Access::wo, one.instead.find("Service.") != std::string_view::npos) << one.name;
  }
  EXPECT_EQ((std::set<std::uint32_t>{0x27, 0x28, 0x29, 0x2A, 0x2B, 0x2C, 0x30}), triggers);
}

/// Addresses of the registers whose default is outside their own range.
inline std::set<std::uint32_t> defaults_out_of_range(std::span<const ParameterSpec> all) {
  std::set<std::uint32_t> found;
  for (const auto& one : all)
    if (one.default_value && (*one.default_value < one.minimum || *one.default_value > one.maximum))
      found.insert(one.address);
  return found;
}

/// Every register that can be written has a default to go back to, except those in `without`.
inline void expect_defaults(std::span<const ParameterSpec> all, std::span<const RegisterGroup> without) {
  for (const auto& one : all) {
    const bool excepted = std::ranges::any_of(without, [&](const RegisterGroup& group) {
      return one.address >= group.first && one.address <= group.last;
    });
    const bool writable = one.access == Access::rw || one.access == Access::rw_saved;
    if (writable) {
      EXPECT_EQ(!excepted, one.default_value.has_value()) << one.name;
    }
  }
}

}  // namespace axisd::yako_rtu
