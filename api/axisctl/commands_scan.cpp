// bus scan: which nodes are there, and lines for the configuration.
#include <fmt/format.h>
#include <unistd.h>

#include <CLI/CLI.hpp>
#include <memory>

#include "api/axisctl/bus_commands.hpp"
#include "api/axisctl/duration.hpp"
#include "api/axisctl/format.hpp"
#include "api/axisctl/interrupt.hpp"
#include "api/axisctl/machine_names.hpp"
#include "api/axisctl/quantity.hpp"
#include "api/axisctl/table.hpp"
#include "api/axisctl/terminal.hpp"
#include "api/axisctl/yaml_fragment.hpp"
#include "axisd/v1/axis_service.grpc.pb.h"
#include "axisd/v1/bus_service.grpc.pb.h"

namespace axisd::axisctl {
namespace {

using Stub = v1::BusService::Stub;

struct Arguments {
  std::string bus, nodes, timeout;
  std::vector<std::uint32_t> bauds;
  std::vector<std::string> formats;
  bool yaml = false;
};

v1::ScanRequest request_of(const Arguments& arguments) {
  v1::ScanRequest request;
  request.set_bus(arguments.bus);
  if (!arguments.nodes.empty()) {
    const auto dash = arguments.nodes.find('-');
    const auto node = [](std::string_view text) {
      const auto value = parse_integer(text, "--nodes");
      if (value < 1 || value > 247)
        throw Failure(ExitCode::usage, fmt::format("--nodes: {} is no address; permitted: 1 to 247", value));
      return static_cast<std::uint32_t>(value);
    };
    const std::string_view text = arguments.nodes;
    request.set_first_node(node(text.substr(0, dash)));
    request.set_last_node(dash == std::string::npos ? request.first_node() : node(text.substr(dash + 1)));
  }
  for (const auto baud : arguments.bauds) request.add_bauds(baud);
  for (const auto& format : arguments.formats) request.add_formats(format);
  if (!arguments.timeout.empty())
    set(*request.mutable_reply_timeout(), parse_duration(arguments.timeout, "--reply-timeout"));
  return request;
}

/// A line that is repainted on a terminal; on anything else nothing.
class Progress {
 public:
  explicit Progress(bool shown) : shown_(shown) {}
  Progress(const Progress&) = delete;
  Progress& operator=(const Progress&) = delete;
  ~Progress() {
    if (painted_) print("\r\x1b[K");
  }
  void show(const std::string& bus, const v1::ScanResponse& progress, int found) {
    if (!shown_ || progress.total() == 0) return;
    constexpr std::uint32_t bar = 20;
    const auto full = progress.probed() * bar / progress.total();
    print(fmt::format("\r\x1b[K{}  {} of {}  [{:#<{}}{: <{}}]  {} found", bus, progress.probed(),
                      progress.total(), "", full, "", bar - full, found));
    painted_ = true;
  }

