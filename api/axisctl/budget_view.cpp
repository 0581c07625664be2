#include "api/axisctl/budget_view.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <bit>

#include "api/axisctl/format.hpp"
#include "api/axisctl/table.hpp"

namespace axisd::axisctl {
namespace {

std::string milliseconds(const google::protobuf::Duration& time) {
  return fmt::format("{:.1f} ms", 1000 * seconds(time));
}
/// Of a prediction, where unset is without bound; and of what was seen, where it is not seen yet.
std::string predicted(const google::protobuf::Duration& time) {
  return seconds(time) > 0 ? milliseconds(time) : "-";
}
std::string seen(const google::protobuf::Duration& time) {
  return seconds(time) > 0 ? milliseconds(time) : "";
}

/// Of many rows the first ones, then ever fewer, and the last.
bool is_shown(std::uint32_t count, std::uint32_t last) {
  return count == 0 || std::has_single_bit(count) || count == last;
}
bool leaves_out(std::uint32_t last) {
  for (std::uint32_t count = 0; count < last; ++count)
    if (!is_shown(count, last)) return true;
  return false;
}

/// Where tables go.
struct Place {
  bool colour = false;
  int columns = 0;
};

std::string joined(const Table& table, const Place& place) {
  std::string text;
  for (const auto& line : table.lines(place.colour, place.columns, TooWide::fold)) text += line + '\n';
  return text;
}

Table load_table(const v1::BusBudget& budget) {
  Table table({"MOVING", "UTILISATION", "AT MOST", "REFRESH MOVING", "REFRESH IDLE", "START"},
              {0, 1, 2, 3, 4, 5});
  const auto last = static_cast<std::uint32_t>(budget.load_size() - 1);
  for (const auto& row : budget.load())
    if (is_shown(row.moving(), last))
      table.add({std::to_string(row.moving()), fmt::format("{:.2f}", row.utilisation()),
                 fmt::format("{:.2f}", row.utilisation_max()), predicted(row.refresh_moving()),
                 predicted(row.refresh_idle()), predicted(row.start())});
  return table;
}

Table stop_table(const v1::BusBudget& budget) {
  Table table({"STOPPED", "LAST FRAME", "STANDSTILL"}, {0, 1, 2});
  const auto last = static_cast<std::uint32_t>(budget.stops_size());
  for (const auto& row : budget.stops())
    if (is_shown(row.axes(), last))
      table.add({std::to_string(row.axes()), predicted(row.last_frame()), predicted(row.standstill())});
  return table;
}

bool is_later_for_fewer(const v1::BusBudget& budget) {
  return std::ranges::adjacent_find(budget.stops(), [](const auto& fewer, const auto& more) {
           return seconds(fewer.standstill()) > seconds(more.standstill()) && seconds(more.standstill()) > 0;
         }) != budget.stops().end();
}

/// How many of a group's axes are on this bus.
int count_here(const v1::Group& group, const v1::BusBudget& budget) {
  const auto is_here = [&budget](const std::string& name) {
    return std::ranges::find(budget.axes(), name, &v1::AxisBudget::axis) != budget.axes().end();
  };
  return static_cast<int>(std::ranges::count_if(group.axes(), is_here));
}

/// A stop of a group is one of as many axes as it has here: those on other buses do not delay it. Empty:
/// none.
std::string group_text(const v1::BusBudget& budget, const v1::ListGroupsResponse& groups,
                       const Place& place) {
  Table table({"GROUP", "AXES", "LAST FRAME", "STANDSTILL"}, {1, 2, 3});
  bool any = false;
  for (const auto& group : groups.groups()) {
    const auto count = count_here(group, budget);
    if (count == 0 || count > budget.stops_size()) continue;
    any = true;
    const auto& stop = budget.stops(count - 1);
    table.add(
        {group.name(), std::to_string(count), predicted(stop.last_frame()), predicted(stop.standstill())});
  }
  return any ? joined(table, place) + '\n' : "";
}

Table refresh_table(const v1::BusBudget& budget) {
  Table table({"AXIS", "IDLE", "SEEN", "MOVING", "ALL MOVING", "SEEN"}, {1, 2, 3, 4, 5});
  for (const auto& axis : budget.axes())
    table.add({axis.axis(), predicted(axis.refresh_idle()), seen(axis.observed().refresh_idle()),
               predicted(axis.refresh_moving()), predicted(axis.refresh_moving_all()),
               seen(axis.observed().refresh_moving())});
  return table;
}

void add_stop(Table& table, const v1::AxisBudget& axis, bool all) {
  const auto& stop = all ? axis.stop_all() : axis.stop_alone();
  const auto& observed = axis.observed();
  table.add({axis.axis(), all ? "all" : "alone", predicted(stop.last_frame()),
             seen(all ? observed.stop_frame_all() : observed.stop_frame()),
             fmt::format("{} + {}", predicted(stop.standstill()), milliseconds(axis.deceleration_time())),
             seen(all ? observed.standstill_all() : observed.standstill()),
             stop.has_last_frame() ? with_unit(all ? axis.way_all() : axis.way_alone(), axis.unit()) : "-"});
}

Table axis_stop_table(const v1::BusBudget& budget) {
  Table table({"AXIS", "STOPPED", "FRAME", "SEEN", "STANDSTILL", "SEEN", "WAY"}, {2, 3, 4, 5, 6});
  for (const auto& axis : budget.axes())
    for (const bool all : {false, true}) add_stop(table, axis, all);
  return table;
}

}  // namespace

std::string budget_text(const v1::BusBudget& budget, const v1::ListGroupsResponse& groups, bool colour,
                        int columns) {
  const Place place{.colour = colour, .columns = columns};
  auto text = fmt::format("{}\n{}", budget.bus(), joined(load_table(budget), place));
  if (!budget.axes().empty()) {
    text += '\n' + joined(stop_table(budget), place);
    if (leaves_out(static_cast<std::uint32_t>(budget.stops_size())))
      text += "MOVING, STOPPED: not all numbers of axes are shown; --json has them\n";
    if (is_later_for_fewer(budget))
      text +=
          "STANDSTILL: of fewer axes it may come later, as the others may start, and are read meanwhile\n";
    text += fmt::format("\n{}{}\n{}", group_text(budget, groups, place), joined(refresh_table(budget), place),
                        joined(axis_stop_table(budget), place));
  }
  for (const auto& one : budget.excess())
    text += fmt::format("exceeded ({}): {}; {}\n", one.key(), one.message(), one.remedy());
  for (const auto& note : budget.notes()) text += fmt::format("note: {}\n", note);
  return text;
}

}  // namespace axisd::axisctl
