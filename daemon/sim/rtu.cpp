// Drives on a pseudo terminal.
#include <csignal>
#include <iterator>
#include <utility>

#include "daemon/sim/serve.hpp"
#include "devices/simulation/control.hpp"
#include "devices/simulation/control_socket.hpp"
#include "devices/simulation/pty_line.hpp"
#include "devices/simulation/simulator.hpp"

namespace axisd::sim {
namespace {

using namespace axisd::simulation;

/// The option is checked to be one of four.
modbus_rtu::Format format_from(std::string_view text) {
  using enum modbus_rtu::Parity;
  return {.parity = text[1] == 'E' ? even : text[1] == 'O' ? odd : none, .stop_bits = text[2] - '0'};
}

FrameObserver observer_of(const FrameLog& log) {
  if (!log) return {};
  return [&log](TimePoint begin, bool received, std::span<const std::uint8_t> frame) {
    fmt::memory_buffer text;
    for (const auto byte : frame) fmt::format_to(std::back_inserter(text), "{:02X}", byte);
    log.write(begin, received, {text.data(), text.size()});
  };
}

}  // namespace

int serve_rtu(const Options& options) {
  // Before any thread: only sigwait() below sees them.
  sigset_t endings;
  sigemptyset(&endings);
  sigaddset(&endings, SIGTERM);
  sigaddset(&endings, SIGINT);
  pthread_sigmask(SIG_BLOCK, &endings, nullptr);

  auto nodes = make_nodes<SimulatedRtuNode>(options, &make_node);
  if (!nodes) return complain(nodes.error());
  const auto log = FrameLog::open(options.log);
  if (!log) return complain(log.error());
  auto line = PtyLine::open({.serial = {.baud = options.baud, .format = format_from(options.format)},
                             .turnaround = std::chrono::microseconds(options.turnaround_us),
                             .link = options.link,
                             .observer = observer_of(*log)},
                            std::move(*nodes));
  if (!line) return complain(line.error());
  std::unique_ptr<ControlSocket> control;
  if (!options.control.empty()) {
    auto opened = ControlSocket::open(options.control, [raw = line->get()](std::string_view command) {
      return execute_control(*raw, command);
    });
    if (!opened) return complain(opened.error());
    control = std::move(*opened);
  }
  say_ready((*line)->path());
  int signal = 0;
  sigwait(&endings, &signal);
  return 0;
}

}  // namespace axisd::sim
