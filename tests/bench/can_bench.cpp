// Figures of the CAN side: see README.md.
//   bench_can bring-up [NODES]   in wire time: an in-process network of 1 Mbit/s
//   bench_can core [NODES]       CPU time of axisd's own work per frame, on that network
#include <fmt/format.h>
#include <spdlog/spdlog.h>

#include <algorithm>
#include <array>
#include <charconv>
#include <cstdio>
#include <ctime>
#include <memory>
#include <optional>
#include <stdexcept>
#include <string>
#include <string_view>
#include <vector>

#include "buses/can/network.hpp"
#include "buses/canopen/sync.hpp"
#include "buses/clock.hpp"
#include "config/configuration.hpp"
#include "daemon/core/machine_core.hpp"
#include "devices/simulation/can_nodes.hpp"
#include "devices/simulation/simulator.hpp"
#include "tests/support/fake_persistence.hpp"
#include "tests/support/virtual_world.hpp"

namespace {

using namespace axisd;
using std::chrono::milliseconds;
using std::chrono::seconds;

constexpr std::uint32_t bitrate = 1'000'000;
constexpr auto sync_period = milliseconds(10);
constexpr auto measured = seconds(20);

config::Configuration configuration(int first_node, int nodes) {
  std::string yaml =
      "machine: bench\nbuses:\n  can0:\n    canopen: { interface: sim, bitrate: 1000000, sync_period: 10ms "
      "}\n"
      "axes:\n";
  for (int node = first_node; node < first_node + nodes; ++node)
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

/// A simulated node takes 0.5 ms from a request to its answer; the rest of `latency` is added on the way.
constexpr auto own_latency = std::chrono::microseconds(500);

/// A machine with YSS-C drives on a network in this process.
struct Cell {
  Cell(int first_node, int nodes, Duration latency) {
    network.set_fault([latency](const can::Frame& frame) {
      const bool answer = frame.id > 0x580 && frame.id < 0x600;
      return can::Network::Fault{.delay = answer ? latency - own_latency : Duration{}};
    });
    for (int node = first_node; node < first_node + nodes; ++node) {
      auto made = simulation::make_can_node("yss-c", {.address = static_cast<std::uint8_t>(node)});
      if (!made) throw std::runtime_error(made.error().message);
      simulated.nodes().add(std::move(*made));
    }
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
                    configuration(first_node, nodes));
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

Duration bring_up(int first_node, int nodes, Duration latency) {
  Cell cell(first_node, nodes, latency);
  const auto taken = cell.bring_up();
  cell.close();
  return taken;
}

double us(Duration duration) { return std::chrono::duration<double, std::micro>(duration).count(); }
double ms(Duration duration) { return us(duration) / 1000; }

void run_bring_up(int nodes) {
  for (const auto latency :
       {std::chrono::microseconds(500), std::chrono::microseconds(1000), std::chrono::microseconds(2000)}) {
    const auto together = bring_up(1, nodes, latency);
    Duration one_by_one{};
    for (int node = 1; node <= nodes; ++node) one_by_one += bring_up(node, 1, latency);
    fmt::print(
        "bring-up of {} nodes that answer after {}: together {:.0f} ms, one at a time {:.0f} ms, ratio "
        "{:.1f}\n",
        nodes, fmt::format("{} us", latency.count()), ms(together), ms(one_by_one),
        ms(one_by_one) / ms(together));
  }
}

Duration cpu_time() {
  timespec t{};
  clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &t);
  return seconds(t.tv_sec) + std::chrono::nanoseconds(t.tv_nsec);
}

/// Mean CPU time per frame on the wire while `world` runs.
double cpu_per_frame(test::VirtualWorld& world, const can::Network& network, std::uint64_t least_frames) {
  const auto frames_before = network.frames();
  const auto cpu_before = cpu_time();
  world.run_for(measured);
  const auto frames = network.frames() - frames_before;
  if (frames < least_frames) throw std::runtime_error("the nodes do not answer each SYNC");
  return us(cpu_time() - cpu_before) / static_cast<double>(frames);
}

/// The yardstick: sends SYNC, and takes what comes.
class BareMaster {
 public:
  BareMaster(Clock& clock, can::Network& network)
      : clock_(&clock), port_(clock, {.bus = "can0", .interface = "sim"}, network) {
    port_.start({.on_frame = [](const can::ReceivedFrame&) {}, .on_state = {}});
    send();
  }
  ~BareMaster() { port_.close(); }
  BareMaster(const BareMaster&) = delete;

 private:
  void send() {
    port_.send(canopen::sync_frame(canopen::sync_id, 0), {}, [](const can::SendResult&) {});
    next_ = clock_->call_at(clock_->now() + sync_period, [this] { send(); });
  }

  Clock* clock_;
  can::NetworkPort port_;
  Clock::Timer next_;
};

/// What axisd's own work costs per frame, without system calls: nodes, network and axisd in one thread, less
/// the same nodes and network with a bare master.
double own_cpu_per_frame(int nodes) {
  Cell cell(1, nodes, own_latency);
  (void)cell.bring_up();
  constexpr auto tpdos = 2;
  const auto least_frames =
      static_cast<std::uint64_t>(measured / sync_period) * static_cast<std::uint64_t>(tpdos * nodes);
  const auto with_axisd = cpu_per_frame(cell.world, cell.network, least_frames);
  cell.close();
  const BareMaster bare(cell.world.clock(), cell.network);
  cell.world.run_for(milliseconds(100));
  return with_axisd - cpu_per_frame(cell.world, cell.network, least_frames);
}

void run_core(int nodes) {
  std::vector<double> rounds;
  for (int round = 0; round < 5; ++round) rounds.push_back(own_cpu_per_frame(nodes));
  std::ranges::sort(rounds);
  const std::array<std::uint8_t, 8> longest{};
  const double frame_us = us(seconds(1)) / bitrate * can::worst_case_bits(can::make_frame(0x181, longest));
  fmt::print(
      "{} nodes, SYNC every 10 ms: axisd's own work takes {:.2f} / {:.2f} / {:.2f} us of CPU per frame (min "
      "/ "
      "median / max of {} rounds); on the wire one of 8 bytes takes {:.0f} us, ratio {:.0f}\n",
      nodes, rounds.front(), rounds[rounds.size() / 2], rounds.back(), rounds.size(), frame_us,
      frame_us / rounds[rounds.size() / 2]);
}

int number(std::string_view text) {
  int value = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  if (error != std::errc{} || end != text.data() + text.size() || value <= 0)
    throw std::runtime_error(fmt::format("\"{}\" is no number above 0", text));
  return value;
}

}  // namespace

int main(int argc, char** argv) try {
  spdlog::set_level(spdlog::level::warn);
  const std::vector<std::string> words(argv + 1, argv + argc);
  if (!words.empty() && words[0] == "bring-up" && words.size() <= 2) {
    run_bring_up(words.size() == 2 ? number(words[1]) : 32);
  } else if (!words.empty() && words[0] == "core" && words.size() <= 2) {
    run_core(words.size() == 2 ? number(words[1]) : 16);
  } else {
    fmt::print(stderr, "usage: bench_can bring-up [NODES] | core [NODES]\n");
    return 2;
  }
  return 0;
} catch (const std::exception& error) {
  fmt::print(stderr, "bench_can: {}\n", error.what());
  return 1;
}