 private:
  bool shown_, painted_ = false;
};

using Found = google::protobuf::RepeatedPtrField<v1::FoundNode>;

/// Runs the scan; false: interrupted, with what was found until then. As JSON all of it is one object.
bool run(Invocation& invocation, const Arguments& arguments, Found& found) {
  const auto request = request_of(arguments);
  grpc::ClientContext context;
  const Interrupt interrupt([&context] { context.TryCancel(); });
  auto stream = invocation.client().stream(context, &Stub::Scan, request);
  v1::ScanResponse last;
  {
    Progress line(!invocation.json && !arguments.yaml && is_terminal(STDOUT_FILENO));
    for (v1::ScanResponse progress; stream.read(progress); last = progress) {
      found.MergeFrom(progress.found());
      line.show(arguments.bus, progress, found.size());
    }
  }
  const auto status = stream.finish();
  if (invocation.json && (status.ok() || interrupt.requested())) {
    *last.mutable_found() = found;
    print_line(json(last));
  }
  if (status.ok()) return true;
  if (interrupt.requested()) return false;
  throw invocation.client().failure(status, arguments.bus);
}

Table found_table(const Found& found) {
  Table table({"NODE", "BAUD", "FORMAT", "MODEL", "VERSION", "PULSES/REV", "CONFIGURED AS", "REMARKS"},
              {0, 1, 5});
  for (const auto& node : found) {
    const auto pulses = node.pulses_per_revolution();
    table.add({std::to_string(node.node()),
               std::to_string(node.baud()),
               node.format(),
               node.model().empty() ? Cell{"unknown", Colour::yellow} : Cell{node.model()},
               node.version(),
               pulses > 0 ? std::to_string(pulses) : "",
               node.configured_as(),
               {node.note(), Colour::yellow}});
  }
  return table;
}

Table network_found_table(const Found& found) {
  const auto code = [](bool given, std::uint32_t value) {
    return given ? fmt::format("0x{:08X}", value) : std::string();
  };
  Table table(
      {"NODE", "BIT/S", "MODEL", "PROFILE", "VENDOR", "PRODUCT", "PULSES/REV", "CONFIGURED AS", "REMARKS"},
      {0, 1, 3, 6});
  for (const auto& node : found) {
    const auto pulses = node.pulses_per_revolution();
    constexpr std::uint32_t profile = 0xFFFF;
    table.add({std::to_string(node.node()),
               std::to_string(node.baud()),
               node.model().empty() ? Cell{"unknown", Colour::yellow} : Cell{node.model()},
               node.has_device_type() ? std::to_string(node.device_type() & profile) : "",
               code(node.has_vendor(), node.vendor()),
               code(node.has_product(), node.product()),
               pulses > 0 ? std::to_string(pulses) : "",
               node.configured_as(),
               {node.note(), Colour::yellow}});
  }
  return table;
}

FragmentContext context_of(Invocation& invocation, const std::string& bus) {
  // A configuration is that of one machine: its names have no machine in front.
  FragmentContext context{.bus = std::string(without_machine(bus))};
  for (const auto& known :
       invocation.client().call(&Stub::ListBuses, v1::ListBusesRequest(), std::string_view()).buses())
    if (known.name() == bus) context.baud = known.baud();
  for (const auto& axis :
       invocation.client()
           .call(&v1::AxisService::Stub::ListAxes, v1::ListAxesRequest(), std::string_view())
           .axes())
    context.taken.emplace(without_machine(axis.axis()));
  return context;
}

void scan(Invocation& invocation, const Arguments& arguments) {
  Found found;
  if (!run(invocation, arguments, found)) invocation.status = ExitCode::interrupted;
  if (invocation.json) return;
  const std::vector<v1::FoundNode> nodes(found.begin(), found.end());
  const auto fragment =
      nodes.empty() ? std::string() : yaml_fragment(nodes, context_of(invocation, arguments.bus));
  if (arguments.yaml) {
    // The lines may go into a file, which says nothing of why there are none.
    if (fragment.empty())
      fmt::print(
          stderr, "{}: {}\n", arguments.bus,
          nodes.empty() ? "no node answered" : "all that answered is configured, or is no known drive");
    return print(fragment);
  }
  if (nodes.empty()) return print_line(fmt::format("{}: no node answered", arguments.bus));
  // Only nodes of an RS-485 line have a format.
  (nodes.front().format().empty() ? network_found_table(found) : found_table(found)).print(use_colour());
  if (!fragment.empty())
    print(fmt::format("\nNot configured yet; lines for 'axes:' of the configuration:\n\n{}", fragment));
}

}  // namespace

void add_scan_command(CLI::App& bus, Invocation& invocation) {
  auto* command = bus.add_subcommand(
      "scan", "Look for nodes; of drives that are not configured yet, ends with lines for the configuration");
  const auto arguments = std::make_shared<Arguments>();
  command->add_option("BUS", arguments->bus, "Name of the bus")->required();
  command->add_option("--nodes", arguments->nodes, "Addresses, 1-32 or 7 (default 1-127)")
      ->type_name("RANGE");
  command->add_option("--baud", arguments->bauds, "Rates to try, 9600,115200 (default: the bus's)")
      ->type_name("LIST")
      ->delimiter(',');
  command->add_option("--format", arguments->formats, "Formats to try, 8N1,8E1 (default: the bus's)")
      ->type_name("LIST")
      ->delimiter(',');
  command->add_option("--reply-timeout", arguments->timeout, "How long to wait for each node")
      ->type_name("TIME");
  command->add_flag("--yaml", arguments->yaml, "Only the lines for the configuration");
  command->footer(R"(
Other rates and formats than the bus's own are refused while any of its axes is enabled. On a CAN network only its own
bit rate is tried: that of the interface is not axisd's to change.

Examples:
  axisctl bus scan line-a --nodes 1-32
  axisctl bus scan line-a --baud 9600,115200 --format 8N1,8E1
  axisctl bus scan line-a --yaml >> axes.yaml
  axisctl bus scan can0)");
  command->callback([&invocation, arguments] { scan(invocation, *arguments); });
}

}  // namespace axisd::axisctl
