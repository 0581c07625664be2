// Numbers with units, as people write them.
#include <cmath>

#include "config/quantity.hpp"
#include "tests/fuzz/target.hpp"

namespace axisd::fuzz {
namespace {

template <class T>
void expect_told(const config::QuantityResult<T>& result) {
  if (result) return;
  expect(!result.error().message.empty() && !result.error().suggestion.empty(), "it is told how to write it");
}
void expect_sound(const config::QuantityResult<config::Decimal>& result) {
  expect_told(result);
  if (result) expect(result->denominator > 0 && std::isfinite(result->value), "a number is a number");
}

}  // namespace

void run(Input input) {
  const auto unit = text(input.take(input.byte() % 8U));
  const auto all = text(input.rest());
  expect_sound(config::parse_decimal(all));
  expect_told(config::parse_quantity(all));
  expect_sound(config::parse_in_unit(all, unit));
  expect_sound(config::parse_in_unit(all, unit, config::UnitRule::optional));
  expect_sound(config::parse_ratio(all));
  const auto ratio = config::parse_ratio_in_unit(all, unit);
  expect_sound(ratio);
  if (ratio) expect(ratio->numerator > 0, "a ratio is positive");
  const auto duration = config::parse_duration(all);
  expect_told(duration);
  if (duration) {
    expect(*duration >= Duration::zero() && *duration <= std::chrono::hours(100), "a time is bounded");
    (void)config::format_duration(*duration);
  }
  if (const auto address = config::parse_object_address(all))
    expect(*address <= 0xFFFFFF &&
               config::parse_object_address(config::format_object_address(*address)) == *address,
           "an object survives being written");
}

}  // namespace axisd::fuzz
