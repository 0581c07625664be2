// Drives on a CAN interface of the kernel.
#include <algorithm>
#include <atomic>
#include <boost/asio/io_context.hpp>
#include <boost/asio/signal_set.hpp>
#include <csignal>
#include <future>
#include <utility>

#include "buses/asio_clock.hpp"
#include "buses/can/socketcan_port.hpp"
#include "buses/task.hpp"
#include "daemon/sim/serve.hpp"
#include "devices/simulation/can_nodes.hpp"
#include "devices/simulation/control.hpp"
#include "devices/simulation/control_socket.hpp"
#include "devices/simulation/simulator.hpp"

namespace axisd::sim {
namespace {

using namespace axisd::simulation;
using namespace std::chrono_literals;

/// What the drives send goes out in its order; what cannot be sent is gone, as with a drive whose bus is cut.
void connect(can::Port& port, CanNodes& nodes, const FrameLog& log) {
  if (log)
    nodes.set_observer([&log](TimePoint at, bool received, const can::Frame& frame) {
      log.write(at, received, can::to_string(frame));
    });
  port.start(
      {.on_frame = [&nodes](const can::ReceivedFrame& frame) { nodes.on_frame(frame.frame, frame.at); },
       .on_state =
           [](const can::PortState& state) {
             fmt::print(stderr, "axisd-sim: link {}{}{}\n", can::to_string(state.link),
                        state.error ? ": " : "", state.error ? state.error->message : "");
           }});
}

/// A control command on the drives' thread, asked for by the socket's.
std::string run_control(boost::asio::io_context& io, CanNodes& nodes, std::string_view command) {
  const auto answer = std::make_shared<std::promise<std::string>>();
  auto future = answer->get_future();
  post(io.get_executor(),
       [&nodes, answer, text = std::string(command)] { answer->set_value(execute_control(nodes, text)); });
  while (future.wait_for(50ms) != std::future_status::ready)
    if (io.stopped()) return "error the simulator ends";
  return future.get();
}

}  // namespace

int serve_can(const Options& options) {
  boost::asio::io_context io(1);
  boost::asio::signal_set endings(io, SIGTERM, SIGINT);
  endings.async_wait([&io](const boost::system::error_code&, int) { io.stop(); });
  AsioClock clock(io);
  auto made = make_nodes<SimulatedCanNode>(options, &make_can_node);
  if (!made) return complain(made.error());
  const auto log = FrameLog::open(options.log);
  if (!log) return complain(log.error());

  // Each drive has a controller of its own: none waits until another's frame is confirmed.
  constexpr std::size_t frames_of_a_drive = 4;
  can::SocketCanPort port(io.get_executor(), clock,
                          {.bus = "axisd-sim",
                           .interface = options.can,
                           .bitrate = options.bitrate,
                           .window = frames_of_a_drive * std::max<std::size_t>(made->size(), 1)});
  CanNodes nodes(clock, [&port](const can::Frame& frame) { port.send(frame, {}, {}); });
  if (options.bitrate != 0) nodes.set_bitrate(options.bitrate);
  for (auto& node : *made) nodes.add(std::move(node));
  connect(port, nodes, *log);
  std::unique_ptr<ControlSocket> control;
  if (!options.control.empty()) {
    auto opened = ControlSocket::open(
        options.control, [&](std::string_view command) { return run_control(io, nodes, command); });
    if (!opened) return complain(opened.error());
    control = std::move(*opened);
  }
  post(io.get_executor(), [&] { say_ready(options.can); });
  io.run();
  control.reset();
  port.close();
  return 0;
}

}  // namespace axisd::sim
