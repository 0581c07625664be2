// list, state, watch: what the axes do; and what the daemon keeps of them.
#include <fmt/format.h>
#include <google/protobuf/util/time_util.h>
#include <sys/stat.h>
#include <unistd.h>

#include <CLI/CLI.hpp>
#include <memory>
#include <optional>
#include <string>
#include <system_error>

#include "api/axisctl/cell_commands.hpp"
#include "api/axisctl/duration.hpp"
#include "api/axisctl/follow.hpp"
#include "api/axisctl/format.hpp"
#include "api/axisctl/invocation.hpp"
#include "api/axisctl/live_view.hpp"
#include "api/axisctl/quantity.hpp"
#include "api/axisctl/state_view.hpp"
#include "api/axisctl/terminal.hpp"
#include "api/program/whole_file.hpp"
#include "axisd/v1/axis_service.grpc.pb.h"
#include "axisd/v1/system_service.grpc.pb.h"

namespace axisd::axisctl {
namespace {

using google::protobuf::util::TimeUtil;

struct ListArguments {
  std::vector<std::string> machines;
  bool names = false;
};

void list(Invocation& invocation, const ListArguments& arguments) {
  if (invocation.of_whole_cell()) return list_cell(invocation, arguments.machines, arguments.names);
  if (!arguments.machines.empty())
    throw Failure(ExitCode::usage,
                  "list shows all axes; 'axisctl state AXIS' shows one, --cell other machines");
  const auto response =
      invocation.client().call(&v1::AxisService::Stub::ListAxes, v1::ListAxesRequest(), std::string_view());
  if (invocation.json && !arguments.names) return print_line(json(response));
  if (arguments.names) {
    for (const auto& state : response.axes()) print_line(state.axis());
    return;
  }
  axis_table(response.axes()).print(use_colour());
}

std::vector<std::string> lines_of(const v1::WatchAxesResponse& batch,
                                  const std::vector<std::string>& fields) {
  const auto table = fields.empty() ? axis_table(batch.axes()) : field_table(batch.axes(), fields);
  auto lines = table.lines(use_colour(), terminal_columns());
  if (batch.dropped() > 0)
    lines.push_back(fmt::format("({} ticks came too fast for this terminal)", batch.dropped()));
  return lines;
}

std::string line_of(const v1::WatchAxesResponse& batch, const std::vector<std::string>& fields,
                    bool as_json) {
  if (fields.empty()) return as_json ? json(batch) : tick_line(batch);
  return as_json ? field_json(batch, fields) : field_line(batch, fields);
}

std::string line_of(const v1::StateConviction& conviction) {
  const auto since = TimeUtil::SecondsToTimestamp(TimeUtil::TimestampToSeconds(conviction.since()));
  return fmt::format("{}, since {}", conviction.text(), TimeUtil::ToString(since));
}

std::string line_of(const v1::KeptFileState& file) {
  const bool none = file.generation() == 0;
  const auto* unit = file.name().starts_with("journal") ? "line" : "generation";
  const auto found = none ? "none" : fmt::format("{} {}", unit, file.generation());
  const auto expected = file.expected() > 0 ? fmt::format("at least {} expected", file.expected())
                        : none              ? "nor does the other file know of one"
                                            : "the other file does not say which there was";
  return fmt::format("{:<12}{} at the start of the daemon, {}", file.name() + ":", found, expected);
}

void show(const v1::GetStateResponse& response) {
  for (const auto& file : response.files()) print_line(line_of(file));
  print_line(fmt::format("{:<12}{}", "starts:", response.start_count()));
  if (response.convictions().empty()) return print_line("accepted:   yes");
  for (const auto& conviction : response.convictions())
    print_line(coloured(line_of(conviction), Colour::red, use_colour()));
  print_line("motion waits: look at the machine, then 'axisctl state accept'");
}

void kept_state(Invocation& invocation) {
  if (invocation.of_whole_cell()) return show_kept_states(invocation, show);
  const auto response =
      invocation.client().call(&v1::SystemService::Stub::GetState, v1::GetStateRequest(), std::string_view());
  if (invocation.json) return print_line(json(response));
  show(response);
  const auto info =
      invocation.client().call(&v1::SystemService::Stub::GetInfo, v1::GetInfoRequest(), std::string_view());
  if (info.has_storage_error())
    print_line("commands:   " + coloured(describe(info.storage_error()), Colour::yellow, use_colour()));
}

void accept_state(Invocation& invocation) {
  const auto response = invocation.client().call(&v1::SystemService::Stub::AcceptState,
                                                 v1::AcceptStateRequest(), std::string_view());
  if (invocation.json) return print_line(json(response));
  for (const auto& conviction : response.accepted()) print_line("accepted: " + line_of(conviction));
  print_line(response.accepted().empty()
                 ? "there was nothing to accept"
                 : "every axis needs a new command to move; home where positions count");
}

void back_up_state(Invocation& invocation, const std::string& path) {
  const auto response = invocation.client().call(&v1::SystemService::Stub::BackUpState,
                                                 v1::BackUpStateRequest(), std::string_view());
  // For nobody else to read: it names clients.
  if (const int error = program::write_whole_file(path, response.state(), S_IRUSR | S_IWUSR); error != 0)
    throw Failure(ExitCode::usage,
                  fmt::format("{}: cannot be written: {}", path, std::generic_category().message(error)));
  if (invocation.json) return print_line(json(response));
  print_line(fmt::format(
      "{}: generation {}; to restore it: stop axisd, 'axisd --restore-state {}' as its user, start it", path,
      response.generation(), path));
}

struct WatchArguments {
  std::vector<std::string> axes, fields;
  std::string period = "200ms";
  std::uint64_t count = 0;  ///< 0: without end
};

void watch(Invocation& invocation, const WatchArguments& arguments) {
  v1::WatchAxesRequest request;
  for (const auto& axis : arguments.axes) request.add_axes(axis);
  for (const auto& field : arguments.fields) request.mutable_fields()->add_paths(field);
  set(*request.mutable_period(), parse_duration(arguments.period, "--period"));
  if (invocation.of_whole_cell()) {
    request.clear_axes();
    return watch_cell(invocation, arguments.axes, request, arguments.count);
  }
  std::optional<LiveView> live;
  if (!invocation.json && is_terminal(STDOUT_FILENO)) live.emplace();
  std::uint64_t seen = 0;
  follow<v1::WatchAxesResponse>(invocation.client(), &v1::AxisService::Stub::WatchAxes, request,
                                arguments.axes.size() == 1 ? arguments.axes.front() : "",
                                [&](const v1::WatchAxesResponse& batch) {
                                  if (live) {
                                    live->show(lines_of(batch, arguments.fields));
                                  } else {
                                    print_line(line_of(batch, arguments.fields, invocation.json));
                                  }
                                  return ++seen != arguments.count;
                                });
}

}  // namespace

void add_state_commands(CLI::App& app, Invocation& invocation) {
  auto* list_command = app.add_subcommand("list", "All axes, one line each");
  const auto listed = std::make_shared<ListArguments>();
  list_command->add_option("MACHINE", listed->machines,
                           "With --cell: only those of these; none: all machines");
  list_command->add_flag("--names", listed->names, "Names only, for completion")->group("");
  list_command->callback([&invocation, listed] { list(invocation, *listed); });

  auto* state_command = app.add_subcommand(
      "state", "Everything known about an axis; without one: what the daemon keeps over restarts");
  const auto axis = std::make_shared<std::string>();
  state_command->add_option(
      "AXIS", *axis,
      "Name of the axis (of one called 'accept' or 'backup': -- accept); with --cell also "
      "of a machine");
  auto* accept_command = state_command->add_subcommand(
      "accept", "Take what the daemon remembers as it is: look at the machine first. Motion waits no longer");
  accept_command->callback([&invocation, axis] {
    if (!axis->empty()) throw CLI::ValidationError("accept", "of the whole machine: it takes no axis");
    accept_state(invocation);
  });
  auto* backup_command =
      state_command->add_subcommand("backup", "Copy what the daemon remembers to a file, while it runs");
  const auto path = std::make_shared<std::string>();
  backup_command->add_option("FILE", *path, "The copy; one that is there is replaced")->required();
  backup_command->callback([&invocation, axis, path] {
    if (!axis->empty()) throw CLI::ValidationError("backup", "of the whole machine: it takes no axis");
    back_up_state(invocation, *path);
  });
  state_command->callback([&invocation, accept_command, backup_command, axis] {
    if (accept_command->parsed() || backup_command->parsed()) return;
    if (axis->empty()) return kept_state(invocation);
    if (invocation.of_whole_cell()) return show_cell_axes(invocation, {*axis});
    const auto state = invocation.state(*axis);
    print(invocation.json ? json(state) + "\n" : state_details(state, use_colour()));
  });

  auto* watch_command =
      app.add_subcommand("watch", "Axes as they move: a live table on a terminal, else a line per tick");
  const auto arguments = std::make_shared<WatchArguments>();
  watch_command
      ->add_option("AXIS", arguments->axes,
                   "Names of axes, with spaces or commas between, with --cell also of machines; none: all")
      ->delimiter(',');
  watch_command->add_option("--period", arguments->period, "Time between ticks, 10ms to 60s")
      ->type_name("TIME")
      ->capture_default_str();
  watch_command
      ->add_option("--fields", arguments->fields,
                   "Only these fields of AxisState, as in the reference: position,velocity,fault.message")
      ->delimiter(',')
      ->allow_extra_args(false)  // the words behind are axes
      ->type_name("FIELD,...");
  watch_command->add_option("--count", arguments->count, "End after so many ticks, of all machines together")
      ->check(CLI::Validator(CLI::PositiveNumber).description(""))
      ->type_name("N");
  watch_command->callback([&invocation, arguments] { watch(invocation, *arguments); });
}

}  // namespace axisd::axisctl
