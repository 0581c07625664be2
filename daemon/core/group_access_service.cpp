#include "daemon/core/group_access_service.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <set>
#include <utility>

#include "devices/nearest.hpp"

namespace axisd::core {

namespace {

bool reached(CommandState state, WaitUntil until) {
  if (ended(state) || until == WaitUntil::accepted) return true;
  return until == WaitUntil::started && state == CommandState::active;
}

std::function<bool(const GroupRun&)> has_come(WaitUntil until) {
  return [until](const GroupRun& run) { return reached(run.state(), until); };
}

Error no_such_move(const std::string& id) {
  return {.reason = Reason::unknown_command,
          .message = fmt::format("there is no group move '{}' (any more)", id),
          .remedy = "its commands may still be known: axisctl command get"};
}

Error shutting_down() {
  return {.reason = Reason::cancelled,
          .message = "the daemon is shutting down",
          .remedy = "repeat it when it is back"};
}

}  // namespace

struct GroupAccessService::Gathering {
  std::vector<GroupStopResult> results;
  std::size_t missing = 0;
  std::function<void(std::vector<GroupStopResult>)> callback;
  void one_more() {
    if (--missing == 0) callback(std::move(results));
  }
};

void GroupAccessService::move(GroupMoveRequest request, CommandOptions options, WaitUntil until,
                              std::function<void(Result<GroupMove>)> callback) {
  options.arrived = loop_->clock().now();
  post(loop_->executor(), [this, request = std::move(request), options = std::move(options), until,
                           callback = std::move(callback)]() mutable {
    if (closing_) return callback(fail(shutting_down()));
    const bool when_told = request.start == GroupStart::when_told;
    const auto first = request.targets.empty() ? std::string() : request.targets.front().axis;
    const auto group = request.group;
    const auto run = machine_->groups().move(std::move(request), options);
    if (!run) {
      machine_->audit().refused(first, GroupMemberRequest{}, options, run.error(), group);
      return callback(fail(run.error()));
    }
    if (when_told)
      answer_when(*run, [](const GroupRun& now) { return now.prepared(); }, std::move(callback));
    else
      answer_when(*run, has_come(until), std::move(callback));
  });
}

void GroupAccessService::answer_when(const GroupRunPtr& run, std::function<bool(const GroupRun&)> reached,
                                     Callback callback) {
  run->observe([executor = loop_->executor(), reached = std::move(reached),
                callback = std::move(callback)](const GroupRun& now) {
    if (!reached(now)) return false;
    // From a handler of its own: whoever hears of it finds the axes' states published.
    post(executor, [callback, value = now.value()] { callback(value); });
    return true;
  });
}

Result<GroupRunPtr> GroupAccessService::find_own(const std::string& id, const std::string& client) const {
  auto run = machine_->groups().find_run(id);
  if (!run) return fail(no_such_move(id));
  if (run->commands().front()->value().client != client)
    return fail(Reason::access_denied, fmt::format("group move '{}' was prepared by another client", id),
                "start and renew it as who prepared it; stop it as anybody");
  return run;
}

void GroupAccessService::start(GroupStartRequest request, WaitUntil until, Callback callback) {
  post(loop_->executor(),
       [this, request = std::move(request), until, callback = std::move(callback)]() mutable {
         if (closing_) return callback(fail(shutting_down()));
         const auto run = find_own(request.id, request.client);
         if (!run) return callback(fail(run.error()));
         if (const auto told = (*run)->start_at(request.at); !told) return callback(fail(told.error()));
         answer_when(*run, has_come(until), std::move(callback));
       });
}

void GroupAccessService::renew(std::string id, std::string client, GroupRenewal renewal, Callback callback) {
  post(loop_->executor(),
       [this, id = std::move(id), client = std::move(client), renewal, callback = std::move(callback)] {
         const auto run = find_own(id, client);
         if (!run) return callback(fail(run.error()));
         (*run)->renew(renewal);
         callback((*run)->value());
       });
}

void GroupAccessService::get(std::string id, std::function<void(Result<GroupMove>)> callback) {
  post(loop_->executor(), [this, id = std::move(id), callback = std::move(callback)] {
    const auto run = machine_->groups().find_run(id);
    if (run) return callback(run->value());
    callback(fail(no_such_move(id)));
  });
}

std::vector<std::string> GroupAccessService::resolve(const MachineTable& table, const std::string& group,
                                                     const std::vector<std::string>& axes,
                                                     const Unknown& unknown) {
  auto names = axes;
  if (!group.empty()) {
    const auto found = std::ranges::find(table.groups, group, &GroupSettings::name);
    if (found != table.groups.end())
      names.insert(names.begin(), found->axes.begin(), found->axes.end());
    else
      unknown(group, no_such_group(group, names_of(table.groups), table.axes));
  }
  std::vector<std::string> known;
  std::set<std::string_view> seen;
  for (const auto& name : names) {
    // What was probably meant is not looked for among all axes: of a thousand names that would hold up
    // whoever wants to stop.
    if (table.find(name) == nullptr)
      unknown(name, no_such_axis(name, {}));
    else if (seen.insert(name).second)
      known.push_back(name);
  }
  return known;
}

void GroupAccessService::stop(GroupStopRequest request, std::string client, WaitUntil until,
                              std::function<void(std::vector<GroupStopResult>)> callback) {
  auto gathering = std::make_shared<Gathering>();
  gathering->callback = std::move(callback);
  const auto table = machine_->table();
  const auto axes =
      resolve(*table, request.group, request.axes, [&](const std::string& name, const Error& error) {
        gathering->results.push_back({.axis = name, .command = fail(error)});
      });
  if (axes.empty())
    return post(loop_->executor(), [gathering] { gathering->callback(std::move(gathering->results)); });
  auto serve = [this, gathering, axes, request, client, until, arrived = loop_->clock().now()] {
    const auto known = gathering->results.size();
    // One more for each whose hold the disk has to know first.
    gathering->missing = axes.size() * (request.hold ? 2 : 1);
    std::vector<Result<CommandPtr>> commands;
    const StopRequest stop{.kind = request.kind, .hold = request.hold};
    const CommandOptions options{
        .client = client, .request_id = request.request_id, .arrived = arrived, .origin = request.origin};
    for (const auto& axis : axes) {
      gathering->results.push_back({.axis = axis, .command = fail(Reason::internal, "no answer")});
      commands.push_back(
          request.hold ? machine_->submit_held(axis, stop, options, [gathering] { gathering->one_more(); })
                       : machine_->submit(axis, stop, options));
      if (request.hold && !commands.back()) --gathering->missing;  // nothing is held
    }
    for (std::size_t i = 0; i < commands.size(); ++i) gather(gathering, known + i, commands[i], until);
  };
  std::vector<std::shared_ptr<AxisGate>> gates;
  gates.reserve(axes.size());
  for (const auto& axis : axes) gates.push_back(table->find(axis)->gate);
  loop_->lane().request(std::move(gates), std::move(serve), std::move(client));
}

void GroupAccessService::release_stop(GroupReleaseRequest request,
                                      std::function<void(std::vector<GroupReleaseResult>)> callback) {
  struct Gathering {
    std::vector<GroupReleaseResult> results;
    std::size_t missing = 0;
    std::function<void(std::vector<GroupReleaseResult>)> callback;
  };
  auto gathering = std::make_shared<Gathering>();
  gathering->callback = std::move(callback);
  request.release.arrived = loop_->clock().now();
  post(loop_->executor(), [this, gathering, request = std::move(request)] {
    auto& results = gathering->results;
    const auto axes = resolve(*machine_->table(), request.group, request.axes,
                              [&](const std::string& name, const Error& error) {
                                results.push_back({.axis = name, .holds = fail(error)});
                              });
    if (axes.empty()) return gathering->callback(std::move(results));
    gathering->missing = axes.size();
    for (const auto& axis : axes) {
      const auto index = results.size();
      results.push_back({.axis = axis, .holds = fail(Reason::internal, "no answer")});
      machine_->release_stop(axis, request.release, [gathering, index](Result<StopReleased> released) {
        auto& holds = gathering->results[index].holds;
        if (released)
          holds = std::move(released->holds);
        else
          holds = fail(released.error());
        if (--gathering->missing == 0) gathering->callback(std::move(gathering->results));
      });
    }
  });
}

void GroupAccessService::gather(const std::shared_ptr<Gathering>& gathering, std::size_t index,
                                const Result<CommandPtr>& command, WaitUntil until) {
  const auto take = [gathering, index](Result<Command> result) {
    gathering->results[index].command = std::move(result);
    gathering->one_more();
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
