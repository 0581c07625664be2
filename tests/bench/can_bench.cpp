// Figures of the CAN side: see README.md.
//   bench_can bring-up [NODES]                 in wire time: an in-process network of 1 Mbit/s
//   bench_can bare-loop INTERFACE MS SECONDS   the yardstick: SYNC from a loop that does nothing else
#include <fmt/format.h>
#include <linux/can.h>
#include <linux/can/raw.h>
#include <net/if.h>
#include <poll.h>
#include <spdlog/spdlog.h>
#include <sys/resource.h>
#include <sys/socket.h>
#include <unistd.h>

#include <algorithm>
#include <charconv>
#include <cstdio>
#include <memory>
#include <stdexcept>
#include <string>
#include <string_view>
#include <vector>

#include "buses/can/network.hpp"
#include "buses/clock.hpp"
#include "buses/file_descriptor.hpp"
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

config::Configuration cell(int first_node, int nodes) {
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

/// Wire time from opening the port until every axis is online.
Duration bring_up(int first_node, int nodes, Duration latency) {
  test::VirtualWorld world;
  test::FakePersistence store(world.executor());
  can::Network network(world.clock(), bitrate);
  network.set_fault([latency](const can::Frame& frame) {
    const bool answer = frame.id > 0x580 && frame.id < 0x600;
    return can::Network::Fault{.delay = answer ? latency - own_latency : Duration{}};
  });
  simulation::NetworkNodes simulated(world.clock(), network);
  for (int node = first_node; node < first_node + nodes; ++node) {
    auto made = simulation::make_can_node("yss-c", {.address = static_cast<std::uint8_t>(node)});
    if (!made) throw std::runtime_error(made.error().message);
    simulated.nodes().add(std::move(*made));
  }
  core::MachineCore machine({.executor = world.executor(),
                             .clock = &world.clock(),
                             .persistence = &store,
                             .instance_id = "bench",
                             .make_line = {},
                             .make_port =
                                 [&](const canopen::NetworkSettings& settings) {
                                   return std::make_unique<can::NetworkPort>(
                                       world.clock(),
                                       can::PortSettings{.bus = settings.name, .interface = "sim"}, network);
                                 },
                             .observer = {},
                             .published = {}},
                            cell(first_node, nodes));
  world.run_for(seconds(1));  // the drives have booted
  const auto begun = world.now();
  machine.start();
  const bool up = world.run_until(
      [&] {
        return std::ranges::all_of(
            machine.axes(), [](const auto& axis) { return axis->snapshot()->link == LinkState::online; });
      },
      seconds(120));
  const auto taken = world.now() - begun;
  machine.close();
  world.run_until([&] { return machine.closed(); }, seconds(30));
  if (!up) throw std::runtime_error("not every axis came online");
  return taken;
}

double ms(Duration duration) { return std::chrono::duration<double, std::milli>(duration).count(); }

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

FileDescriptor open_can(const std::string& interface) {
  FileDescriptor socket(::socket(PF_CAN, SOCK_RAW | SOCK_CLOEXEC, CAN_RAW));
  sockaddr_can address{};
  address.can_family = AF_CAN;
  address.can_ifindex = static_cast<int>(if_nametoindex(interface.c_str()));
  if (address.can_ifindex == 0 ||
      ::bind(socket.get(), reinterpret_cast<const sockaddr*>(&address), sizeof address) != 0)
    throw std::runtime_error(interface + ": cannot be opened");
  return socket;
}

Duration cpu_time() {
  rusage usage{};
  getrusage(RUSAGE_SELF, &usage);
  const auto of = [](const timeval& t) { return seconds(t.tv_sec) + std::chrono::microseconds(t.tv_usec); };
  return of(usage.ru_utime) + of(usage.ru_stime);
}

/// Reads what is there until `until`.
std::uint64_t read_until(int socket, TimePoint until) {
  std::uint64_t frames = 0;
  for (;;) {
    const auto left = until - monotonic_now();
    if (left <= Duration{}) return frames;
    pollfd entry{.fd = socket, .events = POLLIN, .revents = 0};
    const timespec wait{.tv_sec = 0, .tv_nsec = std::min<long>(left.count(), 999'999'999)};
    if (ppoll(&entry, 1, &wait, nullptr) != 1) continue;
    can_frame frame{};
    if (::read(socket, &frame, sizeof frame) == sizeof frame) ++frames;
  }
}

void run_bare_loop(const std::string& interface, Duration period, seconds length) {
  use_precise_waits();
  const auto socket = open_can(interface);
  can_frame sync{};
  sync.can_id = 0x80;
  std::uint64_t sent = 0, missed = 0, frames = 0;
  Duration latest{};
  const auto begun = monotonic_now();
  const auto cpu_begun = cpu_time();
  for (auto due = begun + period; due < begun + length; due += period) {
    frames += read_until(socket.get(), due);
    const auto late = monotonic_now() - due;
    latest = std::max<Duration>(latest, late);
    if (late >= period) {
      ++missed;
      continue;
    }
    if (::write(socket.get(), &sync, sizeof sync) == sizeof sync) ++sent;
  }
  const auto all = sent + frames;
  fmt::print(
      "{{\"sent\": {}, \"missed\": {}, \"latest_us\": {}, \"frames\": {}, \"cpu_us_per_frame\": {:.2f}}}\n",
      sent, missed, latest / std::chrono::microseconds(1), all,
      ms(cpu_time() - cpu_begun) * 1000 / static_cast<double>(std::max<std::uint64_t>(all, 1)));
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
  } else if (words.size() == 4 && words[0] == "bare-loop") {
    run_bare_loop(words[1], milliseconds(number(words[2])), seconds(number(words[3])));
  } else {
    fmt::print(stderr, "usage: bench_can bring-up [NODES] | bare-loop INTERFACE MS SECONDS\n");
    return 2;
  }
  return 0;
} catch (const std::exception& error) {
  fmt::print(stderr, "bench_can: {}\n", error.what());
  return 1;
}
