// trace: the frames of a bus as they come, for people and for other tools.
#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <fstream>
#include <iostream>
#include <memory>
#include <optional>

#include "api/axisctl/bus_view.hpp"
#include "api/axisctl/duration.hpp"
#include "api/axisctl/format.hpp"
#include "api/axisctl/frame_names.hpp"
#include "api/axisctl/interrupt.hpp"
#include "api/axisctl/invocation.hpp"
#include "api/axisctl/quantity.hpp"
#include "api/axisctl/terminal.hpp"
#include "api/axisctl/trace_format.hpp"
#include "axisd/v1/axis_service.grpc.pb.h"
#include "axisd/v1/bus_service.grpc.pb.h"
#include "axisd/v1/drive_service.grpc.pb.h"

namespace axisd::axisctl {
namespace {

struct Arguments {
  std::string bus, node, output, format = "text", limit;
  bool plain = false;
};

TraceFormat format_of(const std::string& name) {
  if (name == "candump") return TraceFormat::candump;
  return name == "pcap" ? TraceFormat::pcap : TraceFormat::text;
}

/// Writes frames to a file or to the standard output, and counts them.
class Sink {
 public:
  /// Without `names` text is as the wire log has it.
  Sink(const Arguments& arguments, bool json, v1::Bus bus, std::optional<FrameNames> names)
      : format_(format_of(arguments.format)), json_(json), bus_(std::move(bus)), names_(std::move(names)) {
    if (!arguments.output.empty()) {
      file_.open(arguments.output, std::ios::binary | std::ios::trunc);
      if (!file_)
        throw Failure(ExitCode::usage, fmt::format("--output: '{}' cannot be written", arguments.output));
    }
    if (format_ == TraceFormat::pcap && !json_) out() << pcap_header(is_network(bus_));
    out().flush();
  }

  void take(const v1::TraceBusResponse& batch) {
    lost_ += batch.lost();
    if (json_) {
      if (!batch.frames().empty() || batch.lost() > 0) out() << axisctl::json(batch) << '\n';
      frames_ += static_cast<std::uint64_t>(batch.frames_size());
    } else {
      if (batch.lost() > 0 && format_ == TraceFormat::text)
        out() << fmt::format("# {} frames were lost here\n", batch.lost());
      for (const auto& frame : batch.frames()) write(frame);
    }
    out().flush();
    if (!out()) throw Failure(ExitCode::usage, "the trace cannot be written any more");
  }
  /// To the standard error: what the trace itself does not show.
  void tell() const {
    if (!file_.is_open() && (lost_ == 0 || json_ || format_ == TraceFormat::text)) return;
    std::cerr << fmt::format("{}: {} frames{}\n", bus_.name(), frames_,
                             lost_ > 0 ? fmt::format(", {} were lost", lost_) : "");
  }

 private:
  std::ostream& out() { return file_.is_open() ? file_ : std::cout; }

  void write(const v1::TracedFrame& frame) {
    if (format_ == TraceFormat::text) {
      const auto meaning = names_ ? names_->text(frame) : std::string();
      out() << frame.text() << (meaning.empty() ? "" : "  # ") << meaning << '\n';
    } else if (!on_wire(frame)) {
      return;
    } else if (format_ == TraceFormat::candump) {
      out() << candump_line(frame, bus_.simulated() ? bus_.name() : bus_.port()) << '\n';
    } else {
      out() << pcap_packet(frame);
    }
    ++frames_;
  }

