// The composition root: the whole program from top to bottom, torn down in reverse.
#include "daemon/daemon.hpp"

#include <fmt/format.h>
#include <malloc.h>
#include <spdlog/spdlog.h>
#include <systemd/sd-daemon.h>

#include <algorithm>
#include <csignal>
#include <cstdlib>
#include <exception>
#include <filesystem>
#include <fstream>
#include <future>
#include <iostream>
#include <random>
#include <thread>

#include "api/server/access.hpp"
#include "api/server/audit_convert.hpp"
#include "api/server/door_check.hpp"
#include "api/server/lane/stop_lane.hpp"
#include "api/server/server.hpp"
#include "api/tls/pem_files.hpp"
#include "config/budget.hpp"
#include "config/file_warnings.hpp"
#include "config/position_warnings.hpp"
#include "config/start_warnings.hpp"
#include "daemon/audit_reader.hpp"
#include "daemon/configuration_service.hpp"
#include "daemon/core/core_loop.hpp"
#include "daemon/core/machine_core.hpp"
#include "daemon/core/machine_service.hpp"
#include "daemon/core/quiesce.hpp"
#include "daemon/descriptors.hpp"
#include "daemon/logging.hpp"
#include "daemon/metering.hpp"
#include "daemon/ports.hpp"
#include "daemon/state_copier.hpp"
#include "daemon/store/audit_log.hpp"
#include "daemon/store/flight_files.hpp"
#include "daemon/store/kept_state.hpp"
#include "devices/simulation/control_socket.hpp"

