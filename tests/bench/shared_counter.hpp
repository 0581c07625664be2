// What libraries that are loaded before those of a program (LD_PRELOAD) count, for index_bench.py: far
// cheaper than a tracer. The number is in the file that AXISD_COUNT names, which exists and has 8 bytes.
#pragma once

#include <fcntl.h>
#include <sys/mman.h>
#include <unistd.h>

#include <atomic>
#include <cstdint>
#include <cstdlib>

namespace axisd::bench {

using Counter = std::atomic<std::uint64_t>;

/// nullptr: there is no such file. Allocates nothing.
inline Counter* open_counter() {
  const char* path = std::getenv("AXISD_COUNT");
  const int file = path == nullptr ? -1 : open(path, O_RDWR | O_CLOEXEC);
  if (file < 0) return nullptr;
  void* shared = mmap(nullptr, sizeof(Counter), PROT_READ | PROT_WRITE, MAP_SHARED, file, 0);
  close(file);
  return shared == MAP_FAILED ? nullptr : static_cast<Counter*>(shared);
}

}  // namespace axisd::bench
