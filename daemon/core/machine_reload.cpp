// Another configuration for a machine that runs: checked and begun in one handler, then, when what has to
// make room has ended, carried out in one handler. What is the same in both is not touched.
#include <fmt/format.h>
#include <spdlog/spdlog.h>

#include <algorithm>
#include <utility>

#include "buses/limited_log.hpp"
#include "buses/log_about.hpp"
#include "daemon/core/machine_core.hpp"

namespace axisd::core {

namespace {

using Kind = ConfigurationChangeKind;

/// How often it is looked whether what has to end has ended: some milliseconds, where nothing is silent.
constexpr auto look_again = std::chrono::milliseconds(1);
constexpr int stop_attempts = 3;
/// Of a stop that the axis itself does not confirm any more.
constexpr auto longest_deceleration = std::chrono::seconds(3);
constexpr auto look_at_motion = std::chrono::milliseconds(20);

/// What a running daemon cannot change; these keys are read at its start.
bool needs_restart(const ConfigurationChange& change) {
  static constexpr std::string_view fixed[] = {"machine",         "state_directory", "server",
                                               "flight_recorder", "audit",           "buses"};
  return std::ranges::find(fixed, change.section) != std::ranges::end(fixed);
}

bool concerns_another_drive(const ConfigurationChange& change) {
  return std::ranges::any_of(
      change.keys, [](std::string_view key) { return key == "bus" || key == "node" || key == "model"; });
}

/// "limits.velocity" is of "limits", and so is "limits" itself.
bool is_of(std::string_view key, std::string_view part) {
  return key == part || (key.starts_with(part) && key.substr(part.size()).starts_with('.'));
}

/// Only keys that the daemon uses by itself: the drive gets nothing written for them.
bool is_of_the_daemon_alone(const ConfigurationChange& change) {
  static constexpr std::string_view own[] = {
      "limits.velocity", "limits.eeprom_saves_per_day", "poll", "turnaround_max", "jog_travel",
      "on_lease_loss",   "position_tolerance"};
  return change.kind == Kind::changed && !change.keys.empty() &&
         std::ranges::all_of(change.keys, [](std::string_view key) {
           return std::ranges::any_of(own, [&](auto part) { return is_of(key, part); });
         });
}

/// What a position says depends on these; on another drive it says nothing (M20).
bool keeps_position(const ConfigurationChange& change) {
  static constexpr std::string_view datum[] = {"bus",    "node",   "model", "scale",
                                               "homing", "inputs", "unit",  "drive"};
  return change.kind == Kind::changed && !change.keys.empty() &&
         std::ranges::none_of(change.keys, [](std::string_view key) {
           return std::ranges::any_of(datum, [&](auto part) { return is_of(key, part); });
         });
}

Error restart_needed(const ConfigurationChange& change) {
  return {.reason = Reason::not_supported,
          .message = fmt::format("{}: this is read at the start of the daemon only", to_string(change)),
          .remedy = "restart the service for it, or put it back and reload the rest"};
}

template <class Settings>
bool named(const Settings& settings, const std::string& name) {
  return settings.name == name;
}

}  // namespace

/// Whoever comes after would not know that the next SYNC starts the drive (M24).
void MachineCore::check_sync_for_reload(const ConfigurationChange& change,
                                        std::vector<Error>& refusals) const {
  const auto* axis = find(change.name);
  const auto* network = axis == nullptr ? nullptr : find_network(axis->settings().bus);
  if (network == nullptr || !(network->armed(axis->settings().node) || network->waits(axis->settings().node)))
    return;
  refusals.push_back(
      {.reason = Reason::busy,
       .message = fmt::format("{}: its drive may hold something for the next SYNC", change.name),
       .remedy = "wait for the group's move to end; else switch the drive off and on",
       .where = {.bus = network->name(), .node = axis->settings().node}});
}

/// A node that comes or goes stops SYNC on its network, and nobody starts by it until that node is known.
void MachineCore::check_groups_for_reload(const Reload& reload, const ConfigurationChange& change,
                                          std::vector<Error>& refusals) const {
  std::vector<std::string> networks;
  if (const auto* axis = find(change.name)) networks.push_back(axis->settings().bus);
  for (const auto& entry : reload.configuration.axes)
    if (named(entry.axis, change.name)) networks.push_back(entry.axis.bus);
  for (const auto& axis : axes_) {
    const auto& settings = axis->settings();
    const bool beside = settings.name != change.name && find_network(settings.bus) != nullptr &&
                        std::ranges::find(networks, settings.bus) != networks.end();
    const auto run = beside ? groups_.engaged(settings.name) : nullptr;
    if (run == nullptr) continue;
    refusals.push_back(
        {.reason = Reason::busy,
         .message = fmt::format("{}: group move {} is under way on {}", change.name, run->id(), settings.bus),
         .remedy = "wait for its end, or stop it"});
    return;
  }
}

/// Whoever leases an axis relies on what it does: another client may not change that under its hands. It is
/// not taken away here: that is what `lease acquire --take` is for, which asks for it by name and is audited.
void MachineCore::check_lease_for_reload(const Reload& reload, const ConfigurationChange& change,
                                         std::vector<Error>& refusals) const {
  const auto* lease = leases_.table().find(change.name);
  if (lease == nullptr || parts_.clock->now() >= lease->expires) return;
  if (lease->client != reload.client)
    refusals.push_back({.reason = Reason::lease_required,
                        .message = fmt::format("{}: leased by {}", change.name, lease->holder()),
                        .remedy = fmt::format("ask its holder to release it, or take it over: axisctl lease "
                                              "acquire {} --take; then reload as the same client",
                                              change.name)});
  else if (change.kind == Kind::removed)
    refusals.push_back({.reason = Reason::lease_required,
                        .message = fmt::format("{}: leased by {}", change.name, lease->holder()),
                        .remedy = "release the lease first: the axis would be gone"});
}

std::vector<Error> MachineCore::check_reload(const Reload& reload) const {
  std::vector<Error> refusals;
  if (life_ != Life::running)
    refusals.push_back({.reason = Reason::cancelled,
                        .message = "the daemon is shutting down",
                        .remedy = "it reads the file when it is started again"});
  if (exchange_.state == Exchange::State::under_way)
    refusals.push_back(
        {.reason = Reason::busy, .message = "another reload is under way", .remedy = "wait for its end"});
  for (const auto& change : reload.changes) {
    if (needs_restart(change)) refusals.push_back(restart_needed(change));
    if (change.section == "axes") {
      check_parts(reload, change, refusals);
      check_groups_for_reload(reload, change, refusals);
    }
    if (change.kind == Kind::added) continue;
    if (change.section == "axes") {
      if (const auto* axis = find(change.name); axis != nullptr)
        std::ranges::move(axis->check_exchange(is_of_the_daemon_alone(change)), std::back_inserter(refusals));
      if (const auto run = groups_.engaged(change.name); run != nullptr)
        refusals.push_back({.reason = Reason::moving,
                            .message = fmt::format("{}: a member of group move {}", change.name, run->id()),
                            .remedy = "wait for its end, or stop it"});
      check_sync_for_reload(change, refusals);
      check_lease_for_reload(reload, change, refusals);
    } else if (change.section == "devices") {
      const auto device = std::ranges::find_if(
          devices_, [&](const auto& each) { return named(each->settings(), change.name); });
      if (device != devices_.end() && (*device)->in_use())
        refusals.push_back({.reason = Reason::busy,
                            .message = fmt::format("{}: it is being written to", change.name),
                            .remedy = "wait for it"});
    }
  }
  return refusals;
}

/// What the start of the daemon would fail at: the loader has refused it, so nobody should ever see this.
void MachineCore::check_parts(const Reload& reload, const ConfigurationChange& change,
                              std::vector<Error>& refusals) const {
  const auto& axes = reload.configuration.axes;
  const auto entry =
      std::ranges::find_if(axes, [&](const auto& each) { return each.axis.name == change.name; });
  if (entry == axes.end()) return;
  const auto* descriptor = descriptor_of(entry->axis);
  const bool made = descriptor != nullptr && drive_setup(entry->axis, *descriptor).has_value();
  // A bus that is new is named by what needs a restart.
  if (made) return;
  refusals.push_back({.reason = Reason::internal,
                      .message = fmt::format("{}: no drive can be made for it", change.name),
                      .remedy = "report this with the configuration"});
}

void MachineCore::reload(Reload reload, ReloadDone done) {
  if (auto refusals = check_reload(reload); !refusals.empty()) return done(std::move(refusals));
  exchange_.state = Exchange::State::under_way;
  for (const auto& change : reload.changes) {
    if (change.kind == Kind::added) continue;
    if (change.section == "axes") {
      exchange_.leaving.try_emplace(change.name);
      find(change.name)->retire(keeps_position(change));
    } else if (change.section == "devices") {
      for (const auto& device : devices_)
        if (named(device->settings(), change.name)) device->close();
    }
  }
  launch(run_reload(std::move(reload), std::move(done)), "reload");
}

bool MachineCore::has_made_room() const {
  return exchange_.stops_on_their_way == 0 &&
         std::ranges::all_of(exchange_.leaving,
                             [this](const auto& axis) { return find(axis.first)->closed(); }) &&
         std::ranges::all_of(devices_, [](const auto& device) {
           return !device->closing() || (device->closed() && !device->in_use());
         });
}

Task<> MachineCore::run_reload(Reload reload, ReloadDone done) {
  for (;;) {
    while (!has_made_room())
      co_await sleep_until(parts_.executor, *parts_.clock, parts_.clock->now() + look_again);
    const auto name = closing() ? std::string() : unstopped(reload);
    if (name.empty()) break;
    co_await stop_leaving(name);  // others may have got something to do meanwhile
  }
  if (life_ != Life::running) {
    const Error cause{.reason = Reason::cancelled,
                      .message = "the daemon is shutting down",
                      .remedy = "it reads the file when it is started again"};
    for (auto& [axis, stops] : exchange_.leaving)
      for (const auto& stop : stops) stop.command->abort(cause);
    exchange_.state = Exchange::State::given_up;
    co_return done({cause});
  }
  carry_out(reload);
  done({});
}

/// An axis whose drive nobody has any more, and that was told to stop: it has nobody to leave that to.
std::string MachineCore::unstopped(const Reload& reload) const {
  for (const auto& change : reload.changes) {
    if (change.section != "axes" || change.kind == Kind::added) continue;
    const bool for_good =
        life_ == Life::ending || change.kind == Kind::removed || concerns_another_drive(change);
    if (for_good && !exchange_.leaving.at(change.name).empty()) return change.name;
  }
  return {};
}

/// For whom nobody else confirms them: all of them at once, as each asks for the same.
Task<> MachineCore::stop_leaving(std::string name) {
  auto& axis = *find(name);
  const auto stops = std::exchange(exchange_.leaving.at(name), {});
  auto kind = StopKind::stop;
  for (const auto& stop : stops) {
    kind = std::max(kind, stop.request.kind);
    axis.gate()->stop_served();
  }
  const auto until = parts_.clock->now() + longest_deceleration;
  auto sample = Result<DriveSample>(fail(Reason::internal, "not stopped"));
  for (int attempt = 0; attempt < stop_attempts; ++attempt) {
    const auto sent = co_await axis.drive().stop(kind);
    sample = sent ? co_await axis.drive().read_state(TransactionClass::moving_state)
                  : Result<DriveSample>(fail(sent.error()));
    if (sample) break;
  }
  while (sample && sample->moving && parts_.clock->now() < until && !closing()) {
    co_await sleep_until(parts_.executor, *parts_.clock, parts_.clock->now() + look_at_motion);
    sample = co_await axis.drive().read_state(TransactionClass::moving_state);
  }
  const bool rests = sample && !sample->moving;
  exchange_.unconfirmed = exchange_.unconfirmed || !rests;
  if (!rests) spdlog::error("{}: standstill was not confirmed; look at the machine", name);
  for (const auto& stop : stops) {
    if (rests)
      stop.command->done();
    else if (sample)
      stop.command->error({.reason = Reason::not_confirmed,
                           .message = fmt::format("{}: standstill was not confirmed", name),
                           .remedy = "look at the machine"});
    else
      stop.command->unknown(sample.error());
  }
}

/// Whoever confirms it later: its frame goes out now. (The drive is there until all have made room.)
Task<> MachineCore::send_stop(Axis& axis, StopKind kind) {
  (void)co_await axis.drive().stop(kind);
  --exchange_.stops_on_their_way;
}

/// Nothing waits in here: whoever looks before or after finds one configuration, whole.
void MachineCore::carry_out(Reload& reload) {
  clear_away();
  if (parts_.reconfigure_simulation) parts_.reconfigure_simulation(reload.configuration, reload.changes);
  const auto axes = renew_axes(reload);
  const auto devices = renew_devices(reload);
  groups_.configure(reload.configuration.groups);
  leases_.configure(reload.configuration.leases);
  parts_.budgets = std::move(reload.budgets);
  publish_table();
  expect_stops();
  exchange_.state = Exchange::State::none;
  auto leaving = std::exchange(exchange_.leaving, {});
  for (auto* device : devices) device->start();
  for (auto* axis : axes) {
    const auto before = exchange_.left_behind.find(axis->settings().name);
    axis->start(before != exchange_.left_behind.end() && before->second.answered &&
                before->second.bus == axis->settings().bus && before->second.node == axis->settings().node);
  }
  exchange_.left_behind.clear();
  tell_reloaded(reload);
  for (auto& [name, stops] : leaving)  // of axes that are gone there are none any more
    for (auto& stop : stops) find(name)->take_stop(stop.request, stop.options, std::move(stop.command));
}

/// In the order of the file. Those that are new.
std::vector<Axis*> MachineCore::renew_axes(const Reload& reload) {
  std::vector<Axis*> fresh;
  std::vector<std::unique_ptr<Axis>> axes;
  for (const auto& [settings, simulation] : reload.configuration.axes) {
    const auto kept = std::ranges::find_if(
        axes_, [&](const auto& axis) { return axis && named(axis->settings(), settings.name); });
    if (kept != axes_.end()) {
      axes.push_back(std::move(*kept));
      continue;
    }
    const auto found = exchange_.left_behind.find(settings.name);
    const auto* before = found == exchange_.left_behind.end() ? nullptr : &found->second;
    // A gate belongs to a bus, too: on another one it is a new one, under the same lease.
    const bool moved = before != nullptr && before->bus != settings.bus;
    axes.push_back(make_axis(settings, before == nullptr || moved ? nullptr : before->face));
    fresh.push_back(axes.back().get());
    if (moved)
      fresh.back()->gate()->set_fencing_token(before->face->gate->fencing_token(),
                                              before->face->gate->lease_expires());
    if (before != nullptr && before->owes_release)
      fresh.back()->lease_lost({.reason = Reason::lease_lost,
                                .message = "a lease ended while the configuration was being reloaded",
                                .remedy = "acquire a lease again"});
  }
  axes_ = std::move(axes);
  by_name_.clear();
  for (const auto& axis : axes_) by_name_.emplace(axis->settings().name, axis.get());
  return fresh;
}

std::vector<Device*> MachineCore::renew_devices(const Reload& reload) {
  std::vector<Device*> fresh;
  std::vector<std::unique_ptr<Device>> devices;
  for (const auto& settings : reload.configuration.devices) {
    const auto kept = std::ranges::find_if(
        devices_, [&](const auto& device) { return device && named(device->settings(), settings.name); });
    if (kept != devices_.end()) {
      devices.push_back(std::move(*kept));
      continue;
    }
    devices.push_back(make_device(settings));
    fresh.push_back(devices.back().get());
  }
  devices_ = std::move(devices);
  return fresh;
}

/// Axes and devices that have ended, with what their buses keep for them.
void MachineCore::clear_away() {
  const auto forget_node = [this](const std::string& bus, std::uint8_t node) {
    if (auto* line = find_line(bus)) line->set_turnaround_max(node, std::nullopt);
  };
  for (const auto& [name, stops] : exchange_.leaving) {
    const auto* axis = find(name);
    exchange_.left_behind.emplace(name, LeftBehind{.face = axis->face(),
                                                   .bus = axis->settings().bus,
                                                   .node = axis->settings().node,
                                                   .answered = axis->answered(),
                                                   .owes_release = axis->owes_release()});
    forget_node(axis->settings().bus, axis->settings().node);
    groups_.let_go(name);
    by_name_.erase(name);
    std::erase_if(axes_, [&](const auto& each) { return each.get() == axis; });
  }
  for (const auto& device : devices_)
    if (device->closing()) forget_node(device->settings().bus, device->settings().node);
  std::erase_if(devices_, [](const auto& device) { return device->closing(); });
}

void MachineCore::tell_reloaded(const Reload& reload) {
  if (reload.changes.empty())
    log_limited(spdlog::level::info, reload.client, "reloads",
                fmt::format("reloads the configuration: nothing has changed{}",
                            reload.before == reload.revision ? "" : " but how it is written"));
  if (reload.changes.empty() && reload.before == reload.revision) return;
  for (const auto& change : reload.changes)
    log_about(spdlog::level::warn, LogKind::configuration_served, {.client = reload.client},
              fmt::format("{} reloads the configuration: {}", reload.client, to_string(change)));
  events_.record(parts_.clock->wall(parts_.clock->now()), {},
                 ConfigurationReloaded{.client = reload.client,
                                       .before = reload.before,
                                       .revision = reload.revision,
                                       .changes = reload.changes});
}

CommandPtr MachineCore::hold_stop(std::vector<HeldStop>& stops, const std::string& axis,
                                  const StopRequest& request, const CommandOptions& options) {
  auto always = options;
  always.request_id.clear();
  auto command = book_.open(axis, request, always);
  stops.push_back({.request = request, .options = std::move(always), .command = command});
  if (exchange_.state == Exchange::State::under_way) {
    ++exchange_.stops_on_their_way;
    launch(send_stop(*find(axis), request.kind), "stop");
  } else {  // the reload was given up, because the daemon ends
    launch(stop_leaving(axis), "stop");
  }
  return command;
}

}  // namespace axisd::core
