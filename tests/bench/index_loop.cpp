// The yardstick of index_bench.py: drives of an RS-485 line move to and fro, on libmodbus alone and nothing
// of axisd. Each is asked for its state in turn; who is done gets its next move at once. Runs until it is
// ended.
//   bench_index_loop PORT BAUD COUNT apart|one START_RPM UP_MS DOWN_MS RPM HERE THERE
// apart: the block of parameters and the trigger are two requests; one: a single one for both.
// HERE and THERE are counter values in pulses.
#include <modbus.h>
#include <sys/prctl.h>

#include <array>
#include <cerrno>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <ctime>
#include <string_view>
#include <vector>

namespace {

constexpr long long ns_per_second = 1'000'000'000;
// Manual of the YKD2405PR, 6.1.
constexpr int state = 0x0003, states = 10, block = 0x0020, trigger = 0x0027, enable = 0x0029;
constexpr std::uint16_t absolute_move = 5;
constexpr int attempts = 5;

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

struct Drive {
  int node = 0;
  std::int32_t target = 0;
  bool moves = false;
};

class Line {
 public:
  Line(modbus_t* line, long long silence) : line_(line), silence_(silence) {}

  void write(int node, int address, std::uint16_t value) {
    ask(node, [&] { return modbus_write_register(line_, address, value) == 1; });
  }
  template <std::size_t count>
  void write(int node, int address, const std::array<std::uint16_t, count>& values) {
    ask(node, [&] { return modbus_write_registers(line_, address, count, values.data()) == count; });
  }
  std::array<std::uint16_t, states> read(int node) {
    std::array<std::uint16_t, states> values{};
    ask(node, [&] { return modbus_read_registers(line_, state, states, values.data()) == states; });
    return values;
  }

 private:
  /// Again where the computer was too busy: a start that arrives twice goes to the same place.
  void ask(int node, const auto& exchange) {
    modbus_set_slave(line_, node);
    for (int left = attempts; !exchange(); --left) {
      std::fprintf(stderr, "node %d: %s\n", node, modbus_strerror(errno));
      if (left == 1) std::exit(1);
      modbus_flush(line_);
    }
    sleep_until(now() + silence_);
  }

  modbus_t* line_;
  long long silence_;
};

struct Move {
  std::array<std::uint16_t, 4> profile{};
  std::int32_t here = 0, there = 0;
  bool one = false;
};

std::int32_t counter(const std::array<std::uint16_t, states>& values) {
  return static_cast<std::int32_t>(std::uint32_t{values[0x000A - state]} << 16U | values[0x000B - state]);
}

void start(Line& line, Drive& drive, const Move& move) {
  drive.target = drive.target == move.here ? move.there : move.here;
  drive.moves = true;
  const auto& p = move.profile;
  const auto high = static_cast<std::uint16_t>(static_cast<std::uint32_t>(drive.target) >> 16U);
  const auto low = static_cast<std::uint16_t>(static_cast<std::uint32_t>(drive.target) & 0xFFFFU);
  if (move.one)  // 0x0026 between them is for terminals
    return line.write(drive.node, block,
                      std::array{p[0], p[1], p[2], p[3], high, low, std::uint16_t{0}, absolute_move});
  line.write(drive.node, block, std::array{p[0], p[1], p[2], p[3], high, low});
  line.write(drive.node, trigger, absolute_move);
}

[[noreturn]] void run(Line line, int count, const Move& move) {
  std::vector<Drive> drives;
  for (int node = 1; node <= count; ++node) {
    line.write(node, enable, 1);
    drives.push_back({.node = node, .target = counter(line.read(node))});
  }
  for (;;)
    for (auto& drive : drives) {
      if (drive.moves) {
        const auto values = line.read(drive.node);
        drive.moves = values[0x0004 - state] != 0 || counter(values) != drive.target;
      }
      if (!drive.moves) start(line, drive, move);
    }
}

}  // namespace

int main(int argc, char** argv) {
  const int baud = argc == 11 ? std::atoi(argv[2]) : 0;
  const int count = argc == 11 ? std::atoi(argv[3]) : 0;
  auto* line = baud > 0 && count > 0 ? modbus_new_rtu(argv[1], baud, 'N', 8, 1) : nullptr;
  if (line == nullptr || modbus_connect(line) != 0) {
    std::fputs(
        "usage: bench_index_loop PORT BAUD COUNT apart|one START_RPM UP_MS DOWN_MS RPM HERE THERE, with a "
        "port "
        "that can be opened\n",
        stderr);
    return 2;
  }
  prctl(PR_SET_TIMERSLACK, 1UL, 0UL, 0UL, 0UL);
  modbus_set_response_timeout(line, 0, 500'000);
  Move move{
      .here = std::atoi(argv[9]), .there = std::atoi(argv[10]), .one = std::string_view(argv[4]) == "one"};
  for (std::size_t i = 0; i < move.profile.size(); ++i)
    move.profile.at(i) = static_cast<std::uint16_t>(std::atoi(argv[5 + i]));
  run(Line(line, silence(baud)), count, move);
}
