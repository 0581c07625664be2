// Counts what a program allocates: malloc, calloc and realloc of glibc, and so operator new.
#include <cstddef>

#include "tests/bench/shared_counter.hpp"

// NOLINTBEGIN(bugprone-reserved-identifier): of glibc
extern "C" void* __libc_malloc(std::size_t size);
extern "C" void* __libc_calloc(std::size_t count, std::size_t size);
extern "C" void* __libc_realloc(void* memory, std::size_t size);
// NOLINTEND(bugprone-reserved-identifier)

namespace {

/// The loader allocates before there is an environment.
std::atomic<axisd::bench::Counter*> counter = nullptr;
[[gnu::constructor]] void begin() { counter = axisd::bench::open_counter(); }

void count() {
  if (auto* const shared = counter.load(std::memory_order_relaxed)) ++*shared;
}

}  // namespace

extern "C" void* malloc(std::size_t size) {
  count();
  return __libc_malloc(size);
}
extern "C" void* calloc(std::size_t number, std::size_t size) {
  count();
  return __libc_calloc(number, size);
}
extern "C" void* realloc(void* memory, std::size_t size) {
  count();
  return __libc_realloc(memory, size);
}
