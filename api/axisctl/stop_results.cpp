#include "api/axisctl/stop_results.hpp"

#include <fmt/format.h>

#include "api/axisctl/format.hpp"
#include "api/axisctl/progress.hpp"
#include "api/axisctl/terminal.hpp"

namespace axisd::axisctl {

void print_results(Invocation& invocation, const v1::StopAllResponse& response, Results which) {
  for (const auto& result : response.results()) {
    const bool failed = result.has_error() || outcome(result.command()) != ExitCode::ok;
    if (failed) invocation.status = ExitCode::ended_otherwise;
    if (invocation.json || (which == Results::failed && !failed)) continue;
    print_line(result.has_error()
                   ? coloured(fmt::format("{}: {}", result.axis(), describe(result.error(), result.axis())),
                              Colour::red, use_colour())
                   : command_line(result.command(), ""));
  }
}

void complain_of_latch(Invocation& invocation, const v1::StopAllResponse& response) {
  if (!response.has_not_durable()) return;
  complain({ExitCode::ended_otherwise, describe(response.not_durable()), response.not_durable()},
           invocation.json);
  invocation.status = ExitCode::ended_otherwise;
}

}  // namespace axisd::axisctl
