#include "daemon/sim/options.hpp"

#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <cstdio>
#include <cstdlib>
#include <string_view>

namespace axisd::sim {
namespace {

/// One drive, spelt out.
struct SingleDrive {
  int node = 0;
  std::string model, home_switch, positive_limit, negative_limit;
  std::vector<std::string> switches, eeprom, wires;

  /// In the spelling of --drive.
  [[nodiscard]] std::string text() const {
    auto text = fmt::format("node={},model={}", node, model);
    const auto add = [&](std::string_view key, const std::string& value) {
      if (!value.empty()) text += fmt::format(",{}={}", key, value);
    };
    add("home", home_switch);
    add("positive_limit", positive_limit);
    add("negative_limit", negative_limit);
    for (const auto& one : switches) text += ",switch." + one;
    for (const auto& one : eeprom) text += ",eeprom." + one;
    for (const auto& one : wires) text += ",wire." + one;
    return text;
  }
};

void declare_wire(CLI::App& app, Options& options) {
  auto* link = app.add_option("--link", options.link, "symbolic link to the terminal that clients open");
  auto* baud =
      app.add_option("--baud", options.baud, "bit/s that the drives are set to; the line follows its client")
          ->check(CLI::Range(1200, 4'000'000));
  auto* format = app.add_option("--format", options.format, "8N1, 8N2, 8E1 or 8O1")
                     ->check(CLI::IsMember({"8N1", "8N2", "8E1", "8O1"}));
  auto* turnaround = app.add_option("--turnaround-us", options.turnaround_us,
                                    "from request to reply; at least 3.5 characters")
                         ->check(CLI::Range(0, 1'000'000));
  auto* can = app.add_option("--can", options.can, "network interface of CAN drives, instead of a terminal");
  for (auto* serial : {link, baud, format, turnaround}) can->excludes(serial);
  app.add_option("--bitrate", options.bitrate,
                 "bit/s that the CAN drives are set to; default: as the interface")
      ->check(CLI::Range(10'000U, 1'000'000U))
      ->needs(can);
}

void declare_drives(CLI::App& app, Options& options, SingleDrive& single) {
  app.add_option("--drive", options.drives,
                 "a drive: node=N,model=NAME[,home=FROM:TO[,turn=N]][,positive_limit=N][,negative_limit=N]"
                 "[,switch.NAME=on|off][,eeprom.ADDRESS=VALUE][,encoder.NAME=VALUE][,wire.TERMINAL=home|"
                 "positive_limit|negative_limit"
                 "[:nc]][,dip=ADDRESS][,dip_baud=BAUD|custom][,boot_ms=N][,powered=off][,eds=FILE][,counts=N]"
                 "[,velocity_unit=NAME][,acceleration_unit=NAME]; may be repeated")
      ->allow_extra_args(false);
  app.add_option("--node", single.node, "address of a single drive")->check(CLI::Range(1, 127));
  app.add_option("--model", single.model, "its model");
  app.add_option("--home-switch", single.home_switch, "its home switch is active between, FROM:TO in pulses");
  app.add_option("--positive-limit", single.positive_limit, "its positive limit is active from here on");
  app.add_option("--negative-limit", single.negative_limit, "its negative limit is active from here on");
  app.add_option("--switch", single.switches, "NAME=on|off: how it decides an open point of its manual")
      ->allow_extra_args(false);
  app.add_option("--eeprom", single.eeprom, "ADDRESS=VALUE that it starts with")->allow_extra_args(false);
  app.add_option("--wire", single.wires, "TERMINAL=home|positive_limit|negative_limit[:nc]")
      ->allow_extra_args(false);
}

}  // namespace

Options parse_options(int argc, char** argv) {
  Options options;
  SingleDrive single;
  CLI::App app("Simulated drives on a pseudo terminal or a CAN interface, true to their manuals");
  declare_wire(app, options);
  declare_drives(app, options, single);
  app.add_option("--log", options.log, "file for every frame: <ns> rx|tx <frame>");
  app.add_option("--control", options.control, "unix socket for commands (send: help)");
  app.add_flag("--list-switches", options.list_switches, "print the switches of every model and end");
  try {
    app.parse(argc, argv);
  } catch (const CLI::ParseError& error) {
    if (error.get_exit_code() == 0) std::exit(app.exit(error));
    fmt::print(stderr, "axisd-sim: {}\n", error.what());
    std::exit(2);
  }
  if (single.node != 0) options.drives.push_back(single.text());
  return options;
}

}  // namespace axisd::sim
