#include "daemon/core/group_access_service.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <utility>

#include "devices/nearest.hpp"

namespace axisd::core {

namespace {

bool reached(CommandState state, WaitUntil until) {
  if (ended(state) || until == WaitUntil::accepted) return true;
  return until == WaitUntil::started && state == CommandState::active;
}

}  // namespace

struct GroupAccessService::Gathering {
  std::vector<GroupStopResult> results;
  std::size_t missing = 0;
  std::function<void(std::vector<GroupStopResult>)> callback;
};

void GroupAccessService::move(GroupMoveRequest request, CommandOptions options, WaitUntil until,
                              std::function<void(Result<GroupMove>)> callback) {
  options.arrived = loop_->clock().now();
  post(loop_->executor(), [this, request = std::move(request), options = std::move(options), until,
                           callback = std::move(callback)]() mutable {
    if (closing_)
      return callback(fail(Reason::cancelled, "the daemon is shutting down", "repeat it when it is back"));
    const auto run = machine_->groups().move(std::move(request), options);
    if (!run) return callback(fail(run.error()));
    (*run)->observe([executor = loop_->executor(), until, callback](const GroupRun& now) {
      if (!reached(now.state(), until)) return false;
      // From a handler of its own: whoever hears of it finds the axes' states published.
      post(executor, [callback, value = now.value()] { callback(value); });
      return true;
    });
  });
}

void GroupAccessService::get(std::string id, std::function<void(Result<GroupMove>)> callback) {
  post(loop_->executor(), [this, id = std::move(id), callback = std::move(callback)] {
    const auto run = machine_->groups().find_run(id);
    if (run) return callback(run->value());
    callback(fail(Reason::unknown_command, fmt::format("there is no group move '{}' (any more)", id),
                  "its commands may still be known: axisctl command get"));
  });
}

std::vector<std::string> GroupAccessService::resolve(const MachineTable& table,
                                                     const GroupStopRequest& request,
                                                     std::vector<GroupStopResult>& unknown) {
  auto names = request.axes;
  if (!request.group.empty()) {
    const auto group = std::ranges::find(table.groups, request.group, &GroupSettings::name);
    if (group != table.groups.end())
      names.insert(names.begin(), group->axes.begin(), group->axes.end());
    else
      unknown.push_back({.axis = request.group,
                         .command = fail(no_such_group(request.group, names_of(table.groups), table.axes))});
  }
  std::vector<std::string> axes;
  for (const auto& name : names) {
    if (table.find(name) == nullptr)
      unknown.push_back({.axis = name, .command = fail(no_such_axis(name, table.axes))});
    else if (std::ranges::find(axes, name) == axes.end())
      axes.push_back(name);
  }
  return axes;
}

void GroupAccessService::stop(GroupStopRequest request, std::string client, WaitUntil until,
                              std::function<void(std::vector<GroupStopResult>)> callback) {
  auto gathering = std::make_shared<Gathering>();
  gathering->callback = std::move(callback);
  const auto table = machine_->table();
  const auto axes = resolve(*table, request, gathering->results);
  if (axes.empty())
    return post(loop_->executor(), [gathering] { gathering->callback(std::move(gathering->results)); });
  auto serve = [this, gathering, axes, request, client = std::move(client), until,
                arrived = loop_->clock().now()] {
    const auto known = gathering->results.size();
    std::vector<Result<CommandPtr>> commands;
    for (const auto& axis : axes) {
      commands.push_back(machine_->submit(axis, StopRequest{.kind = request.kind, .hold = request.hold},
                                          {.client = client, .arrived = arrived}));
      gathering->results.push_back({.axis = axis, .command = fail(Reason::internal, "no answer")});
    }
    gathering->missing = commands.size();
    for (std::size_t i = 0; i < commands.size(); ++i) gather(gathering, known + i, commands[i], until);
  };
  std::vector<std::shared_ptr<AxisGate>> gates;
  gates.reserve(axes.size());
  for (const auto& axis : axes) gates.push_back(table->find(axis)->gate);
  loop_->lane().request(std::move(gates), std::move(serve));
}

void GroupAccessService::gather(const std::shared_ptr<Gathering>& gathering, std::size_t index,
                                const Result<CommandPtr>& command, WaitUntil until) {
  const auto take = [gathering, index](Result<Command> result) {
    gathering->results[index].command = std::move(result);
    if (--gathering->missing == 0) gathering->callback(std::move(gathering->results));
  };
  if (!command) return take(fail(command.error()));
  if (reached((*command)->value().state, until)) return take((*command)->value());
  auto pending = std::make_shared<std::function<void(Result<Command>)>>(take);
  (*command)->observe(pending, [executor = loop_->executor(), until, keep = pending](const Command& now) {
    if (!*keep || !reached(now.state, until)) return;
    post(executor, [tell = std::exchange(*keep, nullptr), now] { tell(now); });
  });
}

}  // namespace axisd::core
