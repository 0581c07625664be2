// Threads of gRPC end after main here, too.
#include "api/tls/library.hpp"

namespace axisd::testing {
namespace {

[[maybe_unused]] const bool kept = [] {
  tls::keep_library_for_threads();
  return true;
}();

}  // namespace
}  // namespace axisd::testing
