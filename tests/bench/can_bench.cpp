// Figures of the CAN side: see README.md.
//   bench_can bring-up [NODES]   in wire time: an in-process network of 1 Mbit/s
//   bench_can core [NODES]       CPU time of axisd's own work per frame, on that network
//   bench_can index [NODES] [MOVES]   all nodes index there, each as soon as its last move is done
//   bench_can groups [NODES]     start skew of 2 to NODES members there, while the others index
// The last two end with 1 where a command failed, or a drive started more often than it was told to.
#include <fmt/format.h>
#include <spdlog/spdlog.h>

#include <algorithm>
#include <array>
#include <charconv>
#include <ctime>
#include <stdexcept>
#include <string>
#include <string_view>
#include <vector>

#include "tests/bench/can_cell.hpp"
#include "tests/bench/can_index.hpp"

namespace {

using namespace axisd;
using namespace axisd::bench;
using std::chrono::milliseconds;
using std::chrono::seconds;

constexpr auto measured = seconds(20);

Duration bring_up(int first_node, int nodes, Duration latency) {
  Cell cell({.first_node = first_node, .nodes = nodes, .latency = latency});
  const auto taken = cell.bring_up();
  cell.close();
  return taken;
}

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

/// What axisd's own work costs per frame, without system calls: nodes, network and axisd in one thread, less
/// the same nodes and network with a bare master.
double own_cpu_per_frame(int nodes) {
  Cell cell({.nodes = nodes});
  (void)cell.bring_up();
  constexpr auto tpdos = 2;
  const auto least_frames =
      static_cast<std::uint64_t>(measured / sync_period) * static_cast<std::uint64_t>(tpdos * nodes);
  const auto with_axisd = cpu_per_frame(cell.world, cell.network, least_frames);
  cell.close();
  const BareMaster bare(cell.world.clock(), cell.network, sync_period);
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
  } else if (!words.empty() && words[0] == "index" && words.size() <= 3) {
    return run_index(words.size() > 1 ? number(words[1]) : 32, words.size() > 2 ? number(words[2]) : 2000)
               ? 0
               : 1;
  } else if (!words.empty() && words[0] == "groups" && words.size() <= 2) {
    return run_groups(words.size() == 2 ? number(words[1]) : 16) ? 0 : 1;
  } else {
    fmt::print(stderr,
               "usage: bench_can bring-up [NODES] | core [NODES] | index [NODES] [MOVES] | groups [NODES]\n");
    return 2;
  }
  return 0;
} catch (const std::exception& error) {
  fmt::print(stderr, "bench_can: {}\n", error.what());
  return 1;
}
