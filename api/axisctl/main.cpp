#include "api/axisctl/invocation.hpp"
#include "api/tls/library.hpp"

int main(int argc, char** argv) {
  axisd::tls::keep_library_for_threads();
  return axisd::axisctl::run(argc, argv);
}
