// machines: which ones a cell has, and how they are.
#include <unistd.h>

#include <CLI/CLI.hpp>
#include <memory>
#include <optional>

#include "api/axisctl/across.hpp"
#include "api/axisctl/cell_view.hpp"
#include "api/axisctl/follow.hpp"
#include "api/axisctl/format.hpp"
#include "api/axisctl/invocation.hpp"
#include "api/axisctl/live_view.hpp"
#include "api/axisctl/terminal.hpp"
#include "axisd/cell/v1/cell_service.grpc.pb.h"

namespace axisd::axisctl {
namespace {

using Stub = cell::v1::CellService::Stub;

constexpr const char* examples = R"(
present: registered, and its axisd answers. silent: registered, no answer. unregistered: it answers. gone: neither.
Examples:
  axisctl --cell press-1 machines --watch
  axisctl --cell press-1 list                        all axes of all machines
  axisctl --cell press-1 watch press-2/* press-3/lifter
  axisctl --cell press-1 move press-2/feeder 120mm --wait
  axisctl --cell press-1 --machine press-2 buses     what names no axis
  axisctl --cell press-1 stop --all                  every machine; status 0 only if all confirmed)";

struct Arguments {
  bool watch = false, names = false;
  std::uint64_t count = 0;  ///< 0: without end
};

cell::v1::GetCellResponse cell_of(Invocation& invocation) {
  return invocation.client().call(&Stub::GetCell, cell::v1::GetCellRequest(), std::string_view());
}

void show(Invocation& invocation, bool names) {
  if (invocation.json && !names)
    return print_line(json(
        invocation.client().call(&Stub::ListMachines, cell::v1::ListMachinesRequest(), std::string_view())));
  const auto machines = machines_of_cell(invocation);
  if (names) {
    for (const auto& [name, machine] : machines) print_line(name);
    return;
  }
  for (const auto& line : cell_warnings(cell_of(invocation), use_colour())) print_line(line);
  if (machines.empty()) return print_line("the entrance knows no machine yet");
  machine_table(machines).print(use_colour());
}

void watch(Invocation& invocation, std::uint64_t count) {
  std::optional<LiveView> live;
  if (!invocation.json && is_terminal(STDOUT_FILENO)) live.emplace();
  Machines machines;
  std::uint64_t seen = 0;
  follow<cell::v1::WatchMachinesResponse>(
      invocation.client(), &Stub::WatchMachines, cell::v1::WatchMachinesRequest(), "",
      [&](const cell::v1::WatchMachinesResponse& change) {
        update(machines, change);
        if (live) {
          live->show(machine_table(machines).lines(use_colour(), terminal_columns()));
        } else if (invocation.json) {
          print_line(json(change));
        } else {
          for (const auto& machine : change.machines()) print_line(machine_line(machine));
          for (const auto& name : change.forgotten()) print_line(name + "  known no more");
        }
        return ++seen != count;
      });
}

}  // namespace

void add_machine_commands(CLI::App& app, Invocation& invocation) {
  const auto arguments = std::make_shared<Arguments>();
  auto* command = app.add_subcommand("machines", "The machines of a cell, and how they are");
  auto* watched = command->add_flag("--watch", arguments->watch,
                                    "Until Ctrl-C: a live table on a terminal, else a line per change");
  command->add_option("--count", arguments->count, "End after so many changes")
      ->type_name("N")
      ->needs(watched);
  command->add_flag("--names", arguments->names, "Names only, for completion")->group("");
  command->footer(examples);
  command->callback([&invocation, arguments] {
    if (!invocation.connection.through_entrance())
      throw Failure(ExitCode::usage, "machines are those of a cell; --cell says where its entrance is");
    arguments->watch ? watch(invocation, arguments->count) : show(invocation, arguments->names);
  });
}

}  // namespace axisd::axisctl
