// run: commands from a file, one after the other.
#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <cerrno>
#include <cstring>
#include <fstream>
#include <iostream>
#include <iterator>
#include <memory>

#include "api/axisctl/format.hpp"
#include "api/axisctl/interrupt.hpp"
#include "api/axisctl/invocation.hpp"
#include "api/axisctl/progress.hpp"
#include "api/axisctl/script.hpp"
#include "api/axisctl/terminal.hpp"
#include "axisd/v1/command_service.grpc.pb.h"

namespace axisd::axisctl {
namespace {

struct RunArguments {
  std::string path;
  bool check = false;
};

std::string read_script(const std::string& path) {
  if (path == "-") return {std::istreambuf_iterator<char>(std::cin), {}};
  std::ifstream file(path);
  std::string text;
  if (file.is_open()) text.assign(std::istreambuf_iterator<char>(file), {});
  if (!file)
    throw Failure(ExitCode::usage,
                  fmt::format("cannot read the script '{}': {}", path, std::strerror(errno)));
  return text;
}

/// Thrown where the command would be executed.
struct Parsed {};

/// A script as it is executed.
class Script {
 public:
  Script(Invocation& invocation, const std::string& path)
      : invocation_(invocation), name_(path), lines_(parse_script(read_script(path), path)) {}

  /// Commands and options of every line; values are looked at when it is its turn. Throws Failure (usage).
  void check() const {
    if (lines_.empty()) throw Failure(ExitCode::usage, fmt::format("there is no command in '{}'", name_));
    for (const auto& line : lines_)
      at(line, [&] {
        Invocation nobody;
        const auto app = make_app(nobody);
        // Before that of any subcommand; only now are all options known to be right.
        app->parse_complete_callback([] { throw Parsed(); });
        try {
          execute(*app, line.words);
        } catch (const Parsed&) {
          if (app->got_subcommand("run")) throw Failure(ExitCode::usage, "a script cannot run another");
        }
      });
  }

  /// Throws Failure at the first line that does not succeed, or once Ctrl-C has halted what is still moving.
  void run() {
    const Interrupt interrupt([] {});
    try {
      for (const auto& line : lines_) {
        if (interrupt.requested()) break;
        at(line, [&] { run_line(line); });
      }
    } catch (const Failure&) {
      if (!interrupt.requested()) throw;
    }
    if (!interrupt.requested()) return;
    halt_started();
    throw Failure(ExitCode::interrupted, fmt::format("{}: interrupted", name_));
  }

  [[nodiscard]] std::size_t size() const { return lines_.size(); }

 private:
  /// What goes wrong in a line names it.
  template <class Action>
  void at(const ScriptLine& line, Action&& action) const {
    const auto text = [&](std::string_view why) { return fmt::format("{}:{}: {}", name_, line.number, why); };
    try {
      action();
    } catch (const CLI::Success&) {
      throw Failure(ExitCode::usage, text("--help and --version have no place in a script"));
    } catch (const Failure& failure) {
      throw failure.saying(text(failure.what()));
    }
  }

  void run_line(const ScriptLine& line) {
    Invocation invocation;
    invocation.in_script = true;
    auto words = inherited();
    words.insert(words.end(), line.words.begin(), line.words.end());
    if (!invocation_.json) print_line(fmt::format("{}: {}", line.number, text_of(line)));
    const auto keep_started = [&] {
      started_.insert(started_.end(), invocation.started.begin(), invocation.started.end());
    };
    try {
      execute(*make_app(invocation), words);
    } catch (const Failure&) {
      keep_started();
      throw;
    }
    keep_started();
    if (invocation.status != ExitCode::ok)
      throw Failure(invocation.status, "did not succeed; the lines behind it were not executed");
  }

  /// The options that the script itself was given.
  [[nodiscard]] std::vector<std::string> inherited() const {
    const auto& connection = invocation_.connection;
    std::vector<std::string> words{"--timeout", invocation_.timeout};
    const auto add = [&](const char* option, const std::string& value) {
      if (!value.empty()) words.insert(words.end(), {option, value});
    };
    add("--cell", connection.cell);
    add("--machine", connection.machine);
    if (!connection.through_entrance()) {
      add("--server", connection.server);
      add("--stop-server", connection.stop_server);
    }
    add("--tls-ca", connection.tls_ca);
    add("--tls-cert", connection.tls_certificate);
    add("--tls-key", connection.tls_key);
    add("--as", connection.speaks_for);
    if (invocation_.json) words.emplace_back("--json");
    return words;
  }

  /// Only what this script started, and what still goes on: another motion of the axis is not its to halt.
  void halt_started() {
    for (const auto& command : started_) {
      try {
        v1::GetCommandRequest request;
        request.set_id(command.id());
        const auto now = invocation_.client().call(&v1::CommandService::Stub::GetCommand, request,
                                                   command.axis(), Lane::stop);
        if (ended(now.command())) continue;
        const auto halt = halt_axis(invocation_, command.axis(), invocation_.client().timeout());
        print_line(invocation_.json ? json(halt) : command_line(halt, {}));
      } catch (const Failure& failure) {
        complain(failure.saying(fmt::format("NOT halted: {}", failure.what())), invocation_.json);
      }
    }
  }

  Invocation& invocation_;
  std::string name_;
  std::vector<ScriptLine> lines_;
  std::vector<v1::Command> started_;
};

}  // namespace

void add_run_command(CLI::App& app, Invocation& invocation) {
  auto* command =
      app.add_subcommand("run", "Execute the commands in a file, up to the first that does not succeed");
  const auto arguments = std::make_shared<RunArguments>();
  command
      ->add_option("FILE", arguments->path,
                   "One command per line, as behind axisctl; # begins a comment; -: standard input")
      ->required();
  command->add_flag("--check", arguments->check, "Look at the commands and their options, execute nothing");
  command->footer(R"(
Before the first line is executed, all are looked at. Ctrl-C halts the axes that the script has set in motion. A line that
does not succeed ends the script, but no motion of the lines before it. Example:
  home feeder lifter --wait
  move feeder 120mm --velocity 50mm/s     # goes on while the next line is executed
  move lifter 100mm --wait)");
  command->callback([&invocation, arguments] {
    Script script(invocation, arguments->path);
    script.check();
    if (!arguments->check) return script.run();
    print_line(
        fmt::format("{}: ok, {} command{}", arguments->path, script.size(), script.size() == 1 ? "" : "s"));
  });
}

}  // namespace axisd::axisctl
