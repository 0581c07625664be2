#include "daemon/core/machine_service.hpp"

#include <fmt/format.h>
#include <spdlog/spdlog.h>

#include <utility>

#include "devices/nearest.hpp"

namespace axisd::core {

namespace {

bool reached(const Command& command, WaitUntil until) {
  if (ended(command.state) || until == WaitUntil::accepted) return true;
  return until == WaitUntil::started && command.state == CommandState::active;
}

std::unexpected<Error> closing() {
  return fail(Reason::cancelled, "the daemon is shutting down", "repeat the request when it is back");
}

std::unexpected<Error> unknown_command(const std::string& id) {
  return fail(Reason::unknown_command, fmt::format("there is no command '{}' (any more)", id),
              "commands that have ended are remembered for 30 minutes at most, and not beyond the newest few "
              "thousand; those without a request_id not over a restart");
}

}  // namespace

MachineService::MachineService(CoreLoop& loop, MachineCore& machine, std::string name,
                               std::string instance_id)
    : loop_(&loop),
      machine_(&machine),
      drive_access_(loop.executor(), loop.clock(), machine),
      bus_access_(loop.executor(), loop.clock(), machine),
      bus_watch_(loop.executor(), loop.clock(), machine),
      lease_access_(loop.executor(), machine.leases()),
      group_access_(loop, machine),
      name_(std::move(name)),
      instance_id_(std::move(instance_id)) {}

std::vector<std::string> MachineService::axis_names() const { return machine_->table()->axes; }

AxisSnapshotPtr MachineService::snapshot(std::string_view axis) const {
  const auto table = machine_->table();
  const auto* found = table->find(axis);
  return found == nullptr ? nullptr : found->snapshot.load();
}

MachineInfo MachineService::info() const {
  MachineInfo info{.machine = name_, .version = AXISD_VERSION, .instance_id = instance_id_};
  if (const auto by = machine_->inhibited_by()) {
    info.inhibited = true;
    info.inhibited_by = *by;
  }
  if (const auto why = machine_->state_gate().unaccepted()) info.state_unaccepted = *why;
  info.storage_error = machine_->storage_error();
  if (!info.storage_error) info.storage_error = machine_->doubt();
  return info;
}

/// Calls back once, when the command has come as far as the caller wants to wait. A change is told from a
/// handler of its own, so that whoever hears of it finds the axis's state published.
void MachineService::answer(const Result<CommandPtr>& command, WaitUntil until, CommandCallback callback) {
  if (!command) return callback(fail(command.error()));
  if (reached((*command)->value(), until)) return callback((*command)->value());
  auto pending = std::make_shared<CommandCallback>(std::move(callback));
  (*command)->observe(pending, [executor = loop_->executor(), until, keep = pending](const Command& now) {
    if (!*keep || !reached(now, until)) return;
    post(executor, [tell = std::exchange(*keep, nullptr), now] { tell(now); });
  });
}

void MachineService::submit(std::string axis, Action action, CommandOptions options, WaitUntil until,
                            CommandCallback callback) {
  const auto table = machine_->table();
  const auto* found = table->find(axis);
  const auto* stop = std::get_if<StopRequest>(&action);
  const bool disable = std::holds_alternative<DisableRequest>(action);
  options.arrived = now();
  auto client = options.client;
  auto serve = [this, axis, action = std::move(action), options = std::move(options), until,
                callback = std::move(callback)]() mutable {
    const bool is_stop =
        std::holds_alternative<StopRequest>(action) || std::holds_alternative<DisableRequest>(action);
    if (closing_ && !is_stop) return callback(closing());
    if (const auto* held = std::get_if<StopRequest>(&action); held != nullptr && held->hold)
      return submit_held(axis, *held, options, until, std::move(callback));
    answer(machine_->submit(axis, action, options), until, std::move(callback));
  };
  if (found != nullptr && (stop != nullptr || disable))
    loop_->lane().request({found->gate}, std::move(serve), std::move(client));
  else
    post(loop_->executor(), std::move(serve));
}

/// The stop waits for nothing; its answer does for the disk.
void MachineService::submit_held(const std::string& axis, const StopRequest& request,
                                 const CommandOptions& options, WaitUntil until, CommandCallback callback) {
  struct Gathering {
    Result<Command> command = fail(Reason::internal, "no answer");
    int missing = 2;
    CommandCallback callback;
    void one_more() {
      if (--missing == 0) callback(std::move(command));
    }
  };
  auto gathering = std::make_shared<Gathering>();
  const auto command = machine_->submit_held(axis, request, options, [gathering] { gathering->one_more(); });
  if (!command) return callback(fail(command.error()));
  gathering->callback = std::move(callback);
  answer(command, until, [gathering](Result<Command> result) {
    gathering->command = std::move(result);
    gathering->one_more();
  });
}

void MachineService::explain(std::string axis, std::optional<Action> action, CommandOptions options,
                             std::function<void(Result<std::vector<Obstacle>>)> callback) {
  post(loop_->executor(), [this, axis = std::move(axis), action = std::move(action),
                           options = std::move(options), callback = std::move(callback)] {
    const auto* found = machine_->find(axis);
    if (found == nullptr) return callback(fail(no_such_axis(axis, machine_->table()->axes)));
    callback(found->explain(action, options));
  });
}

void MachineService::release_stop(std::string axis, HoldRelease release,
                                  std::function<void(Result<StopReleased>)> callback) {
  release.arrived = now();
  post(loop_->executor(), [this, axis = std::move(axis), release = std::move(release),
                           callback = std::move(callback)]() mutable {
    if (closing_) return callback(closing());
    machine_->release_stop(axis, release, std::move(callback));
  });
}

/// The stops wait for nothing; their answer does for the disk.
void MachineService::stop_all(Requester requester, WaitUntil until,
                              std::function<void(AllStopped)> callback) {
  struct Gathering {
    AllStopped answer{};
    std::size_t missing = 1;  ///< the latch, and each stop
    std::function<void(AllStopped)> callback;
    void one_more() {
      if (--missing == 0) callback(std::move(answer));
    }
  };
  auto client = requester.client;
  auto serve = [this, requester = std::move(requester), arrived = now(), until,
                callback = std::move(callback)]() mutable {
    auto gathering = std::make_shared<Gathering>();
    gathering->callback = std::move(callback);
    ++gathering->missing;  // until all are counted
    const auto latched = [gathering](std::optional<Error> error) {
      gathering->answer.not_durable = std::move(error);
      gathering->one_more();
    };
    const auto commands = machine_->stop_all(requester.client, arrived, latched, requester.origin);
    gathering->answer.stops.assign(commands.size(), fail(Reason::internal, "no answer"));
    gathering->missing += commands.size();
    for (std::size_t i = 0; i < commands.size(); ++i)
      answer(commands[i], until, [gathering, i](Result<Command> result) {
        gathering->answer.stops[i] = std::move(result);
        gathering->one_more();
      });
    gathering->one_more();
  };
  const auto table = machine_->table();
  std::vector<std::shared_ptr<AxisGate>> gates;
  gates.reserve(table->faces.size());
  for (const auto& [name, axis] : table->faces) gates.push_back(axis->gate);
  loop_->lane().request(std::move(gates), std::move(serve), std::move(client), StopReach::machine);
}

void MachineService::release_inhibit(std::string client, std::function<void(Result<void>)> callback) {
  post(loop_->executor(), [this, client = std::move(client), callback = std::move(callback)]() mutable {
    machine_->release_inhibit(client, std::move(callback));
  });
}

void MachineService::kept_state(std::function<void(KeptStateReport)> callback) {
  post(loop_->executor(),
       [this, callback = std::move(callback)] { callback(machine_->state_gate().report()); });
}

void MachineService::accept_state(std::string client,
                                  std::function<void(Result<std::vector<Conviction>>)> callback) {
  post(loop_->executor(), [this, client = std::move(client), callback = std::move(callback)] {
    machine_->state_gate().accept(client, callback);
  });
}

void MachineService::list_commands(std::string axis, std::size_t most,
                                   std::function<void(std::vector<Command>)> callback) {
  post(loop_->executor(), [this, axis = std::move(axis), most, callback = std::move(callback)] {
    callback(machine_->commands().newest(axis, most));
  });
}

void MachineService::get_command(std::string id, CommandCallback callback) {
  post(loop_->executor(), [this, id = std::move(id), callback = std::move(callback)] {
    const auto command = machine_->book().find(id);
    command ? callback(command->value()) : callback(unknown_command(id));
  });
}

std::shared_ptr<void> MachineService::watch_command(std::string id, CommandCallback callback) {
  auto token = std::make_shared<int>(0);
  post(loop_->executor(),
       [this, id = std::move(id), callback = std::move(callback), alive = std::weak_ptr<void>(token)] {
         const auto command = machine_->book().find(id);
         if (!command) return callback(unknown_command(id));
         callback(command->value());
         command->observe(alive, [executor = loop_->executor(), alive, callback](const Command& now) {
           post(executor, [alive, callback, now] {
             if (alive.lock()) callback(now);
           });
         });
       });
  return token;
}

/// Halts an axis, which only the core knows.
void MachineService::cancel_command(std::string id, std::string client, CommandCallback callback) {
  loop_->lane().request(
      {},
      [this, id = std::move(id), arrived = now(), callback = std::move(callback)]() mutable {
        const auto command = machine_->book().find(id);
        if (!command) return callback(unknown_command(id));
        auto* axis = machine_->find(command->value().axis);
        // Of an axis that the configuration no longer has: it has ended.
        answer(axis == nullptr ? command : axis->cancel(command, arrived), WaitUntil::accepted,
               std::move(callback));
      },
      std::move(client));
}

void MachineService::buses(std::function<void(std::vector<BusStatus>)> callback) {
  post(loop_->executor(), [this, callback = std::move(callback)] { callback(machine_->bus_status()); });
}

void MachineService::budgets(std::function<void(std::vector<BusBudgetReport>)> callback) {
  post(loop_->executor(), [this, callback = std::move(callback)] { callback(machine_->budgets()); });
}

void MachineService::reload(Reload reload, bool dry_run, ReloadDone done) {
  // Shared: what is posted has to be copyable, and this need not be copied.
  auto whole = std::make_shared<Reload>(std::move(reload));
  post(loop_->executor(), [this, whole = std::move(whole), dry_run, done = std::move(done)] {
    if (closing_) return done({closing().error()});
    if (dry_run) return done(machine_->check_reload(*whole));
    machine_->reload(std::move(*whole), done);
  });
}

void MachineService::on_published(std::function<void()> notify) { notify_ = std::move(notify); }

void MachineService::published() const {
  if (notify_) notify_();
}

}  // namespace axisd::core
