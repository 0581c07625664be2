// The yardstick of rtu_bench.py: one node after the other, registers 0x0003..0x000C, as fast as the
// line allows; on libmodbus alone and nothing of axisd. Runs until it is ended.
//   bench_modbus_loop PORT BAUD NODES
#include <modbus.h>
#include <sys/prctl.h>

#include <array>
#include <cerrno>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <ctime>

namespace {

constexpr long long ns_per_second = 1'000'000'000;
constexpr int first_register = 0x0003, registers = 10;

long long now() {
  timespec t{};
  clock_gettime(CLOCK_MONOTONIC, &t);
  return t.tv_sec * ns_per_second + t.tv_nsec;
}

void sleep_until(long long due) {
  const timespec t{.tv_sec = due / ns_per_second, .tv_nsec = due % ns_per_second};
  while (clock_nanosleep(CLOCK_MONOTONIC, TIMER_ABSTIME, &t, nullptr) == EINTR) {
  }
}

/// 3.5 characters of 10 bits, 1.75 ms above 19200 baud (Modbus over serial line 2.5.1.1).
long long silence(int baud) { return baud > 19200 ? 1'750'000 : 35 * ns_per_second / baud; }

}  // namespace

int main(int argc, char** argv) {
  const int baud = argc == 4 ? std::atoi(argv[2]) : 0;
  const int nodes = argc == 4 ? std::atoi(argv[3]) : 0;
  auto* line = baud > 0 && nodes > 0 ? modbus_new_rtu(argv[1], baud, 'N', 8, 1) : nullptr;
  if (line == nullptr || modbus_connect(line) != 0) {
    std::fputs("usage: bench_modbus_loop PORT BAUD NODES, with a port that can be opened\n", stderr);
    return 2;
  }
  prctl(PR_SET_TIMERSLACK, 1UL, 0UL, 0UL, 0UL);
  modbus_set_response_timeout(line, 0, 500'000);
  std::array<std::uint16_t, registers> values{};
  for (int node = 1;; node = node % nodes + 1) {
    modbus_set_slave(line, node);
    if (modbus_read_registers(line, first_register, registers, values.data()) != registers)
      std::fprintf(stderr, "node %d: %s\n", node, modbus_strerror(errno));
    sleep_until(now() + silence(baud));
  }
}