namespace axisd {

namespace {

/// Longest that the end of the daemon waits for moving axes.
constexpr auto stop_patience = std::chrono::seconds(10);
constexpr auto close_patience = std::chrono::seconds(3);
/// The loops come round at least every second; this is a stall.
constexpr auto stalled_after = std::chrono::seconds(3);
constexpr auto quiesce_limit = std::chrono::seconds(4);

/// Copy of the last configuration that was served, for --quiesce when the file itself was broken meanwhile.
std::filesystem::path last_good(const std::string& state_directory) {
  return std::filesystem::path(state_directory) / "last-good.yaml";
}

sigset_t ending_signals() {
  sigset_t set;
  sigemptyset(&set);
  for (const int number : {SIGTERM, SIGINT, SIGHUP}) sigaddset(&set, number);
  return set;
}

/// Starts of the daemon are counted durably, so ids never repeat; the random part tells two state directories
/// apart, and two runs from copies of the same one.
std::string make_instance_id(std::uint64_t start_count) {
  return fmt::format("{:x}{:08x}", start_count, std::random_device{}());
}

/// Runs `function` on the core thread and waits for its result.
template <class Function>
auto ask_core(core::CoreLoop& loop, Function function) {
  std::promise<decltype(function())> promise;
  auto future = promise.get_future();
  post(loop.executor(), [&] { promise.set_value(function()); });
  return future.get();
}

template <class Condition>
bool wait_until(Condition condition, Duration limit) {
  const auto end = monotonic_now() + limit;
  while (!condition()) {
    if (monotonic_now() >= end) return false;
    block_until(monotonic_now() + milliseconds(10));
  }
  return true;
}

void reload_at_a_signal(ConfigurationService& served) {
  served.reload("SIGHUP", false, [](const Result<ConfigurationReload>& result) {
    if (!result)
      spdlog::warn("SIGHUP: not reloaded: {}", to_string(result.error()));
    else if (!result->applied)
      spdlog::warn(
          "SIGHUP: not reloaded, and nothing was changed; axisctl config reload --dry-run tells why");
  });
}

/// Tells systemd that core, stop lane and workers make progress, and that clients are answered, until a
/// signal asks for the end: which one.
int supervise(core::CoreLoop& loop, const core::MachineCore& machine, const server::StopLane& stop_lane,
              server::DoorCheck& doors, ConfigurationService& served) {
  const auto signals = ending_signals();
  std::uint64_t interval_us = 0;
  const bool watched = sd_watchdog_enabled(0, &interval_us) > 0;
  for (;;) {
    const timespec period{.tv_sec = watched && interval_us < 4'000'000 ? 0 : 1,
                          .tv_nsec = watched ? 300'000'000 : 0};
    const int number = sigtimedwait(&signals, nullptr, &period);
    if (number == SIGHUP) reload_at_a_signal(served);
    if (number == SIGTERM || number == SIGINT) return number;
    const auto oldest = monotonic_now() - stalled_after;
    bool alive = loop.last_progress() > oldest && stop_lane.last_progress() > oldest;
    for (const auto& bus : machine.buses()) alive = alive && bus->last_progress() > oldest;
    doors.ask();
    const auto silent = doors.silent_since(oldest);
    if (!alive)
      spdlog::critical("core, stop lane or a bus worker makes no progress");
    else if (!silent.empty())
      spdlog::critical("no answer for clients: {}", fmt::join(silent, ", "));
    else if (watched)  // nobody may read what nobody asked for, and a full socket blocks
      sd_notify(0, "WATCHDOG=1");
  }
}

/// Stops what moves; true: everything rests.
bool stop_axes(core::CoreLoop& loop, core::MachineCore& machine) {
  const auto stopped = ask_core(loop, [&] { return machine.stop_moving_axes(); });
  if (!stopped.empty()) spdlog::info("stopping what moves: {}", fmt::join(stopped, ", "));
  return wait_until([&] { return ask_core(loop, [&] { return machine.at_rest(); }); }, stop_patience);
}

std::optional<server::TlsFiles> tls_files(const config::ServerSettings& settings) {
  if (!settings.tls) return std::nullopt;
  return server::TlsFiles{.certificate = settings.tls->certificate,
                          .key = settings.tls->key,
                          .client_ca = settings.tls->client_ca};
}

std::optional<AccessSettings> access_of(const config::Configuration& configuration) {
  if (!configuration.access) return std::nullopt;
  return server::expanded(*configuration.access, configuration.groups);
}

server::StopLaneOptions stop_lane_options(const config::ServerSettings& settings) {
  return {
      .listen = settings.stop_listen.empty() ? server::stop_lane_of(settings.listen) : settings.stop_listen,
      .tls = tls_files(settings)};
}

server::ServerOptions server_options(const config::ServerSettings& settings) {
  const auto& limits = settings.limits;
  return {.listen = {settings.listen},
          .tls = tls_files(settings),
          .reflection = settings.reflection,
          .limits = {.calls = limits.calls, .streams = limits.streams},
          .peers = {.connections = limits.connections},
          .stalled_reader_limit = limits.stalled_reader};
}

void log_budget(const BusBudgetReport& budget) {
  spdlog::info("budget of {}", config::summary(budget));
  for (const auto& warning : config::warnings(budget)) spdlog::warn("{}", warning);
}

/// `audit`: null as long as there is none yet.
Result<std::unique_ptr<store::KeptState>> open_state(const config::Configuration& configuration,
                                                     core::CoreLoop& loop,
                                                     const std::unique_ptr<store::AuditLog>& audit) {
  const IdLimits limits{.total = static_cast<std::size_t>(configuration.server.limits.request_ids)};
  return store::KeptState::open(
      configuration.state_directory, std::chrono::system_clock::now(), loop.executor(),
      {.bounds = {.most = limits.total + limits.reserve()},
       .other_trouble = [&audit]() { return audit ? audit->trouble() : std::nullopt; }});
}

std::filesystem::path audit_directory(const config::Configuration& configuration) {
  return std::filesystem::path(configuration.state_directory) / "audit";
}

/// What of the journal no record tells of is recovered first: whatever reached a wire is in the journal.
std::unique_ptr<store::AuditLog> open_audit(const config::Configuration& configuration,
                                            store::KeptState& state, const std::string& instance_id,
                                            std::string revision) {
  const auto encode = [](const store::AuditHead& head, const AuditEntry& entry) {
    v1::AuditRecord record;
    server::to_proto(entry, record);
    record.set_number(head.number);
    record.set_instance_id(head.instance_id);
    record.set_revision(head.revision);
    return server::audit_line(record);
  };
  const auto command_of = [](std::string_view line) -> std::optional<store::AuditFormat::Told> {
    auto told = server::told_command(line);
    if (!told) return std::nullopt;
    return store::AuditFormat::Told{.id = std::move(told->id), .ended = told->ended};
  };
  const auto& keys = configuration.audit;
  return std::make_unique<store::AuditLog>(
      store::AuditOptions{.directory = audit_directory(configuration),
                          .bounds = {.files = static_cast<std::size_t>(keys.files),
                                     .file_bytes = static_cast<std::uint64_t>(keys.file_size) * 1024},
                          .format = {.encode = encode, .command_of = command_of},
                          .instance_id = instance_id,
                          .revision = std::move(revision),
                          .earlier = store::recovered(state.journal().loaded())});
}

void record_run(store::AuditLog& audit, store::KeptState& state, DaemonRun::What what) {
  audit.add({.at = std::chrono::system_clock::now(),
             .uptime = monotonic_now().time_since_epoch(),
             .content = DaemonRun{
                 .what = what, .version = AXISD_VERSION, .start_count = state.state().loaded().start_count}});
}

/// What cannot be served as it is asked for would fail at the next start, too.
int give_up(const Error& error) {
  spdlog::critical("{}", to_string(error));
  return error.reason == Reason::invalid_argument ? exit_status::configuration : exit_status::failed;
}

/// Takes what `axisctl sim` says, where there are simulated drives; nothing: there are none, or it cannot.
/// While it lives the core runs.
std::unique_ptr<simulation::ControlSocket> open_simulation(Ports& ports,
                                                           const config::Configuration& configuration,
                                                           std::string_view instance_id) {
  const auto simulated = [](const auto& bus) { return bus.simulated(); };
  if (std::ranges::none_of(configuration.lines, simulated) &&
      std::ranges::none_of(configuration.networks, simulated))
    return nullptr;
  auto socket = simulation::ControlSocket::open(
      simulation_socket(instance_id),
      [&ports](std::string_view line) { return ports.simulation().execute(line); });
  if (socket) return std::move(*socket);
  spdlog::warn("axisctl sim will not work: {}", to_string(socket.error()));
  return nullptr;
}

/// The core's own thread, for as long as this lives.
class CoreThread {
 public:
  explicit CoreThread(core::CoreLoop& loop)
      : loop_(&loop), thread_([&loop] {
          pthread_setname_np(pthread_self(), "axisd-core");
          loop.run();
        }) {}
  CoreThread(const CoreThread&) = delete;
  ~CoreThread() {
    loop_->stop();
    thread_.join();
  }

