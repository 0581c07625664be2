// The composition root: the whole program from top to bottom, torn down in reverse.
#include "daemon/daemon.hpp"

#include <fmt/format.h>
#include <malloc.h>
#include <spdlog/spdlog.h>
#include <systemd/sd-daemon.h>

#include <algorithm>
#include <csignal>
#include <exception>
#include <filesystem>
#include <functional>
#include <future>
#include <iterator>
#include <memory>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#include "api/server/access.hpp"
#include "api/server/door_check.hpp"
#include "api/server/lane/stop_lane.hpp"
#include "api/server/server.hpp"
#include "api/tls/live.hpp"
#include "api/tls/pem_files.hpp"
#include "buses/log_about.hpp"
#include "daemon/audit_opening.hpp"
#include "daemon/audit_reader.hpp"
#include "daemon/certificate_keeper.hpp"
#include "daemon/configuration_service.hpp"
#include "daemon/core/core_loop.hpp"
#include "daemon/core/machine_core.hpp"
#include "daemon/core/machine_service.hpp"
#include "daemon/descriptors.hpp"
#include "daemon/ground.hpp"
#include "daemon/metering.hpp"
#include "daemon/state_copier.hpp"
#include "daemon/supervise.hpp"
#include "devices/simulation/control_socket.hpp"

namespace axisd {

namespace {

/// Longest that the end of the daemon waits for moving axes.
constexpr auto stop_patience = std::chrono::seconds(10);
constexpr auto close_patience = std::chrono::seconds(3);

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

/// Stops what moves; true: everything rests.
bool stop_axes(core::CoreLoop& loop, core::MachineCore& machine) {
  const auto stopped = ask_core(loop, [&] { return machine.stop_moving_axes(); });
  if (!stopped.empty()) spdlog::info("stopping what moves: {}", fmt::join(stopped, ", "));
  return wait_until([&] { return ask_core(loop, [&] { return machine.at_rest(); }); }, stop_patience);
}

tls::Files files_of(const config::TlsSettings& settings) {
  return {.certificate = settings.certificate,
          .key = settings.key,
          .client_ca = settings.client_ca,
          .crl = settings.crl};
}

config::TlsCheck tls_check(tls::Demand demand) {
  return [demand](const config::TlsSettings& settings) {
    return tls::check(files_of(settings), std::chrono::system_clock::now(), demand);
  };
}

/// nullptr: there is no TLS. Errors: as of tls::Live::open().
Result<std::shared_ptr<tls::Live>> open_tls(const config::ServerSettings& settings) {
  if (!settings.tls) return nullptr;
  return tls::Live::open(files_of(*settings.tls));
}

std::optional<AccessSettings> access_of(const config::Configuration& configuration) {
  if (!configuration.access) return std::nullopt;
  return server::expanded(*configuration.access, configuration.groups);
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
  ~CoreThread() {
    loop_->stop();
    thread_.join();
  }

 private:
  core::CoreLoop* loop_;
  std::thread thread_;
};

/// `published`: told whenever any snapshot was. `ground` outlives the machine.
core::MachineParts machine_parts(Ground& ground, std::function<void()> published) {
  return {.executor = ground.loop.executor(),
          .clock = &ground.loop.clock(),
          .persistence = &ground.state->state(),
          .journal = &ground.state->journal(),
          .audit = ground.audit.get(),
          .instance_id = ground.instance_id,
          .make_line = [&ports = *ground.ports](const auto& line) { return ports.make_line(line); },
          .make_port = [&ports = *ground.ports](const auto& network) { return ports.make_port(network); },
          .link_helper = ground.ports->link_helper(),
          .observer = std::move(ground.wire_log),
          .flight_records = ground.flight_files.get(),
          .budgets = ground.budgets,
          .reconfigure_simulation = [&ports = *ground.ports](
                                        const auto& next,
                                        const auto& changes) { ports.reconfigure(next, changes); },
          .published = std::move(published)};
}

ConfigurationService::Parts served_parts(const Options& options, const config::Configuration& configuration,
                                         const std::string& yaml, core::MachineService& service,
                                         const std::shared_ptr<server::AccessControl>& access,
                                         CertificateKeeper& certificates) {
  return {.path = options.config,
          .yaml = yaml,
          .configuration = configuration,
          .since = std::chrono::system_clock::now(),
          .load = [&options] { return load_configuration(options, tls::Demand::usable); },
          .check_tls = tls_check(tls::Demand::good),
          .last_good = last_good(configuration.state_directory),
          .apply =
              [&service](core::Reload reload, bool dry_run, core::ReloadDone done) {
                service.reload(std::move(reload), dry_run, std::move(done));
              },
          .adopted =
              [access, &certificates](const auto& next) {
                access->replace(access_of(next));
                certificates.reload();
              }};
}

/// The machine, and all that is asked of it by others, torn down in reverse. Thread: first.
class Doors {
 public:
  /// All of them outlive this.
  Doors(Ground& ground, const Options& options, const config::Configuration& configuration,
        const std::string& yaml, std::shared_ptr<tls::Live> tls)
      : ground_(ground),
        configuration_(configuration),
        tls_(std::move(tls)),
        audit_reader_(audit_directory(configuration), *ground.audit),
        state_copier_(configuration.state_directory),
        machine_(machine_parts(ground, [this] { published(); }), configuration),
        service_(ground.loop, machine_, configuration.machine, ground.instance_id),
        access_(std::make_shared<server::AccessControl>(access_of(configuration))),
        certificates_(tls_, [this](CertificateNotice notice) { tell(std::move(notice)); }),
        served_(served_parts(options, configuration, yaml, service_, access_, certificates_)),
        server_(service_, server_options()),
        stop_lane_(service_, stop_lane_options()),
        metering_({.loop = ground.loop,
                   .machine = machine_,
                   .service = service_,
                   .journal = ground.state->journal(),
                   .settings = configuration.server,
                   .budgets = ground.budgets,
                   .tls = tls_}) {
    published_to_ = &service_;
  }

