// A machine with YSS-C drives on a CAN network in virtual time; for the benchmarks.
#pragma once

#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <cstdint>
#include <memory>
#include <optional>
#include <stdexcept>
#include <string>
#include <utility>

#include "buses/can/network.hpp"
#include "buses/canopen/sync.hpp"
#include "buses/clock.hpp"
#include "config/configuration.hpp"
#include "daemon/core/machine_core.hpp"
#include "devices/simulation/can_nodes.hpp"
#include "devices/simulation/simulator.hpp"
#include "tests/support/fake_persistence.hpp"
#include "tests/support/virtual_world.hpp"

namespace axisd::bench {

using std::chrono::milliseconds;
using std::chrono::seconds;

inline double us(Duration duration) { return std::chrono::duration<double, std::micro>(duration).count(); }
inline double ms(Duration duration) { return us(duration) / 1000; }

inline constexpr std::uint32_t bitrate = 1'000'000;
inline constexpr auto sync_period = milliseconds(10);

/// A simulated node takes 0.5 ms from a request to its answer; the rest of `latency` is added on the way.
inline constexpr auto own_latency = std::chrono::microseconds(500);

/// How the state of a drive comes. by_sdo: it takes no TPDO.
enum class States : std::uint8_t { by_pdo, by_sdo };

struct CellOptions {
  int first_node = 1, nodes = 1;
  Duration latency = own_latency;             ///< of an SDO answer
  Duration sync_period = bench::sync_period;  ///< 0: none, state PDOs come by events
  States states = States::by_pdo;
};

inline config::Configuration configuration(const CellOptions& options) {
  auto yaml = fmt::format(
      "machine: bench\nbuses:\n  can0:\n    canopen: {{ interface: sim, bitrate: 1000000{} }}\naxes:\n",
      options.sync_period == Duration{}
          ? ""
          : fmt::format(", sync_period: {}ms",
                        std::chrono::duration_cast<milliseconds>(options.sync_period).count()));
  for (int node = options.first_node; node < options.first_node + options.nodes; ++node)
    yaml += fmt::format(
        "  axis-{0}: {{ bus: can0, node: {0}, model: yss-c, unit: mm,\n"
        "    scale: {{ microstep: 1000 pulses/rev, travel: 10 mm/rev }},\n"
        "    limits: {{ position: [0, 400], velocity: 100 mm/s, acceleration_time: 150ms }},\n"
        "    inputs: {{ X0: home, X1: positive_limit, X2: negative_limit }} }}\n",
        node);
  auto loaded = config::load_text(yaml, "bench.yaml");
  if (loaded.configuration) return std::move(*loaded.configuration);
  std::string findings;
  for (const auto& finding : loaded.diagnostics) findings += to_string(finding) + "\n";
  throw std::runtime_error(findings);
}

/// A machine with YSS-C drives on a network in this process.
struct Cell {
  explicit Cell(const CellOptions& options) {
    network.set_fault([latency = options.latency](const can::Frame& frame) {
      const bool answer = frame.id > 0x580 && frame.id < 0x600;
      return can::Network::Fault{.delay = answer ? latency - own_latency : Duration{}};
    });
    for (int node = options.first_node; node < options.first_node + options.nodes; ++node) {
      auto made = simulation::make_can_node("yss-c", {.address = static_cast<std::uint8_t>(node)});
      if (!made) throw std::runtime_error(made.error().message);
      simulated.nodes().add(std::move(*made));
    }
    if (options.states == States::by_sdo)
      simulated.nodes().add_fault(
          {.kind = simulation::FaultKind::abort, .count = -1, .object = 0x1A00, .code = 0x06010002});
    machine.emplace(core::MachineParts{.executor = world.executor(),
                                       .clock = &world.clock(),
                                       .persistence = &store,
                                       .instance_id = "bench",
                                       .make_line = {},
                                       .make_port =
                                           [this](const canopen::NetworkSettings& settings) {
                                             return std::make_unique<can::NetworkPort>(
                                                 world.clock(),
                                                 can::PortSettings{.bus = settings.name, .interface = "sim"},
                                                 network);
                                           },
                                       .observer = {},
                                       .published = {}},
                    configuration(options));
    world.run_for(seconds(1));  // the drives have booted
  }

  /// Wire time from opening the port until every axis is online.
  Duration bring_up() {
    const auto begun = world.now();
    machine->start();
    const bool up = world.run_until(
        [&] {
          return std::ranges::all_of(
              machine->axes(), [](const auto& axis) { return axis->snapshot()->link == LinkState::online; });
        },
        seconds(120));
    if (!up) throw std::runtime_error("not every axis came online");
    return world.now() - begun;
  }

  void close() {
    machine->close();
    if (!world.run_until([&] { return machine->closed(); }, seconds(30)))
      throw std::runtime_error("the machine does not end");
    machine.reset();
  }

  test::VirtualWorld world;
  test::FakePersistence store{world.executor()};
  can::Network network{world.clock(), bitrate};
  simulation::NetworkNodes simulated{world.clock(), network};
  std::optional<core::MachineCore> machine;
};

/// The yardstick: sends SYNC, and takes what comes.
class BareMaster {
 public:
  BareMaster(Clock& clock, can::Network& network, Duration period)
      : clock_(&clock), period_(period), port_(clock, {.bus = "can0", .interface = "sim"}, network) {
    port_.start({.on_frame = [](const can::ReceivedFrame&) {}, .on_state = {}});
    send();
  }
  ~BareMaster() { port_.close(); }
  BareMaster(const BareMaster&) = delete;

 private:
  void send() {
    port_.send(canopen::sync_frame(canopen::sync_id, 0), {}, [](const can::SendResult&) {});
    next_ = clock_->call_at(clock_->now() + period_, [this] { send(); });
  }

  Clock* clock_;
  Duration period_;
  can::NetworkPort port_;
  Clock::Timer next_;
};

}  // namespace axisd::bench
