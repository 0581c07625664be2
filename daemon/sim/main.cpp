// axisd-sim: simulated drives on a pseudo terminal, as a program of its own.
#include <fmt/format.h>
#include <signal.h>

#include <CLI/CLI.hpp>
#include <cerrno>
#include <cstdio>
#include <cstring>
#include <memory>
#include <string>
#include <vector>

#include "devices/simulation/control.hpp"
#include "devices/simulation/control_socket.hpp"
#include "devices/simulation/drive_option.hpp"
#include "devices/simulation/pty_line.hpp"
#include "devices/simulation/simulator.hpp"

namespace {

using namespace axisd;
using namespace axisd::simulation;

struct Options {
  std::string link, log, control, format = "8N1";
  int baud = 115200;
  int turnaround_us = 2000;
  std::vector<std::string> drives;
  // One drive, spelt out.
  int node = 0;
  std::string model, home_switch, positive_limit, negative_limit;
  std::vector<std::string> switches, eeprom, wires;
  bool list_switches = false;
};

void declare(CLI::App& app, Options& options) {
  app.add_option("--link", options.link, "symbolic link to the terminal that clients open");
  app.add_option("--baud", options.baud, "bit/s that the drives are set to; the line follows its client")
      ->check(CLI::Range(1200, 4'000'000));
  app.add_option("--format", options.format, "8N1, 8N2, 8E1 or 8O1")
      ->check(CLI::IsMember({"8N1", "8N2", "8E1", "8O1"}));
  app.add_option("--turnaround-us", options.turnaround_us, "from request to reply; at least 3.5 characters")
      ->check(CLI::Range(0, 1'000'000));
  app.add_option(
         "--drive", options.drives,
         "a drive: node=N,model=NAME[,home=FROM:TO][,positive_limit=N][,negative_limit=N]"
         "[,switch.NAME=on|off][,eeprom.REGISTER=VALUE][,wire.TERMINAL=home|positive_limit|negative_limit"
         "[:nc]][,dip=ADDRESS][,dip_baud=BAUD|custom][,boot_ms=N][,powered=off]; may be repeated")
      ->allow_extra_args(false);
  app.add_option("--node", options.node, "address of a single drive")->check(CLI::Range(1, 127));
  app.add_option("--model", options.model, "its model");
  app.add_option("--home-switch", options.home_switch,
                 "its home switch is active between, FROM:TO in pulses");
  app.add_option("--positive-limit", options.positive_limit, "its positive limit is active from here on");
  app.add_option("--negative-limit", options.negative_limit, "its negative limit is active from here on");
  app.add_option("--switch", options.switches, "NAME=on|off: how it decides an open point of its manual")
      ->allow_extra_args(false);
  app.add_option("--eeprom", options.eeprom, "REGISTER=VALUE that it starts with")->allow_extra_args(false);
  app.add_option("--wire", options.wires, "TERMINAL=home|positive_limit|negative_limit[:nc]")
      ->allow_extra_args(false);
  app.add_option("--log", options.log, "file for every frame: <ns> rx|tx <hex>");
  app.add_option("--control", options.control, "unix socket for commands (send: help)");
  app.add_flag("--list-switches", options.list_switches, "print the switches of every model and end");
}

/// The single drive in the spelling of --drive.
std::string single_drive(const Options& options) {
  auto text = fmt::format("node={},model={}", options.node, options.model);
  const auto add = [&](std::string_view key, const std::string& value) {
    if (!value.empty()) text += fmt::format(",{}={}", key, value);
  };
  add("home", options.home_switch);
  add("positive_limit", options.positive_limit);
  add("negative_limit", options.negative_limit);
  for (const auto& one : options.switches) text += ",switch." + one;
  for (const auto& one : options.eeprom) text += ",eeprom." + one;
  for (const auto& one : options.wires) text += ",wire." + one;
  return text;
}

Result<std::vector<std::unique_ptr<SimulatedRtuNode>>> make_nodes(const Options& options) {
  auto drives = options.drives;
  if (options.node != 0) drives.push_back(single_drive(options));
  if (drives.empty())
    return fail(Reason::invalid_argument, "there is no drive", "give --drive or --node with --model");
  std::vector<std::unique_ptr<SimulatedRtuNode>> nodes;
  for (const auto& text : drives) {
    auto option = parse_drive(text);
    if (!option) return std::unexpected(option.error());
    auto node = make_node(option->model, std::move(option->settings));
    if (!node) return std::unexpected(node.error());
    nodes.push_back(std::move(*node));
  }
  return nodes;
}

void print_switches() {
  for (const auto* simulator : simulators())
    for (const auto& one : simulator->switches)
      fmt::print("{} {}={} {}\n", simulator->model, one.name, one.default_value ? "on" : "off", one.meaning);
}

/// The option is checked to be one of four.
modbus_rtu::Format format_from(std::string_view text) {
  using enum modbus_rtu::Parity;
  return {.parity = text[1] == 'E' ? even : text[1] == 'O' ? odd : none, .stop_bits = text[2] - '0'};
}

using File = std::unique_ptr<std::FILE, int (*)(std::FILE*)>;

/// One line per frame, written at once, so that a reader sees the wire as it is.
void log_frame(std::FILE* file, TimePoint begin, bool received, std::span<const std::uint8_t> frame) {
  fmt::memory_buffer line;
  fmt::format_to(std::back_inserter(line), "{} {} ", begin.time_since_epoch().count(),
                 received ? "rx" : "tx");
  for (const auto byte : frame) fmt::format_to(std::back_inserter(line), "{:02X}", byte);
  line.push_back('\n');
  std::fwrite(line.data(), 1, line.size(), file);
}

int complain(const Error& error) {
  fmt::print(stderr, "axisd-sim: {}{}{}\n", error.message, error.remedy.empty() ? "" : "; ", error.remedy);
  return 2;
}

int serve(const Options& options) {
  // Before any thread: only sigwait() below sees them.
  sigset_t endings;
  sigemptyset(&endings);
  sigaddset(&endings, SIGTERM);
  sigaddset(&endings, SIGINT);
  pthread_sigmask(SIG_BLOCK, &endings, nullptr);

  auto nodes = make_nodes(options);
  if (!nodes) return complain(nodes.error());
  PtyLineSettings settings{.serial = {.baud = options.baud, .format = format_from(options.format)},
                           .turnaround = std::chrono::microseconds(options.turnaround_us),
                           .link = options.link,
                           .observer = {}};
  File log(nullptr, &std::fclose);
  if (!options.log.empty()) {
    log.reset(std::fopen(options.log.c_str(), "we"));
    if (!log)
      return complain({.reason = Reason::invalid_argument,
                       .message = fmt::format("{}: {}", options.log, std::strerror(errno)),
                       .remedy = "choose another --log"});
    std::setvbuf(log.get(), nullptr, _IOLBF, 4096);
    settings.observer = [file = log.get()](TimePoint begin, bool received,
                                           std::span<const std::uint8_t> frame) {
      log_frame(file, begin, received, frame);
    };
  }
  auto line = PtyLine::open(std::move(settings), std::move(*nodes));
  if (!line) return complain(line.error());
  std::unique_ptr<ControlSocket> control;
  if (!options.control.empty()) {
    auto opened = ControlSocket::open(options.control, [raw = line->get()](std::string_view command) {
      return execute_control(*raw, command);
    });
    if (!opened) return complain(opened.error());
    control = std::move(*opened);
  }
  fmt::print("ready {}\n", (*line)->path());
  std::fflush(stdout);
  int signal = 0;
  sigwait(&endings, &signal);
  return 0;
}

}  // namespace

int main(int argc, char** argv) {
  CLI::App app("Simulated drives on a pseudo terminal, true to their manuals at register level");
  Options options;
  declare(app, options);
  try {
    app.parse(argc, argv);
  } catch (const CLI::ParseError& error) {
    if (error.get_exit_code() == 0) return app.exit(error);
    fmt::print(stderr, "axisd-sim: {}\n", error.what());
    return 2;
  }
  if (options.list_switches) {
    print_switches();
    return 0;
  }
  return serve(options);
}
