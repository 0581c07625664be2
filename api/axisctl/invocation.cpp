#include "api/axisctl/invocation.hpp"

#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <cstdio>
#include <exception>
#include <string_view>
#include <utility>
#include <vector>

#include "api/axisctl/completion.hpp"
#include "api/axisctl/machine_names.hpp"
#include "api/axisctl/quantity.hpp"
#include "api/axisctl/tls_trouble.hpp"
#include "axisd/v1/axis_service.grpc.pb.h"
#include "config/text.hpp"

namespace axisd::axisctl {
namespace {

constexpr const char* footer = R"(
Values carry a unit or none, which is the axis's: 120mm, -10, 50mm/s. Others are converted: 12cm, 0.5m, 3m/min; 0.25rev,
30rpm of an axis in degrees. Times carry theirs: 150ms, 2s.
A command that was accepted goes on when axisctl ends, also by Ctrl-C or --timeout; only jog ends with it.

Exit status:
  0    ok; with --wait: the motion is Done, with --verify: the drive was found
  1    the motion ended otherwise (Aborted, Error, Unknown)
  2    bad arguments or a bad configuration file
  3    the daemon cannot be reached or did not answer in time
  4    the daemon refused
  130  interrupted while waiting

A cell of several machines (--cell): axes are named press-2/feeder, and so are groups, buses, devices and commands. What
names none of these is asked of one machine by --machine press-2; then names need no machine. Without either, list, state,
watch, events, info, stop --all and release-stop --all are of all machines; list, state, watch and events take machines as
well: press-2, or press-2/*. An entrance that does not answer: any other one of the cell, or --server with a machine's own
address, which goes before AXISD_CELL.

Environment: AXISD_SERVER, AXISD_STOP_SERVER, AXISD_CELL, AXISD_MACHINE, AXISD_TLS_CA, AXISD_TLS_CERT, AXISD_TLS_KEY, AXISD_AS, AXISD_LEASE, NO_COLOR.)";

void add_global_options(CLI::App& app, Invocation& invocation) {
  app.add_option("--server", invocation.connection.server,
                 "The daemon: HOST, HOST:PORT (else 7443) or unix:PATH")
      ->envname("AXISD_SERVER")
      ->type_name("ADDRESS")
      ->capture_default_str();
  app.add_option(
         "--stop-server", invocation.connection.stop_server,
         "Where it takes stops whatever else it does; without it the port after that of --server, or its "
         "path with .stop behind it")
      ->envname("AXISD_STOP_SERVER")
      ->type_name("ADDRESS");
  app.add_option("--cell", invocation.connection.cell,
                 "An entrance of a cell (axisd-cell), in place of --server: HOST or HOST:PORT (else 7445)")
      ->envname("AXISD_CELL")
      ->type_name("ADDRESS");
  app.add_option("--machine", invocation.connection.machine,
                 "With --cell: names without a machine, and what names nothing, are of this one")
      ->envname("AXISD_MACHINE")
      ->type_name("MACHINE");
  app.add_option("--tls-ca", invocation.connection.tls_ca,
                 "Use TLS; the daemon's certificate is checked with this one")
      ->envname("AXISD_TLS_CA")
      ->type_name("FILE");
  app.add_option("--tls-cert", invocation.connection.tls_certificate, "Certificate of this client")
      ->envname("AXISD_TLS_CERT")
      ->type_name("FILE");
  app.add_option("--tls-key", invocation.connection.tls_key, "Its private key")
      ->envname("AXISD_TLS_KEY")
      ->type_name("FILE");
  app.add_option("--as", invocation.connection.speaks_for,
                 "Speak for somebody else, as a delegate may (access: delegates): the calls are theirs")
      ->envname("AXISD_AS")
      ->type_name("USER[:ROLE]");
  app.add_option("--timeout", invocation.timeout, "How long the daemon may take to answer")
      ->type_name("TIME")
      ->capture_default_str();
  app.add_flag(
      "--json", invocation.json,
      "Print JSON with the names of the proto: one object; of streams, one per line; errors on stderr");
}

/// Machines that the words of the command line name: of axes "press-1/a,press-1/b", of targets
/// "press-1/a=5mm".
void note_machines(Invocation& invocation, const std::string& word) {
  for (const auto& name : CLI::detail::split(word.substr(0, word.find('=')), ','))
    if (const auto machine = machine_in(name); !machine.empty()) invocation.machines.emplace(machine);
}

/// "press-1/4294967297", as lease acquire prints it in a cell: the number.
std::string lease_token(Invocation& invocation, const std::string& word) {
  const std::string machine(machine_in(word));
  if (machine.empty()) return word;
  if (!invocation.connection.through_entrance())
    throw CLI::ValidationError("--lease",
                               fmt::format("'{}' is that of a machine of a cell: --cell is missing", word));
  check_machine_name(machine);
  invocation.connection.lease_machine = machine;
  return std::string(without_machine(word));
}

void note_machines_of(CLI::App& command, Invocation& invocation) {
  static const std::set<std::string> naming{"AXIS", "GROUP", "TARGET", "BUS", "DEVICE", "ID", "RECORD"};
  for (auto* option : command.get_options()) {
    const auto name = option->get_positional() ? option->get_name() : option->get_type_name();
    if (naming.contains(name))
      option->each([&invocation](const std::string& word) { note_machines(invocation, word); });
  }
  for (auto* option : command.get_options())
    if (option->get_envname() == "AXISD_LEASE")
      option->transform([&invocation](const std::string& word) { return lease_token(invocation, word); }, "");
  for (auto* part : command.get_subcommands(nullptr)) note_machines_of(*part, invocation);
}

/// Whoever names a daemon means that one, whatever cell the environment names: it may be the entrance that
/// does not answer. And whatever stop lane: that of another machine would stop an axis of that name there.
void prefer_server(CLI::App& app, const std::vector<std::string>& words) {
  const auto end = std::ranges::find(words, "--");
  const auto given = [&](const std::string& option) {
    return std::any_of(words.begin(), end, [&option](const std::string& word) {
      return word == option || word.starts_with(option + "=");
    });
  };
  if (!given("--server")) return;
  if (!given("--stop-server")) app.get_option("--stop-server")->envname("");
  if (given("--cell"))
    throw Failure(ExitCode::usage, "--server is one machine, --cell several; give one of them");
  app.get_option("--cell")->envname("");
  app.get_option("--machine")->envname("");
}

/// "-.5" becomes "-0.5": CLI11 takes a dash and a digit for a value, a dash and a point for an option.
std::string with_leading_zero(std::string word) {
  if (word.size() > 2 && word.starts_with("-.") && word[2] >= '0' && word[2] <= '9') word.insert(1, "0");
  return word;
}

/// CLI11 says of a misspelt subcommand only that one is missing. `words` as they were given; empty: none of
/// them is it.
std::string misspelt(const CLI::App& app, const CLI::App& command, std::string_view help,
                     const std::vector<std::string>& words) {
  const auto known = command.get_subcommands([](const CLI::App*) { return true; });
  const auto names =
      config::names_of(known, [](const CLI::App* each) -> std::string_view { return each->get_name(); });
  const auto left = app.remaining(true);
  for (const auto& word : words) {
    if (word.starts_with('-') || std::ranges::find(left, word) == left.end()) continue;
    const auto near = config::nearest(word, names);
    return fmt::format(
        "there is no command {}; {}", config::quoted(word),
        near.empty() ? fmt::format("see '{} --help'", help) : fmt::format("did you mean '{}'?", near));
  }
  return {};
}

/// The same of options. Behind "--" all words are values.
std::string misspelt_option(const CLI::App& app, const CLI::App* command,
                            const std::vector<std::string>& words) {
  std::vector<std::string> known;
  for (; command != nullptr; command = command->get_parent())
    for (const auto* option : command->get_options())
      for (const auto& name : option->get_lnames()) known.push_back("--" + name);
  for (const auto& word : app.remaining(true)) {
    const auto name = word.substr(0, word.find('='));
    if (!name.starts_with("--") || name.size() < 4) continue;
    const bool known_one = std::ranges::find(known, name) != known.end();
    if (known_one && std::ranges::find(words, "--") != words.end())
      return fmt::format("{} stands behind '--', where it is a value; give it before that",
                         config::quoted(name));
    if (known_one) continue;
    if (const auto near = did_you_mean(name, known, ""); !near.empty())
      return fmt::format("there is no option {}; {}", config::quoted(name), near);
  }
  return {};
}

Failure usage_error(const CLI::App& app, const CLI::ParseError& error,
                    const std::vector<std::string>& words) {
  std::string help = "axisctl";
  const auto* command = &app;
  while (!command->get_subcommands().empty()) {
    command = command->get_subcommands().front();
    help += " " + command->get_name();
  }
  if (command->get_require_subcommand_min() > 0)
    if (const auto text = misspelt(app, *command, help, words); !text.empty()) return {ExitCode::usage, text};
  if (const auto text = misspelt_option(app, command, words); !text.empty()) return {ExitCode::usage, text};
  return {ExitCode::usage, fmt::format("{}; see '{} --help'", error.what(), help)};
}

}  // namespace

Client& Invocation::client() {
  std::call_once(client_made_, [this] {
    connection.timeout = parse_duration(timeout, "--timeout");
    if (machines.size() == 1) connection.only_machine = *machines.begin();
    client_ = std::make_unique<Client>(connection);
  });
  return *client_;
}

v1::AxisState Invocation::state(const std::string& axis) {
  v1::GetAxisRequest request;
  request.set_axis(axis);
  return client().call(&v1::AxisService::Stub::GetAxis, request, axis).state();
}

void Invocation::note_started(const v1::Command& command) {
  const std::lock_guard lock(started_mutex_);
  started.push_back(command);
}

bool Invocation::of_whole_cell() const { return connection.through_entrance() && connection.machine.empty(); }

std::unique_ptr<CLI::App> make_app(Invocation& invocation) {
  auto app = std::make_unique<CLI::App>("Commands the axes of a machine through axisd.", "axisctl");
  app->set_version_flag("--version", std::string("axisctl " AXISD_VERSION));
  app->footer(footer);
  app->fallthrough();  // --json and the like may stand behind the subcommand, too
  app->require_subcommand(1);
  add_global_options(*app, invocation);
  add_state_commands(*app, invocation);
  add_motion_commands(*app, invocation);
  add_jog_command(*app, invocation);
  add_stop_commands(*app, invocation);
  add_machine_commands(*app, invocation);
  add_command_commands(*app, invocation);
  add_lease_commands(*app, invocation);
  add_group_commands(*app, invocation);
  add_run_command(*app, invocation);
  add_plot_command(*app, invocation);
  add_commission_command(*app, invocation);
  add_sim_commands(*app, invocation);
  add_drive_commands(*app, invocation);
  add_bus_commands(*app, invocation);
  add_trace_command(*app, invocation);
  add_event_commands(*app, invocation);
  add_audit_commands(*app, invocation);
  add_system_commands(*app, invocation);
  add_explain_command(*app, invocation);
  add_config_commands(*app, invocation);
  add_budget_command(*app, invocation);
  add_offline_commands(*app, invocation);
  note_machines_of(*app, invocation);
  return app;
}

void execute(CLI::App& app, const std::vector<std::string>& words) {
  prefer_server(app, words);
  std::vector<std::string> reversed;  // as CLI11 wants them
  for (const auto& word : words) reversed.insert(reversed.begin(), with_leading_zero(word));
  try {
    app.parse(reversed);
  } catch (const CLI::Success&) {
    throw;
  } catch (const CLI::ParseError& error) {
    throw usage_error(app, error, words);
  }
}

int run(int argc, const char* const* argv) {
  // Words of a line that is being typed are no command line yet.
  if (argc > 1 && std::string_view(argv[1]) == "complete-words") {
    complete({argv + 2, argv + argc});
    return 0;
  }
  const std::vector<std::string> words(argv + 1, argv + argc);
  Invocation invocation;
  const auto app = make_app(invocation);
  try {
    execute(*app, words);
  } catch (const CLI::Success& text) {
    return app->exit(text);
  } catch (const Failure& failure) {
    // What could not be parsed has set nothing.
    complain(with_tls_trouble(failure, invocation.connection),
             invocation.json || std::ranges::find(words, "--json") != words.end());
    return std::to_underlying(failure.code());
  }
  return std::to_underlying(invocation.status);
}

}  // namespace axisd::axisctl
