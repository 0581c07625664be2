#include "daemon/core/group_keeper.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <utility>

#include "devices/group/arrival.hpp"
#include "devices/nearest.hpp"

namespace axisd::core {

namespace {

/// Moves that are remembered; those under way are not counted out.
constexpr std::size_t history = 1000;

template <class Value>
std::string text_of(const std::optional<Value>& value) {
  if (!value) return "-";
  if constexpr (std::is_same_v<Value, Duration>)
    return fmt::format("{}", value->count());
  else
    return fmt::format("{:a}", *value);
}

/// Equal exactly for equal requests.
std::string text_of(const GroupMoveRequest& request) {
  auto text =
      fmt::format("{} {} {}", request.group, request.arrive_together, text_of(request.max_arrival_error));
  if (request.start == GroupStart::when_told) text += " when told";
  for (const auto& target : request.targets)
    text += fmt::format("; {} {} {} {} {} {}", target.axis, text_of(target.position),
                        text_of(target.distance), text_of(target.with.velocity),
                        text_of(target.with.acceleration_time), text_of(target.with.deceleration_time));
  return text;
}

/// The first member has the request's own id, so that nothing else can use it; clients' ids have no spaces.
CommandOptions options_of(const GroupMoveRequest& request, std::size_t member,
                          const CommandOptions& options) {
  auto own = options;
  if (member > 0 && !own.request_id.empty()) own.request_id += " " + request.targets[member].axis;
  return own;
}

}  // namespace

const GroupSettings* GroupKeeper::find(std::string_view group) const {
  const auto found = std::ranges::find(groups_, group, &GroupSettings::name);
  return found == groups_.end() ? nullptr : &*found;
}

Result<void> GroupKeeper::check(const GroupMoveRequest& request) const {
  const auto* group = find(request.group);
  if (group == nullptr && !request.group.empty())
    return fail(no_such_group(request.group, names_of(groups_), parts_.axes()));
  if (request.targets.empty())
    return fail(Reason::invalid_argument, "no member is given a target", "name at least one axis");
  for (std::size_t i = 0; i < request.targets.size(); ++i) {
    const auto& target = request.targets[i];
    if (parts_.find(target.axis) == nullptr)
      return fail(no_such_axis(target.axis, group != nullptr ? group->axes : parts_.axes()));
    if (group != nullptr && std::ranges::find(group->axes, target.axis) == group->axes.end())
      return fail(Reason::invalid_argument,
                  fmt::format("{} is no member of group {}", target.axis, group->name),
                  fmt::format("its members are {}", fmt::join(group->axes, ", ")));
    if (i > 0 && request.targets[i - 1].axis == target.axis)
      return fail(Reason::invalid_argument, fmt::format("{} is named twice", target.axis),
                  "give each axis one target");
    if (target.position.has_value() == target.distance.has_value())
      return fail(Reason::invalid_argument,
                  fmt::format("{}: give either a position or a distance", target.axis), "0 is a value, too");
  }
  if (request.max_arrival_error && !request.arrive_together)
    return fail(Reason::invalid_argument, "max_arrival_error without arrive_together",
                "it bounds how far apart members arrive that are to arrive together");
  return {};
}

Result<GroupRunPtr> GroupKeeper::find_repeat(const GroupMoveRequest& request,
                                             const std::vector<Action>& actions,
                                             const CommandOptions& options) {
  std::vector<CommandPtr> known;
  for (std::size_t i = 0; i < actions.size(); ++i) {
    const auto found =
        parts_.book->find_repeat(request.targets[i].axis, actions[i], options_of(request, i, options));
    if (!found) return fail(named(found.error(), request.targets[i].axis));
    if (*found) known.push_back(*found);
  }
  if (known.empty()) return nullptr;
  const auto same = std::ranges::find_if(runs_, [&](const auto& run) {
    return std::ranges::find(run->commands(), known.front()) != run->commands().end();
  });
  if (same != runs_.end()) return *same;
  // Of before a restart, or forgotten: what is known of it are its commands. Nothing of it starts any more.
  auto run = enter(
      std::make_shared<GroupRun>(GroupRun::Parts{.executor = parts_.executor,
                                                 .clock = parts_.clock,
                                                 .id = fmt::format("{}-g{}", parts_.instance_id, ++last_),
                                                 .request = request},
                                 std::move(known)));
  run->watch_members();
  return run;
}

Result<std::vector<Plan>> GroupKeeper::plan(const GroupMoveRequest& request,
                                            const std::vector<Action>& actions,
                                            const CommandOptions& options) const {
  std::vector<Arrival> arrivals;
  for (std::size_t i = 0; i < actions.size(); ++i) {
    auto* axis = parts_.find(request.targets[i].axis);
    auto plan = axis->plan_member(std::get<GroupMemberRequest>(actions[i]), options);
    if (!plan) return fail(named(plan.error(), request.targets[i].axis));
    const auto way = axis->way_of(*plan);
    arrivals.push_back({.planner = &axis->planner(), .plan = *std::move(plan), .pulses = way});
  }
  if (request.arrive_together) arrive_together(arrivals);
  std::vector<Plan> plans;
  std::vector<Duration> durations;
  for (auto& arrival : arrivals) {
    durations.push_back(arrival.plan.predicted);
    plans.push_back(std::move(arrival.plan));
  }
  const auto error = arrival_error(durations);
  const auto in_ms = [](Duration time) { return std::chrono::duration<double, std::milli>(time).count(); };
  if (request.max_arrival_error && error > *request.max_arrival_error)
    return fail(
        Error{.reason = Reason::out_of_range,
              .message = fmt::format("the members would arrive within {:.3g} ms of each other: whole "
                                     "r/min and milliseconds come no nearer",
                                     in_ms(error)),
              .remedy = "allow more (max_arrival_error), or choose other velocities or targets",
              .permitted = Range{.minimum = 0, .maximum = in_ms(*request.max_arrival_error), .unit = "ms"}});
  return plans;
}

Result<GroupRunPtr> GroupKeeper::move(GroupMoveRequest request, const CommandOptions& options) {
  std::ranges::sort(request.targets, {}, &GroupTarget::axis);
  if (auto usable = check(request); !usable) return fail(usable.error());
  const auto whole = text_of(request);  // as it was asked, whatever the configuration says now
  if (const auto* group = find(request.group); group != nullptr && request.arrive_together)
    if (!request.max_arrival_error) request.max_arrival_error = group->max_arrival_error;
  std::vector<Action> actions;
  actions.reserve(request.targets.size());
  for (const auto& target : request.targets)
    actions.emplace_back(GroupMemberRequest{
        .position = target.position, .distance = target.distance, .with = target.with, .whole = whole});
  auto repeat = find_repeat(request, actions, options);
  if (!repeat || *repeat != nullptr) return repeat;
  auto plans = plan(request, actions, options);
  if (!plans) return fail(plans.error());
  // From here on it is accepted; nothing has been sent.
  std::vector<std::unique_ptr<Axis::Member>> members;
  members.reserve(actions.size());
  for (std::size_t i = 0; i < actions.size(); ++i)
    members.push_back(std::make_unique<Axis::Member>(
        *parts_.find(request.targets[i].axis), std::get<GroupMemberRequest>(actions[i]),
        options_of(request, i, options), std::move((*plans)[i])));
  auto run = enter(
      std::make_shared<GroupRun>(GroupRun::Parts{.executor = parts_.executor,
                                                 .clock = parts_.clock,
                                                 .id = fmt::format("{}-g{}", parts_.instance_id, ++last_),
                                                 .request = std::move(request)},
                                 std::move(members)));
  run->watch_members();
  parts_.launch(run->run(), "group move");
  return run;
}

GroupRunPtr GroupKeeper::enter(GroupRunPtr run) {
  while (runs_.size() >= history && ended(runs_.front()->state())) runs_.pop_front();
  runs_.push_back(run);
  return run;
}

GroupRunPtr GroupKeeper::find_run(std::string_view id) const {
  const auto found = std::ranges::find(runs_, id, &GroupRun::id);
  return found == runs_.end() ? nullptr : *found;
}

GroupRunPtr GroupKeeper::engaged(std::string_view axis) const {
  const auto found =
      std::ranges::find_if(runs_, [&](const auto& run) { return !run->over() && run->moves(axis); });
  return found == runs_.end() ? nullptr : *found;
}

void GroupKeeper::let_go(std::string_view axis) {
  for (const auto& run : runs_)
    if (run->moves(axis)) run->let_go();
}

}  // namespace axisd::core
