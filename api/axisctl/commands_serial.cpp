// drive readdress|set-serial: what a drive answers to from its next power-up on.
#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <memory>

#include "api/axisctl/drive_commands.hpp"
#include "api/axisctl/duration.hpp"
#include "api/axisctl/format.hpp"
#include "api/axisctl/interrupt.hpp"
#include "api/axisctl/machine_names.hpp"
#include "api/axisctl/quantity.hpp"
#include "api/axisctl/terminal.hpp"
#include "axisd/v1/drive_service.grpc.pb.h"

namespace axisd::axisctl {
namespace {

using Stub = v1::DriveService::Stub;

struct Arguments : ConfirmedArguments {
  std::uint32_t node = 0, baud = 0;
  std::string format, verify;
};

template <class Request>
Request request_of(const Arguments& arguments) {
  Request request;
  request.set_axis(arguments.axis);
  request.set_confirm(arguments.confirm);
  request.set_lease_token(arguments.lease_token);
  if (!arguments.verify.empty()) set(*request.mutable_verify(), parse_duration(arguments.verify, "--verify"));
  return request;
}

template <class Response>
std::string phase_line(const std::string& axis, const Response& progress) {
  switch (progress.phase()) {
    case v1::SERIAL_PHASE_WRITTEN:
      return fmt::format("{}: saved in the drive; switch the drive off and on. {}", axis, progress.text());
    case v1::SERIAL_PHASE_WAITING:
      return fmt::format("{}: waiting. {}", axis, progress.text());
    case v1::SERIAL_PHASE_VERIFIED:
      return fmt::format("{}: found. {}", axis, progress.text());
    default:
      return fmt::format("{}: {}", axis, progress.text());
  }
}

/// Follows the change to its end; says at last what the configuration needs.
template <class Response, class Request>
void follow(Invocation& invocation, const Arguments& arguments,
            std::unique_ptr<grpc::ClientReader<Response>> (Stub::*method)(grpc::ClientContext*,
                                                                          const Request&),
            const Request& request, const std::string& yaml) {
  grpc::ClientContext context;
  const Interrupt interrupt([&context] { context.TryCancel(); });
  auto stream = invocation.client().stream(context, method, request);
  bool written = false;
  for (Response progress; stream.read(progress);) {
    written = true;
    print_line(invocation.json ? json(progress) : phase_line(arguments.axis, progress));
  }
  const auto status = stream.finish();
  if (written && !invocation.json)
    print_line(fmt::format("{}: the configuration must say so, too: {}", arguments.axis, yaml));
  if (status.ok()) return;
  if (!interrupt.requested()) throw invocation.client().failure(status, arguments.axis);
  invocation.status = ExitCode::interrupted;
  if (written) fmt::print(stderr, "axisctl: {}: what was saved in the drive stays\n", arguments.axis);
}

void readdress(Invocation& invocation, const Arguments& arguments) {
  auto request = request_of<v1::ReaddressRequest>(arguments);
  request.set_node(arguments.node);
  follow(invocation, arguments, &Stub::Readdress, request,
         fmt::format("'node: {}' under 'axes: {}:'", arguments.node, without_machine(arguments.axis)));
}

void set_serial(Invocation& invocation, const Arguments& arguments) {
  auto request = request_of<v1::SetSerialRequest>(arguments);
  if (arguments.baud > 0) request.set_baud(arguments.baud);
  request.set_format(arguments.format);
  std::string yaml;
  if (arguments.baud > 0) yaml = fmt::format("baud: {}", arguments.baud);
  if (!arguments.format.empty())
    yaml += fmt::format("{}format: {}", yaml.empty() ? "" : ", ", arguments.format);
  if (yaml.empty()) throw Failure(ExitCode::usage, "give --baud, --format or both");
  follow(invocation, arguments, &Stub::SetSerial, request,
         fmt::format("'{}' of its bus{}, and every other node of it the same", yaml,
                     arguments.format.empty() ? " ('bitrate' of a CAN network)" : ""));
}

}  // namespace

void add_serial_commands(CLI::App& drive, Invocation& invocation) {
  const auto add = [&](const char* name, const char* help, void (*action)(Invocation&, const Arguments&)) {
    auto* command = drive.add_subcommand(name, help);
    const auto arguments = std::make_shared<Arguments>();
    add_confirmed(*command, *arguments);
    command
        ->add_option(
            "--verify", arguments->verify,
            "Look for the drive so long, while somebody switches it off and on: 60s (at most 10 min)")
        ->type_name("TIME");
    command->callback([&invocation, arguments, action] { action(invocation, *arguments); });
    return std::pair(command, arguments);
  };
  const auto [address, addressed] =
      add("readdress", "Give the drive another address; it counts from the drive's next power-up", readdress);
  address->add_option("NODE", addressed->node, "The new address")->required();
  address->footer("\nExample: axisctl drive readdress feeder 7 --confirm feeder --verify 60s");

  const auto [serial, settings] =
      add("set-serial", "Give the drive another baud rate or format; it counts from its next power-up",
          set_serial);
  serial->add_option("--baud", settings->baud, "Bit/s; 'axisctl drive info' lists the drive's")
      ->type_name("N");
  serial->add_option("--format", settings->format, "8N1, 8N2, 8E1 or 8O1")->type_name("FORMAT");
  serial->footer("\nExample: axisctl drive set-serial feeder --baud 115200 --confirm feeder");
}

}  // namespace axisd::axisctl
