#include "buses/bus_load.hpp"

#include <algorithm>

namespace axisd {
namespace {

using std::chrono::seconds;

std::int64_t second_of(TimePoint t) {
  return std::chrono::duration_cast<seconds>(t.time_since_epoch()).count();
}

double share(Duration part, Duration whole) {
  if (whole <= Duration{}) return 0;
  return std::min(1.0, std::chrono::duration<double>(part) / std::chrono::duration<double>(whole));
}

}  // namespace

BusLoad::Second& BusLoad::second(std::int64_t number) {
  auto& found = seconds_.at(static_cast<std::size_t>(number) % seconds_.size());
  if (found.number != number) found = {.number = number};
  return found;
}

void BusLoad::add(TimePoint begin, TimePoint end) {
  begin = std::max(begin, since_);
  if (end <= begin) return;
  occupied_ += end - begin;
  begin = std::max(begin, end - window);  // what was before is of no window any more
  while (begin < end) {
    const auto number = second_of(begin);
    const auto until = std::min(end, TimePoint(seconds(number + 1)));
    second(number).occupied += until - begin;
    begin = until;
  }
}

double BusLoad::overall(TimePoint now) const { return share(occupied_, now - since_); }

double BusLoad::recent(TimePoint now) const {
  const auto last = second_of(now);
  const auto first = last - window / seconds(1) + 1;
  Duration sum{};
  for (const auto& one : seconds_)
    if (one.number >= first && one.number <= last) sum += one.occupied;
  return share(sum, now - std::max(since_, TimePoint(seconds(first))));
}

}  // namespace axisd
