#include "devices/setup_codes.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <functional>

namespace axisd {

namespace {

template <class Range, class Projection>
std::optional<std::size_t> index_of(const Range& range, std::string_view name, Projection projection) {
  const auto found = std::ranges::find(range, name, projection);
  if (found == std::ranges::end(range)) return std::nullopt;
  return static_cast<std::size_t>(found - std::ranges::begin(range));
}

}  // namespace

Result<TerminalAssignment> assign_terminals(const std::vector<TerminalSettings>& terminals,
                                            std::span<const TerminalSpec> known,
                                            std::span<const TerminalFunctionSpec> functions) {
  TerminalAssignment assignment{.functions = std::vector<const TerminalFunctionSpec*>(known.size(), nullptr)};
  for (const auto& terminal : terminals) {
    const auto index = index_of(known, terminal.terminal, &TerminalSpec::name);
    const auto* function = find_function(functions, terminal.function);
    if (!index || function == nullptr)
      return fail(Reason::misconfigured, fmt::format("terminal {} cannot have the function {}",
                                                     terminal.terminal, terminal.function));
    if (!function->unusable.empty())
      return fail(Reason::misconfigured,
                  fmt::format("terminal {} must not have the function {}: {}", terminal.terminal,
                              terminal.function, function->unusable));
    assignment.functions[*index] = function;
    assignment.named |= 1U << *index;
    if (terminal.active_low) assignment.levels |= 1U << *index;
  }
  return assignment;
}

std::optional<std::uint32_t> terminal_bit(std::span<const TerminalSpec> known, std::string_view name) {
  const auto index = index_of(known, name, &TerminalSpec::name);
  return index ? std::optional(1U << *index) : std::nullopt;
}

bool is_limit_or_stop(const TerminalFunctionSpec* function) {
  static constexpr std::string_view names[] = {"positive_limit", "negative_limit", "stop", "quick_stop"};
  return function != nullptr && std::ranges::find(names, function->name) != std::end(names);
}

bool starts_motion(std::span<const TerminalFunctionSpec> functions, std::int64_t code) {
  const auto found = std::ranges::find(functions, code, &TerminalFunctionSpec::code);
  return found != functions.end() && found->starts_motion;
}

std::optional<std::int64_t> code_of(const SettingSpec& spec, const SettingValue& value) {
  if (!spec.object) return std::nullopt;
  if (const auto* text = std::get_if<std::string>(&value)) {
    const auto index = index_of(spec.choices, *text, std::identity{});
    return index ? std::optional(static_cast<std::int64_t>(*index)) : std::nullopt;
  }
  if (const auto* number = std::get_if<std::int64_t>(&value)) return *number;
  if (const auto* flag = std::get_if<bool>(&value)) return *flag ? 1 : 0;
  return std::nullopt;
}

}  // namespace axisd
