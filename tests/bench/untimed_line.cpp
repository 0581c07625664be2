// Drives on a pseudo terminal whose bytes take no time on the wire, and which answer at once: what is left is
// what the master itself takes. Log and end as axisd-sim, but times are those of the reading.
//   bench_untimed_line LINK LOG NODES
#include <fcntl.h>
#include <poll.h>
#include <stdlib.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <cstdint>
#include <cstdio>
#include <span>
#include <vector>

#include "buses/clock.hpp"
#include "buses/modbus_rtu/frame.hpp"
#include "devices/simulation/rtu_network.hpp"
#include "devices/simulation/simulator.hpp"

namespace {

using namespace axisd;

int open_terminal(const char* link) {
  const int master = posix_openpt(O_RDWR | O_NOCTTY);
  if (master < 0 || grantpt(master) != 0 || unlockpt(master) != 0) return -1;
  unlink(link);
  return symlink(ptsname(master), link) == 0 ? master : -1;
}

void add_drives(simulation::RtuNetwork& network, int nodes) {
  const auto* model = simulation::find_simulator("ykd2405pr");
  for (int node = 1; node <= nodes; ++node)
    network.add(model->make({.address = static_cast<std::uint8_t>(node)}));
}

/// 0: it is not complete.
std::size_t request_size(std::span<const std::uint8_t> bytes) {
  constexpr std::size_t shortest = 8;
  const auto size = bytes.size() > 6 && bytes[1] == 0x10 ? 9U + bytes[6] : shortest;
  return bytes.size() >= size ? size : 0;
}

void serve(int master, simulation::RtuNetwork& network) {
  std::vector<std::uint8_t> pending;
  for (std::array<std::uint8_t, 256> buffer{};;) {
    const auto got = read(master, buffer.data(), buffer.size());
    if (got <= 0) {  // nobody has the terminal open
      pending.clear();
      if (errno != EIO && errno != EINTR) return;
      poll(nullptr, 0, 1);
      continue;
    }
    pending.insert(pending.end(), buffer.begin(), buffer.begin() + got);
    while (const auto size = request_size(pending)) {
      const auto reply = network.on_request(std::span(pending).first(size), monotonic_now());
      pending.erase(pending.begin(), pending.begin() + static_cast<std::ptrdiff_t>(size));
      if (!reply) continue;
      if (write(master, reply->bytes.data(), reply->bytes.size()) < 0) return;
    }
  }
}

}  // namespace

int main(int argc, char** argv) {
  const int nodes = argc == 4 ? std::atoi(argv[3]) : 0;
  const int master = nodes > 0 ? open_terminal(argv[1]) : -1;
  std::FILE* log = master < 0 ? nullptr : std::fopen(argv[2], "w");
  if (log == nullptr) {
    std::fputs("usage: bench_untimed_line LINK LOG NODES, with paths that can be written\n", stderr);
    return 2;
  }
  simulation::RtuNetwork network;
  add_drives(network, nodes);
  network.set_observer([log](TimePoint, bool received, std::span<const std::uint8_t> frame) {
    std::fprintf(log, "%lld %s ", static_cast<long long>(monotonic_now().time_since_epoch().count()),
                 received ? "rx" : "tx");
    for (const auto byte : frame) std::fprintf(log, "%02X", byte);
    std::fputc('\n', log);
    std::fflush(log);
  });
  std::puts("ready");
  std::fflush(stdout);
  serve(master, network);
  return 1;
}
