#include "api/transport/memory_trimmer.hpp"

#include <malloc.h>
#include <pthread.h>
#include <unistd.h>

#include <fstream>

namespace axisd::transport {

std::size_t resident_memory() {
  std::size_t size = 0, pages = 0;
  if (!(std::ifstream("/proc/self/statm") >> size >> pages)) return 0;
  return pages * static_cast<std::size_t>(sysconf(_SC_PAGESIZE));
}

void MemoryTrimmer::start() {
  thread_ = std::thread([this] { run(); });
  pthread_setname_np(thread_.native_handle(), "axisd-trim");
}

void MemoryTrimmer::trim() {
  {
    const std::lock_guard lock(mutex_);
    wanted_ = true;
  }
  changed_.notify_one();
}

void MemoryTrimmer::stop() {
  {
    const std::lock_guard lock(mutex_);
    stopping_ = true;
  }
  changed_.notify_one();
  if (thread_.joinable()) thread_.join();
}

bool MemoryTrimmer::wait() {
  std::unique_lock lock(mutex_);
  changed_.wait(lock, [this] { return wanted_ || stopping_; });
  wanted_ = false;
  return !stopping_;
}

void MemoryTrimmer::run() {
  while (wait()) {
    malloc_trim(0);
    left_ = resident_memory();
  }
}

}  // namespace axisd::transport
