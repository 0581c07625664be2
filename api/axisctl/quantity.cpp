#include "api/axisctl/quantity.hpp"

#include <fmt/format.h>

#include "api/axisctl/error.hpp"
#include "config/quantity.hpp"

namespace axisd::axisctl {
namespace {

Failure usage(std::string_view what, const config::QuantityError& error) {
  return {ExitCode::usage, fmt::format("{}: {}{}{}", what, error.message,
                                       error.suggestion.empty() ? "" : "; ", error.suggestion)};
}

}  // namespace

double parse_value(std::string_view text, std::string_view unit, std::string_view what) {
  const auto decimal = config::parse_in_unit(text, unit, config::UnitRule::optional);
  if (!decimal) throw usage(what, decimal.error());
  return decimal->value;
}

std::chrono::nanoseconds parse_duration(std::string_view text, std::string_view what) {
  const auto duration = config::parse_duration(text);
  if (!duration) throw usage(what, duration.error());
  return *duration;
}

}  // namespace axisd::axisctl
