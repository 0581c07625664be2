#include <iostream>

#include "api/tls/library.hpp"
#include "config/budget.hpp"
#include "config/configuration.hpp"
#include "daemon/daemon.hpp"
#include "daemon/options.hpp"
#include "daemon/state_copier.hpp"

int main(int argc, char** argv) {
  axisd::tls::keep_library_for_threads();
  const auto options = axisd::parse_options(argc, argv);
  if (options.schema) {
    std::cout << axisd::config::json_schema() << '\n';
    return 0;
  }
  if (options.quiesce) return axisd::run_quiesce(options);
  using axisd::tls::Demand;
  auto loaded = axisd::load_configuration(options, options.check ? Demand::good : Demand::usable_some_time);
  for (const auto& diagnostic : loaded.diagnostics) std::cerr << to_string(diagnostic) << '\n';
  if (!loaded.configuration) return axisd::exit_status::configuration;
  const auto& configuration = *loaded.configuration;
  if (options.check) {
    for (const auto& warning : axisd::config::warnings(configuration))
      std::cerr << options.config << ": warning: " << warning << '\n';
    std::cout << options.config << ": ok (" << configuration.axes.size() << " axes on "
              << configuration.lines.size() + configuration.networks.size() << " buses)\n";
    return 0;
  }
  if (options.restore_state)
    return axisd::restore_state(*options.restore_state, configuration.state_directory);
  return axisd::run_daemon(options, configuration, loaded.text);
}
