// The composition root: the whole entrance from top to bottom, torn down in reverse.
#include <fmt/format.h>
#include <grpc/grpc.h>
#include <spdlog/spdlog.h>
#include <sys/stat.h>
#include <systemd/sd-daemon.h>

#include <boost/asio/io_context.hpp>
#include <boost/asio/signal_set.hpp>
#include <csignal>
#include <cstdlib>
#include <fstream>
#include <iostream>
#include <random>
#include <thread>
#include <utility>

#include "api/cell/cell.hpp"
#include "api/cell/certificates.hpp"
#include "api/cell/entrance.hpp"
#include "api/cell/options.hpp"
#include "api/cell/settings.hpp"
#include "api/cell/watch.hpp"
#include "api/exposition/http_server.hpp"
#include "api/program/program.hpp"
#include "api/tls/digest.hpp"
#include "api/tls/library.hpp"
#include "buses/asio_clock.hpp"
#include "buses/limited_log.hpp"

namespace {

using namespace axisd;
using namespace axisd::cell;

constexpr Duration end_patience = std::chrono::seconds(3), reading_period = std::chrono::seconds(1);

int give_up(const Error& error) { return program::give_up("axisd-cell", error); }

std::string random_id() {
  std::random_device source;
  return fmt::format("{:08x}{:08x}{:08x}{:08x}", source(), source(), source(), source());
}

/// Which computer this is, without telling its machine-id to everybody. Where there is none it is another one
/// after each start.
std::string computer_of(const std::string& path) {
  std::ifstream file(path);
  std::string line;
  if (!std::getline(file, line) || line.empty()) {
    spdlog::warn("{} says nothing: this machine gets its name back only when its registration has expired",
                 path);
    return random_id().substr(0, 16);
  }
  return tls::digest_of("axisd-cell " + line);
}

/// Zero: nobody watches.
Duration watchdog_interval() {
  std::uint64_t interval_us = 0;
  return sd_watchdog_enabled(0, &interval_us) > 0 ? Duration(std::chrono::microseconds(interval_us))
                                                  : Duration::zero();
}

/// Tells the metrics what there is.
class Pulse {
 public:
  Pulse(Clock& clock, const Cell& cell, const Certificates& certificates)
      : clock_(clock), cell_(cell), certificates_(certificates) {
    beat();
  }
  /// Thread: any.
  [[nodiscard]] std::shared_ptr<const Reading> reading() const {
    const std::lock_guard lock(mutex_);
    return reading_;
  }