 private:
  core::CoreLoop* loop_;
  std::thread thread_;
};

/// From the first thread to the last: all that were started have ended when it returns. Exit status.
int serve(const Options& options, const config::Configuration& configuration, const std::string& yaml,
          Logging& logging) {
  raise_descriptor_limit();
  if (auto enough = check_descriptor_limit(configuration); !enough) return give_up(enough.error());
  core::CoreLoop loop;
  std::unique_ptr<store::AuditLog> audit;  // after the state, which locks the directory
  auto state = open_state(configuration, loop, audit);
  if (!state) return give_up(state.error());
  core::FrameObserver wire_log;
  if (!options.wire_log.empty()) {
    auto opened = logging.open_wire_log(options.wire_log);
    if (!opened) return give_up(opened.error());
    wire_log = std::move(*opened);
  }
  store::FlightFiles flight_files(std::filesystem::path(configuration.state_directory) / "flight",
                                  static_cast<std::size_t>(configuration.flight_recorder.files),
                                  loop.executor());
  auto ports = Ports::open(loop, configuration, options.link_helper);
  if (!ports) return give_up(ports.error());

  const auto budgets = config::budgets(configuration);
  for (const auto& budget : budgets) log_budget(budget);
  for (const auto& warning : config::position_warnings(configuration)) spdlog::warn("{}", warning);
  for (const auto& warning : config::start_warnings(configuration)) spdlog::warn("{}", warning);
  for (const auto& warning : config::file_warnings(configuration)) spdlog::warn("{}", warning);
  const auto instance_id = make_instance_id((*state)->state().loaded().start_count);
  audit = open_audit(configuration, **state, instance_id, revision_of(yaml));
  record_run(*audit, **state, DaemonRun::What::began);
  AuditReader audit_reader(audit_directory(configuration), *audit);
  StateCopier state_copier(configuration.state_directory);
  core::MachineService* published_to = nullptr;
  core::MachineCore machine(
      {.executor = loop.executor(),
       .clock = &loop.clock(),
       .persistence = &(*state)->state(),
       .journal = &(*state)->journal(),
       .audit = audit.get(),
       .instance_id = instance_id,
       .make_line = [&](const auto& line) { return (*ports)->make_line(line); },
       .make_port = [&](const auto& network) { return (*ports)->make_port(network); },
       .link_helper = (*ports)->link_helper(),
       .observer = std::move(wire_log),
       .flight_records = &flight_files,
       .budgets = budgets,
       .reconfigure_simulation = [&](const auto& next,
                                     const auto& changes) { (*ports)->reconfigure(next, changes); },
       .published =
           [&published_to] {
             if (published_to != nullptr) published_to->published();
           }},
      configuration);
  malloc_trim(0);  // a full journal was read in many pieces: what they leave between each other goes back
  core::MachineService service(loop, machine, configuration.machine, instance_id);
  published_to = &service;
  const auto access = std::make_shared<server::AccessControl>(access_of(configuration));
  ConfigurationService served({.path = options.config,
                               .yaml = yaml,
                               .configuration = configuration,
                               .since = std::chrono::system_clock::now(),
                               .load = [&options] { return load_configuration(options); },
                               .check_tls = check_tls,
                               .last_good = last_good(configuration.state_directory),
                               .apply =
                                   [&service](core::Reload reload, bool dry_run, core::ReloadDone done) {
                                     service.reload(std::move(reload), dry_run, std::move(done));
                                   },
                               .adopted = [access](const auto& next) { access->replace(access_of(next)); }});
  auto serving = server_options(configuration.server);
  serving.configuration = &served;
  serving.audit = &audit_reader;
  serving.audit_sink = audit.get();
  serving.state_copies = &state_copier;
  serving.access = access;
  server::Server server(service, std::move(serving));
  auto stopping = stop_lane_options(configuration.server);
  stopping.access = access;
  server::StopLane stop_lane(service, std::move(stopping));
  Metering metering({.loop = loop,
                     .machine = machine,
                     .service = service,
                     .journal = (*state)->journal(),
                     .settings = configuration.server,
                     .budgets = budgets});
  machine.start();
  metering.start();
  const CoreThread core_thread(loop);

  int status = exit_status::failed;
  if (const auto stops = stop_lane.listen(); !stops) {
    status = give_up(stops.error());
  } else if (const auto port = server.start(); !port) {
    status = give_up(port.error());
  } else if (const auto metrics = metering.listen(); !metrics) {
    status = give_up(metrics.error());
  } else {
    stop_lane.serve();
    wait_until([&] { return ask_core(loop, [&] { return machine.buses_reported(); }); },
               std::chrono::seconds(1));
    served.keep_copy();
    server::DoorCheck doors([&server] { return server.connect_inside(); },
                            [&stop_lane] { return stop_lane.connect_inside(); });
    doors.ask();  // its connections are there before anybody else's
    spdlog::info("axisd {} serves '{}' on {} ({} axes)", AXISD_VERSION, configuration.machine,
                 *port == 0 ? configuration.server.listen : fmt::format("port {}", *port),
                 configuration.axes.size());
    const auto sim_socket = open_simulation(**ports, configuration, instance_id);
    sd_notify(0, "READY=1");
    const int number = supervise(loop, machine, stop_lane, doors, served);
    spdlog::info("ending: {}", number == SIGTERM ? "SIGTERM" : "SIGINT");
    sd_notify(0, "STOPPING=1");
    service.close();
    const bool rests = stop_axes(loop, machine);
    if (!rests) spdlog::error("not every axis has confirmed its standstill; run axisd --quiesce");
    status = rests ? exit_status::in_order : exit_status::failed;
  }

  server.shutdown();
  stop_lane.stop();
  ask_core(loop, [&] {
    published_to = nullptr;
    machine.close();
    return true;
  });
  served.close();  // after that, which ends a reload that waits
  if (!wait_until([&] { return ask_core(loop, [&] { return machine.closed(); }); }, close_patience)) {
    spdlog::critical("sequences did not end; leaving at once");
    logging.leave_at_once(exit_status::failed);
  }
  record_run(*audit, **state, DaemonRun::What::ended);
  return status;
}

}  // namespace

std::vector<std::pair<std::string_view, Error>> check_tls(const config::TlsSettings& tls) {
  return tls::check({.certificate = tls.certificate, .key = tls.key, .client_ca = tls.client_ca});
}

config::LoadResult load_configuration(const Options& options) {
  auto loaded = config::load_file(options.config, {}, check_tls);
  if (!loaded.configuration) return loaded;
  if (!options.state_directory.empty()) loaded.configuration->state_directory = options.state_directory;
  auto& server = loaded.configuration->server;
  if (!options.listen.empty()) server.listen = options.listen;
  if (server.plaintext == config::Plaintext::unix_sockets && !server.tls &&
      !server.listen.starts_with("unix:")) {
    loaded.diagnostics.push_back({.file = options.config,
                                  .message = "without tls, --listen " + server.listen + " is for plaintext",
                                  .suggestion = "server.plaintext permits unix:/PATH only"});
    loaded.configuration.reset();
  }
  return loaded;
}

int run_daemon(const Options& options, const config::Configuration& configuration, const std::string& yaml) {
  const auto signals = ending_signals();
  pthread_sigmask(SIG_BLOCK, &signals, nullptr);
  // Both are errors of a write, which are told where it is made.
  std::signal(SIGPIPE, SIG_IGN);
  std::signal(SIGXFSZ, SIG_IGN);
  Logging logging(options.log_level);
  int status = exit_status::failed;
  try {
    status = serve(options, configuration, yaml, logging);
  } catch (const std::exception& error) {  // no memory, no more threads
    spdlog::critical("{}", error.what());
  }
  spdlog::info("ended with status {}", status);
  return status;
}

namespace {

/// As run_quiesce(). Throws where the system has no more of something.
int quiesce(const Options& options) {
  auto loaded = config::load_file(*options.quiesce);
  if (!loaded.configuration) {
    for (const auto& diagnostic : loaded.diagnostics) std::cerr << to_string(diagnostic) << '\n';
    const auto directory =
        options.state_directory.empty() ? config::Configuration{}.state_directory : options.state_directory;
    std::cerr << "axisd: using the last configuration that was served: " << last_good(directory).string()
              << '\n';
    loaded = config::load_file(last_good(directory).string(), *options.quiesce);
  }
  if (!loaded.configuration) {
    std::cerr << "axisd: no usable configuration: nothing was stopped\n";
    return exit_status::configuration;
  }
  spdlog::set_level(spdlog::level::off);
  const auto& configuration = *loaded.configuration;
  core::CoreLoop loop;
  auto ports = Ports::open(loop, configuration, options.link_helper);
  if (!ports) {
    std::cerr << "axisd: " << to_string(ports.error()) << '\n';
    return exit_status::failed;
  }
  std::vector<core::QuiesceReport> reports;
  core::QuiesceParts parts{.executor = loop.executor(),
                           .clock = &loop.clock(),
                           .make_line = [&](const auto& line) { return (*ports)->make_line(line); },
                           .make_port = [&](const auto& network) { return (*ports)->make_port(network); },
                           .link_helper = (*ports)->link_helper()};
  std::exception_ptr failure;
  auto all = [](core::CoreLoop& core, core::QuiesceParts of, const config::Configuration& machine,
                std::vector<core::QuiesceReport>& out, std::exception_ptr& thrown) -> Task<> {
    try {
      out = co_await core::quiesce(std::move(of), machine, quiesce_limit);
    } catch (...) {
      thrown = std::current_exception();
    }
    core.stop();
  };
  spawn(loop.executor(), all(loop, std::move(parts), configuration, reports, failure), "quiesce");
  loop.run();
  if (failure) std::rethrow_exception(failure);
  bool confirmed = true;
  for (const auto& report : reports) {
    std::cout << report.axis << ": " << report.detail << '\n';
    confirmed = confirmed && report.confirmed;
  }
  return confirmed ? exit_status::in_order : exit_status::failed;
}

}  // namespace

int run_quiesce(const Options& options) {
  raise_descriptor_limit();
  try {
    return quiesce(options);
  } catch (const std::exception& error) {  // no memory, no descriptors, no more threads
    std::cerr << "axisd: " << error.what() << ": nothing can be said of the axes\n";
    return exit_status::failed;
  }
}

}  // namespace axisd
