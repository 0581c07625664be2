#include "tests/fuzz/target.hpp"

#include <spdlog/spdlog.h>

#include <cstdio>
#include <cstdlib>

namespace axisd::fuzz {

void expect(bool is_so, std::string_view what) {
  if (is_so) return;
  (void)std::fprintf(stderr, "not so: %.*s\n", static_cast<int>(what.size()), what.data());
  std::abort();
}

}  // namespace axisd::fuzz

// The name is libFuzzer's.
extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* bytes, std::size_t size) {  // NOLINT
  static const bool quiet = [] {
    spdlog::set_level(spdlog::level::off);
    return true;
  }();
  (void)quiet;
  axisd::fuzz::run(axisd::fuzz::Input({bytes, size}));
  return 0;
}
