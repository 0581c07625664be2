// Counts what a program has the disk confirm.
#include <sys/syscall.h>
#include <unistd.h>

#include "tests/bench/shared_counter.hpp"

namespace {

int counted(long call, int file) {
  static auto* const counter = axisd::bench::open_counter();
  if (counter != nullptr) ++*counter;
  return static_cast<int>(syscall(call, file));
}

}  // namespace

extern "C" int fsync(int file) { return counted(SYS_fsync, file); }
extern "C" int fdatasync(int file) { return counted(SYS_fdatasync, file); }
