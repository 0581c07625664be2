// How a key of the schema is tied to its place in the configuration: said once, used both ways.
#pragma once

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <concepts>
#include <optional>
#include <string>
#include <type_traits>
#include <utility>
#include <vector>

#include "config/schema.hpp"

namespace axisd::config {

// A value as text for comparing: equal exactly for equal values.

template <class T>
std::string to_text(const T& value) {
  if constexpr (std::is_enum_v<T>)
    return std::to_string(static_cast<int>(value));
  else if constexpr (std::is_same_v<T, Duration>)
    return fmt::format("{} ns", value.count());
  else
    return fmt::format("{}", value);
}
template <class T>
std::string to_text(const std::optional<T>& value) {
  return value ? to_text(*value) : "none";
}
inline std::string to_text(const Roles& roles) {
  std::string text;
  for (const auto& [client, role] : roles) text += fmt::format("{}: {}\n", client, axisd::to_string(role));
  return text;
}

// A value as read, by the type of its place.

inline void store(std::string& place, const Value& v) { place = v.text; }
inline void store(bool& place, const Value& v) { place = v.boolean; }
inline void store(double& place, const Value& v) { place = v.number; }
inline void store(Duration& place, const Value& v) { place = v.duration; }
inline void store(std::vector<std::string>& place, const Value& v) { place = v.items; }
inline void store(Roles& place, const Value& v) { place = v.roles; }
template <std::integral T>
void store(T& place, const Value& v) {
  place = static_cast<T>(v.integer);
}
template <class T>
void store(std::optional<T>& place, const Value& v) {
  store(place.emplace(), v);
}

// Makers of Field. `Get` is a lambda without captures: from a Target to the place.

/// One value.
template <class Get>
consteval Field field(Get) {
  return {.apply = [](Target& t, const Value& v) { store(Get{}(t), v); },
          .show = [](const Target& t) { return to_text(Get{}(t)); }};
}

/// An enumeration whose order is that of the choices, or a bool: whether it is the second of two.
template <class Get>
consteval Field choice_field(Get) {
  return {.apply =
              [](Target& t, const Value& v) {
                auto& place = Get{}(t);
                place = static_cast<std::remove_reference_t<decltype(place)>>(v.integer);
              },
          .show = [](const Target& t) { return to_text(Get{}(t)); }};
}

/// The two numbers of a ratio or travel, or the two ends of a range.
template <class First, class Second>
consteval Field pair_field(First, Second) {
  return {.apply =
              [](Target& t, const Value& v) {
                store(First{}(t), {.integer = v.numerator, .number = v.number});
                store(Second{}(t), {.integer = v.denominator, .number = v.second});
              },
          .show = [](const Target& t) { return to_text(First{}(t)) + ", " + to_text(Second{}(t)); }};
}

/// A section that may be missing: a std::optional.
template <class Get>
consteval Field optional_section(Get) {
  return {.apply = [](Target& t, const Value&) { Get{}(t).emplace(); },
          .inside =
              [](const Target& t) {
                return Get{}(t) ? std::vector<NamedTarget>{{{}, t}} : std::vector<NamedTarget>{};
              }};
}

/// Sections under names or numbers: a vector. `Member` of the Target points to the one that is meant, `Name`
/// leads from it to its name or number.
template <auto Member, class Get, class Name>
consteval Field list_of(Get, Name) {
  return {.apply =
              [](Target& t, const Value& v) {
                t.*Member = &Get{}(t).emplace_back();
                store(Name{}(*(t.*Member)), v);
              },
          .inside =
              [](const Target& t) {
                std::vector<NamedTarget> all;
                for (auto& one : Get{}(t)) {
                  all.push_back({to_text(Name{}(one)), t});
                  all.back().target.*Member = &one;
                }
                return all;
              }};
}

}  // namespace axisd::config
