#include "devices/axis/eeprom_budget.hpp"

#include <fmt/chrono.h>
#include <fmt/format.h>

#include <iterator>

namespace axisd {

namespace {

using std::chrono::hours;

constexpr std::uint64_t endurance = 100'000;  ///< writes of a cell; what EEPROMs of this kind are made for
constexpr std::int64_t kept_hours = 24;       ///< besides the one that has begun

std::int64_t hour_of(WallTime time) { return std::chrono::floor<hours>(time).time_since_epoch().count(); }

}  // namespace

bool EepromBudget::settle(WallTime now) {
  auto& hours = record_.by_hour;
  const auto present = hour_of(now);
  const auto forgotten =
      std::erase_if(hours, [&](const auto& hour) { return hour.first < present - kept_hours; });
  std::uint64_t ahead = 0;
  while (!hours.empty() && hours.rbegin()->first > present) {
    ahead += hours.rbegin()->second;
    hours.erase(std::prev(hours.end()));
  }
  if (ahead > 0) hours[present] += ahead;
  return forgotten > 0 || ahead > 0;
}

void EepromBudget::count(std::uint64_t saves, WallTime now) {
  settle(now);
  record_.saves += saves;
  record_.by_hour[hour_of(now)] += saves;
}

std::uint64_t EepromBudget::of_this_day() const {
  std::uint64_t sum = 0;
  for (const auto& [hour, saves] : record_.by_hour) sum += saves;
  return sum;
}

std::optional<WallTime> EepromBudget::permitted_from(std::uint64_t saves) const {
  if (saves > per_day_) return std::nullopt;
  auto left = of_this_day();
  for (const auto& [hour, count] : record_.by_hour) {
    left -= count;
    if (left + saves <= per_day_) return WallTime(hours(hour + kept_hours + 1));
  }
  return std::nullopt;
}

Result<void> EepromBudget::permit(std::uint64_t saves, WallTime now) {
  settle(now);
  const auto saved = of_this_day();
  if (saved + saves <= per_day_) return {};
  const auto next = permitted_from(saves);
  const auto when = next ? fmt::format(
                               "the next is permitted from {:%Y-%m-%d %H:%M} UTC on; find out what saves so "
                               "often, or raise limits.eeprom_saves_per_day",
                               fmt::gmtime(std::chrono::system_clock::to_time_t(*next)))
                         : fmt::format("it takes {} saves: raise limits.eeprom_saves_per_day", saves);
  return fail(
      Reason::eeprom_budget,
      fmt::format("not saved, to spare the drive's EEPROM: it was saved to {} times in the last 24 h, where "
                  "limits.eeprom_saves_per_day permits {}, and {} times in all, of about {} that it bears",
                  saved, per_day_, record_.saves, endurance),
      when);
}

}  // namespace axisd
