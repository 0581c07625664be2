// `axisd --quiesce`: stops every drive without the rest of the daemon.
#include <spdlog/spdlog.h>

#include <chrono>
#include <exception>
#include <iostream>
#include <utility>
#include <vector>

#include "daemon/core/core_loop.hpp"
#include "daemon/core/quiesce.hpp"
#include "daemon/daemon.hpp"
#include "daemon/descriptors.hpp"
#include "daemon/ports.hpp"

namespace axisd {

namespace {

constexpr auto quiesce_limit = std::chrono::seconds(4);

/// As run_quiesce(). Throws where the system has no more of something.
int quiesce(const Options& options) {
  auto loaded = config::load_file(*options.quiesce);
  const auto tell = [&loaded] {
    for (const auto& diagnostic : loaded.diagnostics) std::cerr << to_string(diagnostic) << '\n';
  };
  if (!loaded.configuration) {
    tell();
    const auto directory =
        options.state_directory.empty() ? config::Configuration{}.state_directory : options.state_directory;
    std::cerr << "axisd: using the last configuration that was served: " << last_good(directory).string()
              << '\n';
    loaded = config::load_file(last_good(directory).string(), *options.quiesce);
  }
  if (!loaded.configuration) {
    tell();
    std::cerr << "axisd: no usable configuration: nothing was stopped\n";
    return exit_status::configuration;
  }
  spdlog::set_level(spdlog::level::off);
  const auto& configuration = *loaded.configuration;
  core::CoreLoop loop;
  auto ports = Ports::open(loop, configuration, options.link_helper);
  if (!ports) {
    std::cerr << "axisd: " << to_string(ports.error()) << '\n';
    return exit_status::failed;
  }
  std::vector<core::QuiesceReport> reports;
  core::QuiesceParts parts{.executor = loop.executor(),
                           .clock = &loop.clock(),
                           .make_line = [&](const auto& line) { return (*ports)->make_line(line); },
                           .make_port = [&](const auto& network) { return (*ports)->make_port(network); },
                           .link_helper = (*ports)->link_helper()};
  std::exception_ptr failure;
  auto all = [](core::CoreLoop& core, core::QuiesceParts of, const config::Configuration& machine,
                std::vector<core::QuiesceReport>& out, std::exception_ptr& thrown) -> Task<> {
    try {
      out = co_await core::quiesce(std::move(of), machine, quiesce_limit);
    } catch (...) {
      thrown = std::current_exception();
    }
    core.stop();
  };
  spawn(loop.executor(), all(loop, std::move(parts), configuration, reports, failure), "quiesce");
  loop.run();
  if (failure) std::rethrow_exception(failure);
  bool confirmed = true;
  for (const auto& report : reports) {
    std::cout << report.axis << ": " << report.detail << '\n';
    confirmed = confirmed && report.confirmed;
  }
  return confirmed ? exit_status::in_order : exit_status::failed;
}

}  // namespace

int run_quiesce(const Options& options) {
  raise_descriptor_limit();
  try {
    return quiesce(options);
  } catch (const std::exception& error) {  // no memory, no descriptors, no more threads
    std::cerr << "axisd: " << error.what() << ": nothing can be said of the axes\n";
    return exit_status::failed;
  }
}

}  // namespace axisd
