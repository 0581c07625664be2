// The composition root: the whole gateway from top to bottom, torn down in reverse.
#include <fmt/format.h>
#include <spdlog/spdlog.h>
#include <systemd/sd-daemon.h>

#include <boost/asio/io_context.hpp>
#include <boost/asio/signal_set.hpp>
#include <csignal>
#include <cstdlib>
#include <fstream>
#include <iostream>
#include <iterator>
#include <utility>

#include "api/program/program.hpp"
#include "api/tls/library.hpp"
#include "api/transport/channel.hpp"
#include "api/web/gateway/gateway.hpp"
#include "api/web/gateway/listener.hpp"
#include "api/web/gateway/options.hpp"
#include "api/web/gateway/passwords.hpp"
#include "api/web/gateway/settings.hpp"
#include "buses/asio_clock.hpp"

namespace {

using namespace axisd;
using namespace axisd::web;

/// For the halts of pages that are still jogging, and their answers.
constexpr Duration end_patience = std::chrono::seconds(2);

int give_up(const Error& error) { return program::give_up("axisd-web", error); }

std::string content_of(const std::string& path) {
  std::ifstream file(path, std::ios::binary);
  return {std::istreambuf_iterator<char>(file), {}};
}

/// What is read before anybody is served.
struct Ground {
  People people;
  Assets assets;
  std::unique_ptr<boost::asio::ssl::context> tls;
  std::string client_ca;
};

Result<Ground> prepare(const Settings& settings) {
  auto people = People::load(settings.users, settings.users_named);
  if (!people) return fail(std::move(people).error());
  auto assets = Assets::load(settings.files);
  if (!assets) return fail(std::move(assets).error());
  // All machines are called with the same.
  const auto& axisd = settings.axisd;
  if (const auto trusted = transport::client_credentials(
          {.ca = axisd.ca, .certificate = axisd.certificate, .key = axisd.key}, "axisd.tls");
      !trusted)
    return fail(trusted.error());
  Ground ground{.people = *std::move(people), .assets = *std::move(assets), .tls = {}, .client_ca = {}};
  if (!settings.tls) return ground;
  auto tls = make_tls(*settings.tls);
  if (!tls) return fail(std::move(tls).error());
  ground.tls = *std::move(tls);
  if (!settings.tls->client_ca.empty()) ground.client_ca = content_of(settings.tls->client_ca);
  return ground;
}

/// Tells systemd that the loop comes round.
class Heartbeat {
 public:
  explicit Heartbeat(Clock& clock) : clock_(clock) {
    std::uint64_t interval_us = 0;
    if (sd_watchdog_enabled(0, &interval_us) <= 0) return;
    period_ = std::chrono::microseconds(interval_us) / 3;
    beat();
  }

 private:
  void beat() {
    sd_notify(0, "WATCHDOG=1");
    timer_ = clock_.call_at(clock_.now() + period_, [this] { beat(); });
  }
  Clock& clock_;
  Duration period_{};
  Clock::Timer timer_;
};

/// False: something failed, in the middle of whatever it was. What it leaves behind is not to be trusted.
bool run(boost::asio::io_context& io) {
  try {
    io.run();
    return true;
  } catch (const std::exception& error) {
    spdlog::critical("{}; axisd-web ends", error.what());
    return false;
  }
}

/// Nobody is let in any more; what is jogged is halted, and everything that is open ends.
void end(boost::asio::io_context& io, Gateway& gateway, Listener& listener, int status) {
  sd_notify(0, "STOPPING=1");
  listener.close();
  gateway.end_all();
  io.restart();
  const auto until = gateway.clock.now() + end_patience;
  while (!gateway.deserted() && gateway.clock.now() < until) {
    try {
      io.run_one_for(std::chrono::milliseconds(50));
    } catch (const std::exception& error) {  // the others are to end all the same
      spdlog::error("{}", error.what());
    }
  }
  if (gateway.deserted()) return;
  spdlog::warn("something that is open does not end");
  program::leave_at_once(status);
}

int serve(const Settings& settings, Ground ground) {
  boost::asio::io_context io{1};
  AsioClock clock(io);
  Machines machines;
  const auto connect = [&](const std::string& name, const DaemonSettings& daemon) -> Result<void> {
    auto upstream = Upstream::make(io.get_executor(), clock, daemon);
    if (!upstream) return fail(std::move(upstream).error());
    machines.emplace(name, *std::move(upstream));
    return {};
  };
  if (settings.machines.empty()) {
    if (auto done = connect({}, settings.axisd); !done) return give_up(done.error());
  }
  for (const auto& [name, daemon] : settings.machines)
    if (auto done = connect(name, daemon); !done) return give_up(done.error());
  Gateway gateway(io, clock, settings, std::move(ground.assets), std::move(ground.people),
                  std::move(machines), ground.client_ca);
  auto listener = Listener::open(gateway, std::move(ground.tls));
  if (!listener) program::leave_at_once(give_up(listener.error()));
  if (gateway.people.nobody() && !settings.tls)
    spdlog::warn("there are no users: everybody at this computer is let in");
  if (gateway.people.nobody() && settings.tls)
    spdlog::warn("there are no users: axisd-web user add NAME --role ROLE");
  spdlog::info("{}://{} with {} files; port {}", settings.tls ? "https" : "http", settings.listen,
               gateway.assets.count(), (*listener)->port());
  boost::asio::signal_set signals(io, SIGTERM, SIGINT);
  signals.async_wait([&](const boost::system::error_code& error, int) {
    if (!error) io.stop();
  });
  const Heartbeat heartbeat(clock);
  sd_notify(0, "READY=1");
  const int status = run(io) ? 0 : program::failed;
  end(io, gateway, **listener, status);
  return status;
}

}  // namespace

int main(int argc, char** argv) {
  tls::keep_library_for_threads();
  const auto options = parse_options(argc, argv);
  const auto loaded = load_settings(options.config);
  for (const auto& diagnostic : loaded.diagnostics) std::cerr << to_string(diagnostic) << '\n';
  if (!loaded.settings) return program::wrong;
  const auto& settings = *loaded.settings;
  if (options.user) return run_user_command(*options.user, settings.users);
  if (!start_passwords()) {
    std::cerr << "axisd-web: no random numbers\n";
    return program::failed;
  }
  ::signal(SIGPIPE, SIG_IGN);
  program::start_logging("axisd-web", options.log_level);
  auto ground = prepare(settings);
  if (!ground) return give_up(ground.error());
  if (options.check) {
    std::cout << options.config << ": ok\n";
    return 0;
  }
  const int status = serve(settings, *std::move(ground));
  spdlog::shutdown();
  return status;
}
