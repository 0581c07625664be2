// Fills the command journal of a state directory as a daemon does, through the same code: commands of three
// clients, one after the other, each accepted, sent and done.
//   bench_full_journal DIRECTORY COUNT
#include <fmt/format.h>

#include <boost/asio/executor_work_guard.hpp>
#include <boost/asio/io_context.hpp>
#include <chrono>
#include <cstdio>
#include <cstdlib>
#include <string>

#include "daemon/store/kept_state.hpp"

int main(int argc, char** argv) {
  using namespace axisd;
  if (argc != 3) {
    std::fputs("usage: bench_full_journal DIRECTORY COUNT\n", stderr);
    return 2;
  }
  boost::asio::io_context core;
  const auto working = boost::asio::make_work_guard(core);
  auto kept = store::KeptState::open(argv[1], std::chrono::system_clock::now(), core.get_executor());
  if (!kept) return 1;
  auto* journal = &(*kept)->journal();
  const auto count = std::strtoul(argv[2], nullptr, 10);
  bool failed = false;
  unsigned long pending = 0;
  for (unsigned long i = 1; i <= count && !failed; ++i) {
    Command command{.id = fmt::format("bench-{}", i),
                    .axis = fmt::format("axis-{}", i % 480),
                    .request_id = fmt::format("6f9619ff-8b86-d011-b42d-{:012x}", i),
                    .client = fmt::format("client-{}", i % 3),
                    .kind = CommandKind::move_absolute,
                    .asked = {.position = 0.1 * static_cast<double>(i % 4000)},
                    .accepted_at = std::chrono::system_clock::now()};
    journal->accepted(command, command.axis + " absolute 0x1.999999999999ap-4 - - -");
    ++pending;
    journal->sending(command, {.start_pulses = 0, .target_pulses = 1000}, [&](const Result<void>& result) {
      --pending;
      failed = failed || !result;
    });
    command.state = CommandState::done;
    command.started_at = command.ended_at = command.accepted_at;
    journal->ended(command);
    while (pending >= 500) core.run_one();
  }
  while (pending > 0) core.run_one();
  return failed ? 1 : 0;
}
