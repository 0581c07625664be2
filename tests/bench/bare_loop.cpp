// The yardstick of can_bench.py: SYNC every MS milliseconds on INTERFACE at absolute times, and reading
// whatever comes; nothing else, and nothing of axisd. Runs until it is ended.
//   bench_bare_loop INTERFACE MS
#include <linux/can.h>
#include <linux/can/raw.h>
#include <net/if.h>
#include <poll.h>
#include <sys/prctl.h>
#include <sys/socket.h>
#include <unistd.h>

#include <cstdio>
#include <cstdlib>
#include <ctime>

namespace {

constexpr long long ns_per_second = 1'000'000'000;

long long now() {
  timespec t{};
  clock_gettime(CLOCK_MONOTONIC, &t);
  return t.tv_sec * ns_per_second + t.tv_nsec;
}

int open_can(const char* interface) {
  const int fd = socket(PF_CAN, SOCK_RAW, CAN_RAW);
  sockaddr_can address{};
  address.can_family = AF_CAN;
  address.can_ifindex = static_cast<int>(if_nametoindex(interface));
  const bool bound = fd >= 0 && address.can_ifindex != 0 &&
                     bind(fd, reinterpret_cast<const sockaddr*>(&address), sizeof address) == 0;
  return bound ? fd : -1;
}

/// As cheap as it gets: one wait for all that came together, one call per frame.
void read_until(int fd, long long due) {
  for (;;) {
    const auto left = due - now();
    if (left <= 0) return;
    pollfd entry{.fd = fd, .events = POLLIN, .revents = 0};
    const timespec wait{.tv_sec = left / ns_per_second, .tv_nsec = left % ns_per_second};
    if (ppoll(&entry, 1, &wait, nullptr) != 1) continue;
    can_frame frame{};
    while (recv(fd, &frame, sizeof frame, MSG_DONTWAIT) > 0) {
    }
  }
}

}  // namespace

int main(int argc, char** argv) {
  const long long period = argc == 3 ? std::atoll(argv[2]) * 1'000'000 : 0;
  const int fd = period > 0 ? open_can(argv[1]) : -1;
  if (fd < 0) {
    std::fputs("usage: bench_bare_loop INTERFACE MS, with an interface that is up\n", stderr);
    return 2;
  }
  prctl(PR_SET_TIMERSLACK, 1UL, 0UL, 0UL, 0UL);
  can_frame sync{};
  sync.can_id = 0x80;
  for (auto due = now() + period;; due += period) {
    read_until(fd, due);
    // A cycle that is late by its period is left out, as axisd does it.
    if (now() - due >= period) continue;
    if (write(fd, &sync, sizeof sync) != sizeof sync) return 1;
  }
}
