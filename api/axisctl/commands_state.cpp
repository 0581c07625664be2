// list, state, watch: what the axes do.
#include <fmt/format.h>
#include <unistd.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <memory>

#include "api/axisctl/duration.hpp"
#include "api/axisctl/format.hpp"
#include "api/axisctl/interrupt.hpp"
#include "api/axisctl/invocation.hpp"
#include "api/axisctl/quantity.hpp"
#include "api/axisctl/state_view.hpp"
#include "api/axisctl/terminal.hpp"
#include "axisd/v1/axis_service.grpc.pb.h"

namespace axisd::axisctl {
namespace {

void list(Invocation& invocation, bool names) {
  const auto response =
      invocation.client().call(&v1::AxisService::Stub::ListAxes, v1::ListAxesRequest(), std::string_view());
  if (invocation.json && !names) return print_line(json(response));
  if (names) {
    for (const auto& state : response.axes()) print_line(state.axis());
    return;
  }
  axis_table(response.axes()).print(use_colour());
}

struct WatchArguments {
  std::vector<std::string> axes;
  std::string period = "200ms";
  std::uint64_t count = 0;  ///< 0: without end
};

/// Shows batches as they arrive: a table redrawn in place on a terminal, else a line per tick.
class WatchView {
 public:
  explicit WatchView(bool as_json) : json_(as_json), live_(!as_json && is_terminal(STDOUT_FILENO)) {
    if (live_) print("\x1b[?25l");  // no cursor jumping about
  }
  WatchView(const WatchView&) = delete;
  WatchView& operator=(const WatchView&) = delete;
  ~WatchView() {
    if (live_) print("\x1b[?25h");
  }

  void show(const v1::WatchAxesResponse& batch) {
    if (json_) return print_line(json(batch));
    if (!live_) return print_line(tick_line(batch));
    auto lines = axis_table(batch.axes()).lines(use_colour(), terminal_columns());
    if (batch.dropped() > 0)
      lines.push_back(fmt::format("({} ticks came too fast for this terminal)", batch.dropped()));
    // A table that is higher than the terminal would scroll instead of being redrawn.
    lines.resize(std::min(lines.size(), static_cast<std::size_t>(std::max(1, terminal_rows() - 1))));
    std::string text = drawn_ > 0 ? fmt::format("\x1b[{}A", drawn_) : "";
    for (const auto& line : lines) text += "\r\x1b[K" + line + "\n";
    text += "\x1b[J";
    drawn_ = lines.size();
    print(text);
  }

 private:
  bool json_, live_;
  std::size_t drawn_ = 0;
};

void watch(Invocation& invocation, const WatchArguments& arguments) {
  v1::WatchAxesRequest request;
  for (const auto& axis : arguments.axes) request.add_axes(axis);
  set(*request.mutable_period(), parse_duration(arguments.period, "--period"));
  grpc::ClientContext context;
  const Interrupt interrupt([&context] { context.TryCancel(); });
  v1::AxisService::Stub stub(invocation.client().channel());
  const auto stream = stub.WatchAxes(&context, request);
  std::uint64_t seen = 0;
  {
    WatchView view(invocation.json);
    for (v1::WatchAxesResponse batch; stream->Read(&batch);) {
      view.show(batch);
      if (++seen == arguments.count) break;
    }
  }
  const bool complete = arguments.count > 0 && seen == arguments.count;
  if (complete) context.TryCancel();
  const auto status = stream->Finish();
  // Ctrl-C is how one leaves a watch.
  if (complete || interrupt.requested()) return;
  if (status.ok()) throw Failure(ExitCode::unreachable, "the daemon ended the stream");
  throw invocation.client().failure(status, arguments.axes.size() == 1 ? arguments.axes.front() : "");
}

}  // namespace

void add_state_commands(CLI::App& app, Invocation& invocation) {
  auto* list_command = app.add_subcommand("list", "All axes, one line each");
  const auto names = std::make_shared<bool>(false);
  list_command->add_flag("--names", *names, "Names only, for completion")->group("");
  list_command->callback([&invocation, names] { list(invocation, *names); });

  auto* state_command = app.add_subcommand("state", "Everything known about an axis");
  const auto axis = std::make_shared<std::string>();
  state_command->add_option("AXIS", *axis, "Name of the axis")->required();
  state_command->callback([&invocation, axis] {
    const auto state = invocation.state(*axis);
    print(invocation.json ? json(state) + "\n" : state_details(state, use_colour()));
  });

  auto* watch_command =
      app.add_subcommand("watch", "Axes as they move: a live table on a terminal, else a line per tick");
  const auto arguments = std::make_shared<WatchArguments>();
  watch_command->add_option("AXIS", arguments->axes, "Names of axes; none: all");
  watch_command->add_option("--period", arguments->period, "Time between ticks, 10ms to 60s")
      ->type_name("TIME")
      ->capture_default_str();
  watch_command->add_option("--count", arguments->count, "End after so many ticks")->type_name("N");
  watch_command->callback([&invocation, arguments] { watch(invocation, *arguments); });
}

}  // namespace axisd::axisctl