  TraceFormat format_;
  bool json_;
  v1::Bus bus_;
  std::optional<FrameNames> names_;
  std::ofstream file_;
  std::uint64_t frames_ = 0, lost_ = 0;
};

v1::Bus bus_of(Invocation& invocation, const std::string& name) {
  const auto all =
      invocation.client().call(&v1::BusService::Stub::ListBuses, v1::ListBusesRequest(), std::string_view());
  for (const auto& bus : all.buses())
    if (bus.name() == name) return bus;
  throw no_such_bus(name, all);
}

/// What the drives on this bus call their registers and objects.
FrameNames names_on(Invocation& invocation, const std::string& bus) {
  FrameNames names;
  const auto all =
      invocation.client().call(&v1::AxisService::Stub::ListAxes, v1::ListAxesRequest(), std::string_view());
  for (const auto& axis : all.axes()) {
    if (axis.bus() != bus) continue;
    v1::ListParametersRequest request;
    request.set_axis(axis.axis());
    // Of each axis: drives of one model may have data sheets of their own.
    names.add(axis.node(),
              invocation.client().call(&v1::DriveService::Stub::ListParameters, request, axis.axis()));
  }
  return names;
}

void trace(Invocation& invocation, const Arguments& arguments) {
  v1::TraceBusRequest request;
  request.set_bus(arguments.bus);
  if (!arguments.node.empty())
    request.set_node(static_cast<std::uint32_t>(parse_integer(arguments.node, "--node")));
  const auto bus = bus_of(invocation, arguments.bus);
  if (arguments.format == "candump" && !is_network(bus))
    throw Failure(ExitCode::usage, "candump is a format for CAN; use --format text or pcap");
  grpc::ClientContext context;
  std::optional<std::chrono::nanoseconds> limit;
  if (!arguments.limit.empty()) limit = parse_duration(arguments.limit, "--for");
  std::optional<FrameNames> names;
  if (arguments.format == "text" && arguments.output.empty() && !arguments.plain && !invocation.json)
    names = names_on(invocation, bus.name());
  Sink sink(arguments, invocation.json, bus, std::move(names));
  const Interrupt interrupt([&context] { context.TryCancel(); });
  if (limit)
    context.set_deadline(std::chrono::system_clock::now() +
                         std::chrono::duration_cast<std::chrono::system_clock::duration>(*limit));
  auto stream = invocation.client().stream(context, &v1::BusService::Stub::TraceBus, request);
  for (v1::TraceBusResponse batch; stream.read(batch);) sink.take(batch);
  const auto status = stream.finish();
  const bool over = limit && status.error_code() == grpc::StatusCode::DEADLINE_EXCEEDED;
  if (over || interrupt.requested()) return sink.tell();
  if (status.ok()) throw Failure(ExitCode::unreachable, "the daemon ended the stream");
  throw invocation.client().failure(status, arguments.bus);
}

}  // namespace

void add_trace_command(CLI::App& app, Invocation& invocation) {
  auto* command = app.add_subcommand("trace", "The frames of a bus as they come, until Ctrl-C");
  const auto arguments = std::make_shared<Arguments>();
  command->add_option("BUS", arguments->bus, "Name of the bus")->required();
  command->add_option("--node", arguments->node, "Only frames of this node")->type_name("NODE");
  command->add_option("--output", arguments->output, "Into this file")->type_name("PATH");
  command->add_option("--format", arguments->format, "text, candump (CAN only) or pcap")
      ->check(CLI::IsMember({"text", "candump", "pcap"}))
      ->capture_default_str();
  command->add_flag("--plain", arguments->plain, "Text without the names of registers and objects");
  command->add_option("--for", arguments->limit, "End after this time, such as 10s")->type_name("TIME");
  command->footer(R"help(
Text has what was not sent and why, too, and on the standard output what each frame says, behind a #; the other formats
only what was on the wire. Wireshark shows a pcap file of an RS-485 line once DLT_USER 0 (147) is set to the dissector
mbrtu.

Examples:
  axisctl trace line-a --node 3
  axisctl trace can0 --format candump --output can0.log     # canplayer -I can0.log
  axisctl trace line-a --format pcap --for 10s --output line-a.pcap
  tshark -r line-a.pcap -o 'uat:user_dlts:"User 0 (DLT=147)","mbrtu","0","","0",""')help");
  command->callback([&invocation, arguments] { trace(invocation, *arguments); });
}

}  // namespace axisd::axisctl
