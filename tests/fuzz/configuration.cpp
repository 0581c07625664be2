// The configuration file; clients may send one as well (CheckConfig).
#include "config/configuration.hpp"

#include "tests/fuzz/target.hpp"

namespace axisd::fuzz {

void run(Input input) {
  const auto loaded = config::load_text(text(input.rest()), "fuzz.yaml");
  expect(loaded.configuration.has_value() == loaded.diagnostics.empty(),
         "a file is served, or it is told why not");
  for (const auto& diagnostic : loaded.diagnostics) {
    expect(!diagnostic.message.empty(), "a diagnostic says something");
    expect(config::to_string(diagnostic).find('\n') == std::string::npos, "a diagnostic is one line");
  }
}

}  // namespace axisd::fuzz
