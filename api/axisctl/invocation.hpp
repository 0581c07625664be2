// What all subcommands share: the options before them, the connection, the exit status.
#pragma once

#include <memory>
#include <mutex>
#include <set>
#include <string>
#include <vector>

#include "api/axisctl/client.hpp"
#include "api/axisctl/error.hpp"
#include "axisd/v1/types.pb.h"

namespace CLI {
class App;
}

namespace axisd::axisctl {

struct Invocation {
  Connection connection;
  std::string timeout = "10s";  ///< as given, parsed on first use
  bool json = false;
  ExitCode status = ExitCode::ok;
  bool in_script = false;            ///< Ctrl-C is the script's, which halts what it started
  std::vector<v1::Command> started;  ///< motion commands that this invocation sent
  std::set<std::string> machines;    ///< of the cell, that names on the command line are of

  /// The client, made at first use: offline commands need none. Thread: any.
  Client& client();
  /// The axis's state as the daemon last saw it. Throws Failure.
  v1::AxisState state(const std::string& axis);
  /// Notes a motion command that was sent. Thread: any.
  void note_started(const v1::Command& command);
  /// The whole cell is meant: there is one, and no machine is named.
  [[nodiscard]] bool of_whole_cell() const;

 private:
  std::mutex started_mutex_;
  std::once_flag client_made_;
  std::unique_ptr<Client> client_;
};

// Each adds its subcommands to `app`; their callbacks run on `invocation`, which outlives the app.
void add_state_commands(CLI::App& app, Invocation& invocation);  ///< list, state, watch
void add_motion_commands(CLI::App& app,
                         Invocation& invocation);             ///< enable, disable, home, move, velocity, ...
void add_jog_command(CLI::App& app, Invocation& invocation);  ///< jog
void add_stop_commands(CLI::App& app, Invocation& invocation);     ///< halt, stop, quick-stop, release-stop
void add_machine_commands(CLI::App& app, Invocation& invocation);  ///< machines
void add_command_commands(CLI::App& app, Invocation& invocation);  ///< command get|watch|cancel
void add_lease_commands(CLI::App& app, Invocation& invocation);    ///< lease acquire|renew|release|list|hold
void add_group_commands(CLI::App& app, Invocation& invocation);    ///< group list|move|show|halt|stop
void add_drive_commands(CLI::App& app, Invocation& invocation);    ///< drive ...
void add_bus_commands(CLI::App& app, Invocation& invocation);      ///< bus scan|read|write, device list|write
void add_trace_command(CLI::App& app, Invocation& invocation);     ///< trace
void add_budget_command(CLI::App& app, Invocation& invocation);    ///< budget
void add_event_commands(CLI::App& app, Invocation& invocation);    ///< events
void add_audit_commands(CLI::App& app, Invocation& invocation);    ///< audit, report
void add_system_commands(CLI::App& app, Invocation& invocation);   ///< buses, info
void add_explain_command(CLI::App& app, Invocation& invocation);   ///< explain
void add_config_commands(CLI::App& app, Invocation& invocation);   ///< config show|check
void add_offline_commands(CLI::App& app, Invocation& invocation);  ///< check, schema, completion, man
void add_run_command(CLI::App& app, Invocation& invocation);       ///< run
void add_plot_command(CLI::App& app, Invocation& invocation);      ///< plot
void add_commission_command(CLI::App& app, Invocation& invocation);  ///< commission
void add_sim_commands(CLI::App& app, Invocation& invocation);        ///< sim input|alarm|power|lose|...

/// The command line with all its subcommands.
std::unique_ptr<CLI::App> make_app(Invocation& invocation);
/// Parses `words` and runs what they ask for. Throws Failure, or CLI::Success for --help and --version.
void execute(CLI::App& app, const std::vector<std::string>& words);

/// The whole program. Prints errors; returns the exit status.
int run(int argc, const char* const* argv);

}  // namespace axisd::axisctl