  /// Before the core runs.
  void start() {
    machine_.start();
    metering_.start();
  }
  [[nodiscard]] Result<int> open();
  [[nodiscard]] int serve(int port);
  [[nodiscard]] bool close();

 private:
  void published() {
    if (published_to_ != nullptr) published_to_->published();
  }
  /// Thread: any, until close().
  void tell(CertificateNotice notice);
  [[nodiscard]] server::ServerOptions server_options();
  [[nodiscard]] server::StopLaneOptions stop_lane_options();

  Ground& ground_;
  const config::Configuration& configuration_;
  const std::shared_ptr<tls::Live> tls_;  ///< nullptr: there is no TLS
  AuditReader audit_reader_;
  StateCopier state_copier_;
  core::MachineService* published_to_ = nullptr;
  core::MachineCore machine_;
  core::MachineService service_;
  const std::shared_ptr<server::AccessControl> access_;
  CertificateKeeper certificates_;
  ConfigurationService served_;
  server::Server server_;
  server::StopLane stop_lane_;
  Metering metering_;
};

void Doors::tell(CertificateNotice notice) {
  post(ground_.loop.executor(), [this, notice = std::move(notice)] {
    const auto& clock = ground_.loop.clock();
    machine_.events().record(clock.wall(clock.now()), {}, notice);
  });
}

server::ServerOptions Doors::server_options() {
  const auto& settings = configuration_.server;
  const auto& limits = settings.limits;
  return {.listen = {settings.listen},
          .tls = tls_,
          .reflection = settings.reflection,
          .limits = {.calls = limits.calls,
                     .streams = limits.streams,
                     .all = std::max(1024, 8 * (limits.calls + limits.streams))},
          .peers = {.connections = limits.connections},
          .stalled_reader_limit = limits.stalled_reader,
          .access = access_,
          .configuration = &served_,
          .audit = &audit_reader_,
          .audit_sink = ground_.audit.get(),
          .state_copies = &state_copier_};
}

server::StopLaneOptions Doors::stop_lane_options() {
  const auto& settings = configuration_.server;
  return {
      .listen = settings.stop_listen.empty() ? server::stop_lane_of(settings.listen) : settings.stop_listen,
      .tls = tls_,
      .access = access_,
      .audit_sink = ground_.audit.get()};
}

/// All addresses. The port of the main one; 0: it is a unix socket. Errors: those of each listen().
Result<int> Doors::open() {
  if (const auto stops = stop_lane_.listen(); !stops) {
    auto error = stops.error();
    if (configuration_.server.stop_listen.empty())
      error.message += fmt::format(" (for stops, beside {})", configuration_.server.listen);
    return fail(std::move(error));
  }
  const auto port = server_.start();
  if (!port) return fail(port.error());
  if (const auto metrics = metering_.listen(); !metrics) return fail(metrics.error());
  return *port;
}

/// Until a signal asks for the end, and the axes rest. `port`: as of open(), which comes before; while the
/// core runs. Exit status.
int Doors::serve(int port) {
  stop_lane_.serve();
  certificates_.start();
  wait_until([this] { return ask_core(ground_.loop, [this] { return machine_.buses_reported(); }); },
             std::chrono::seconds(1));
  served_.keep_copy();
  auto knocks = server_.knocks();
  std::ranges::copy(stop_lane_.knocks(), std::back_inserter(knocks));
  server::DoorCheck doors([this] { return server_.connect_inside(); },
                          [this] { return stop_lane_.connect_inside(); }, std::move(knocks));
  doors.ask();  // its connections are there before anybody else's
  log_about(spdlog::level::info, LogKind::daemon_serves, {},
            fmt::format("axisd {} serves '{}' on {} ({} {})", AXISD_VERSION, configuration_.machine,
                        port == 0 ? configuration_.server.listen : fmt::format("port {}", port),
                        configuration_.axes.size(), configuration_.axes.size() == 1 ? "axis" : "axes"));
  const auto sim_socket = open_simulation(*ground_.ports, configuration_, ground_.instance_id);
  sd_notify(0, "READY=1");
  const int number = supervise({.loop = ground_.loop,
                                .machine = machine_,
                                .server = server_,
                                .stop_lane = stop_lane_,
                                .doors = doors,
                                .served = served_});
  spdlog::info("ending: {}", number == SIGTERM ? "SIGTERM" : "SIGINT");
  sd_notify(0, "STOPPING=1");
  service_.close();
  const bool rests = stop_axes(ground_.loop, machine_);
  if (!rests)
    log_about(spdlog::level::err, LogKind::stop_unconfirmed, {},
              "not every axis has confirmed its standstill; run axisd --quiesce");
  return rests ? exit_status::in_order : exit_status::failed;
}

/// Whether or not they were opened; while the core runs. False: sequences of the machine did not end.
bool Doors::close() {
  server_.shutdown();
  stop_lane_.stop();
  certificates_.close();
  ask_core(ground_.loop, [this] {
    published_to_ = nullptr;
    machine_.close();
    return true;
  });
  served_.close();  // after that, which ends a reload that waits
  return wait_until([this] { return ask_core(ground_.loop, [this] { return machine_.closed(); }); },
                    close_patience);
}

/// From the first thread to the last: all that were started have ended when it returns. Exit status.
int serve(const Options& options, const config::Configuration& configuration, const std::string& yaml,
          Logging& logging) {
  raise_descriptor_limit();
  if (auto enough = check_descriptor_limit(configuration); !enough) return give_up(enough.error());
  Ground ground;
  if (const auto ready = prepare(ground, options, configuration, yaml, logging); !ready)
    return give_up(ready.error());
  auto tls = open_tls(configuration.server);
  if (!tls) return give_up(tls.error());
  Doors doors(ground, options, configuration, yaml, *std::move(tls));
  malloc_trim(0);  // a full journal was read in many pieces: what they leave between each other goes back
  doors.start();
  const CoreThread core_thread(ground.loop);
  const auto port = doors.open();
  const int status = port ? doors.serve(*port) : give_up(port.error());
  if (!doors.close()) {
    spdlog::critical("sequences did not end; leaving at once");
    logging.leave_at_once(exit_status::failed);
  }
  record_run(*ground.audit, *ground.state, DaemonRun::What::ended);
  return status;
}

}  // namespace

std::filesystem::path last_good(const std::string& state_directory) {
  return std::filesystem::path(state_directory) / "last-good.yaml";
}

config::LoadResult load_configuration(const Options& options, tls::Demand demand) {
  auto loaded = config::load_file(options.config, {}, tls_check(demand));
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
  } else if (server.stop_listen.empty() && options.listen.ends_with(":65535")) {
    loaded.diagnostics.push_back(
        {.file = options.config,
         .message = "--listen " + options.listen + ": there is no port after 65535 for the stop lane",
         .suggestion = "choose another port, or say server.stop_listen"});
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
  log_about(spdlog::level::info, LogKind::daemon_ends, {}, fmt::format("ended with status {}", status));
  return status;
}

}  // namespace axisd