 private:
  void beat() {
    auto all = cell_.reading();
    all.certificates = certificates_.expiries();
    auto reading = std::make_shared<const Reading>(std::move(all));
    {
      const std::lock_guard lock(mutex_);
      reading_.swap(reading);
    }
    timer_ = clock_.call_at(clock_.now() + reading_period, [this] { beat(); });
  }
  Clock& clock_;
  const Cell& cell_;
  const Certificates& certificates_;
  mutable std::mutex mutex_;
  std::shared_ptr<const Reading> reading_;  ///< under mutex_
  Clock::Timer timer_;
};

Result<std::unique_ptr<metrics::HttpServer>> serve_metrics(const Settings& settings, const Pulse& pulse) {
  if (settings.metrics.empty()) return nullptr;
  return metrics::HttpServer::open(
      settings.metrics, true,
      [&pulse](metrics::Format format) {
        return std::make_shared<const std::string>(render(*pulse.reading(), format));
      },
      {});
}

/// False: something failed, in the middle of whatever it was. What it leaves behind is not to be trusted.
bool run(boost::asio::io_context& io) {
  try {
    io.run();
    return true;
  } catch (const std::exception& error) {
    spdlog::critical("{}; axisd-cell ends", error.what());
    return false;
  }
}

/// The registration is given back, calls end. gRPC waits for the core meanwhile, so the core goes on.
void end(boost::asio::io_context& io, Clock& clock, Cell& cell, Entrance& entrance) {
  sd_notify(0, "STOPPING=1");
  io.restart();
  bool given_back = false, closed = false;
  cell.end([&] { given_back = true; });
  std::thread closing([&] {
    entrance.close();
    boost::asio::post(io, [&] { closed = true; });
  });
  const auto until = clock.now() + end_patience;
  while (!(given_back && closed && open_asks() == 0) && clock.now() < until)
    io.run_one_for(std::chrono::milliseconds(50));
  if (!closed) {
    spdlog::warn("something that is open does not end");
    closing.detach();
    program::leave_at_once(0);
  }
  closing.join();
  if (open_asks() > 0) program::leave_at_once(0);
}

int serve(const Settings& settings, const std::string& machine_id_file, Certificates read) {
  boost::asio::io_context io{1};
  AsioClock clock(io);
  RouteTable routes(settings.machine);
  OpenCalls calls({.all = settings.calls, .each = settings.calls_each});
  Certificates certificates = std::move(read);  // its timer goes before the clock
  Cell cell(io, clock, settings, certificates.trust(),
            {.instance_id = random_id(), .machine_id = computer_of(machine_id_file)}, routes, calls);
  Entrance entrance(cell, routes, calls, settings, certificates.live());
  const auto port = entrance.open();
  if (!port) program::leave_at_once(give_up(port.error()));
  cell.start();
  const Pulse pulse(clock, cell, certificates);
  const Watch watch(
      clock, watchdog_interval(),
      [&] {
        return Watch::Progress{.accept_loop = entrance.last_progress(),
                               .hand_over = entrance.last_hand_over()};
      },
      [](const char* state) { sd_notify(0, state); });
  auto exposed = serve_metrics(settings, pulse);
  if (!exposed) program::leave_at_once(give_up(exposed.error()));
  certificates.keep(clock, cell);
  boost::asio::signal_set signals(io, SIGTERM, SIGINT);
  signals.async_wait([&](const boost::system::error_code& error, int) {
    if (!error) io.stop();
  });
  spdlog::info("the entrance of {} in cell {}; port {}{}", settings.machine, settings.cell, *port,
               *exposed ? fmt::format("; metrics at port {}", (*exposed)->port()) : std::string());
  sd_notify(0, "READY=1");
  const bool good = run(io);
  if (!good) program::leave_at_once(program::failed);
  signals.cancel();
  exposed->reset();
  end(io, clock, cell, entrance);
  // What is still posted belongs to calls that are over; gRPC has nothing more to say.
  io.restart();
  io.poll();
  return 0;
}

}  // namespace

int main(int argc, char** argv) {
  tls::keep_library_for_threads();
  const auto options = parse_options(argc, argv);
  const auto loaded = load_settings(options.config);
  for (const auto& diagnostic : loaded.diagnostics) std::cerr << to_string(diagnostic) << '\n';
  if (!loaded.settings) return program::wrong;
  const auto& settings = *loaded.settings;
  ::signal(SIGPIPE, SIG_IGN);
  // c-ares leaks with each look at "localhost", and knows nothing of what nsswitch.conf says.
  ::setenv("GRPC_DNS_RESOLVER", "native", 0);
  program::start_logging("axisd-cell", options.log_level);
  auto certificates = Certificates::read(settings);
  if (!certificates) return give_up(certificates.error());
  if (options.check) {
    const auto expired = certificates->expired(std::chrono::system_clock::now());
    for (const auto& line : expired) std::cerr << line << '\n';
    if (!expired.empty()) return program::wrong;
    std::cout << options.config << ": ok\n";
    return 0;
  }
  if (::mkdir(settings.state.c_str(), 0700) != 0 && errno != EEXIST) {
    std::cerr << fmt::format("axisd-cell: {}: cannot be made; check 'state'\n", settings.state);
    return program::failed;
  }
  grpc_init();
  const int status = serve(settings, options.machine_id_file, *std::move(certificates));
  // Connections that were being made to machines which do not answer are given up in gRPC's own time.
  grpc_shutdown_blocking();
  spdlog::shutdown();
  return status;
}
