// halt, stop, quick-stop, release-stop. None of them asks anything of the daemon before the stop itself.
#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <cstdio>
#include <memory>

#include "api/axisctl/format.hpp"
#include "api/axisctl/invocation.hpp"
#include "api/axisctl/motion_arguments.hpp"
#include "api/axisctl/progress.hpp"
#include "api/axisctl/table.hpp"
#include "api/axisctl/terminal.hpp"
#include "axisd/v1/axis_service.grpc.pb.h"
#include "axisd/v1/system_service.grpc.pb.h"

namespace axisd::axisctl {
namespace {

using Stub = v1::AxisService::Stub;

struct StopArguments : MotionArguments {
  bool all = false, keep = false;
};

/// Either axes or --all.
void check_axes(const StopArguments& arguments) {
  if (arguments.all == arguments.axes.empty()) return;
  throw Failure(ExitCode::usage,
                arguments.all ? "name axes or use --all, not both" : "name an axis, or use --all");
}

/// Sends to every axis even if one fails: no stop may be missing because of another one's trouble.
template <class Request, class Response>
void stop_each(Invocation& invocation, const StopArguments& arguments,
               grpc::Status (Stub::*method)(grpc::ClientContext*, const Request&, Response*)) {
  std::vector<v1::Command> commands;
  ExitCode worst = ExitCode::ok;
  for (const auto& axis : arguments.axes) {
    Request request;
    request.set_axis(axis);
    if constexpr (requires { request.set_hold(true); }) request.set_hold(arguments.keep);
    if constexpr (requires { request.mutable_options(); })
      *request.mutable_options() = command_options(arguments);
    try {
      commands.push_back(invocation.client().call(method, request, axis, Lane::stop).command());
    } catch (const Failure& failure) {
      fmt::print(stderr, "axisctl: {}\n", failure.what());
      worst = failure.code();
    }
  }
  invocation.status = report(invocation, commands, arguments.wait, {.unit = {}, .start = {}});
  if (worst != ExitCode::ok) invocation.status = worst;
}

void stop_all(Invocation& invocation, bool wait) {
  v1::StopAllRequest request;
  request.set_wait_until(wait ? v1::WAIT_UNTIL_DONE : v1::WAIT_UNTIL_ACCEPTED);
  const auto call = &v1::SystemService::Stub::StopAll;
  // Confirming standstill takes as long as the slowest axis decelerates.
  const auto response =
      wait ? invocation.client().call_within(std::chrono::nanoseconds(0), call, request, "", Lane::stop)
           : invocation.client().call(call, request, "", Lane::stop);
  if (invocation.json) print_line(json(response));
  for (const auto& result : response.results()) {
    const bool failed = result.has_error() || outcome(result.command()) != ExitCode::ok;
    if (failed) invocation.status = ExitCode::ended_otherwise;
    if (invocation.json) continue;
    print_line(result.has_error()
                   ? coloured(fmt::format("{}: {}", result.axis(), describe(result.error(), result.axis())),
                              Colour::red, use_colour())
                   : command_line(result.command(), ""));
  }
  if (!invocation.json) print_line("all motion is refused until 'axisctl release-stop --all'");
}

template <class Request, class Response>
CLI::App* add(CLI::App& app, Invocation& invocation, const std::shared_ptr<StopArguments>& arguments,
              const std::string& name, const std::string& help,
              grpc::Status (Stub::*method)(grpc::ClientContext*, const Request&, Response*)) {
  auto* command = app.add_subcommand(name, help);
  add_several_axes(*command, *arguments);
  if constexpr (requires(Request request) { request.mutable_options(); }) add_wait(*command, *arguments);
  if constexpr (requires(Request request) { request.set_hold(true); })
    command->add_flag("--hold", arguments->keep, "Stay in Stopping until release-stop");
  command->callback([&invocation, arguments, method] {
    check_axes(*arguments);
    stop_each(invocation, *arguments, method);
  });
  return command;
}

void release_all(Invocation& invocation) {
  const auto response = invocation.client().call(&v1::SystemService::Stub::ReleaseStopAll,
                                                 v1::ReleaseStopAllRequest(), std::string_view());
  print_line(invocation.json ? json(response) : "released; every axis needs a new command to move");
}

}  // namespace

void add_stop_commands(CLI::App& app, Invocation& invocation) {
  const auto fresh = [] { return std::make_shared<StopArguments>(); };
  add(app, invocation, fresh(), "halt", "Decelerate; a new move may take over", &Stub::Halt);

  const auto stopping = fresh();
  auto* stop =
      add(app, invocation, stopping, "stop",
          "Decelerate; nothing takes over before standstill. An operational stop, without safety rating",
          &Stub::Stop);
  stop->add_flag("--all", stopping->all, "Stop every axis and refuse all motion until release-stop --all");
  stop->callback([&invocation, stopping] {
    check_axes(*stopping);
    if (stopping->all) return stop_all(invocation, stopping->wait);
    stop_each(invocation, *stopping, &Stub::Stop);
  });

  add(app, invocation, fresh(), "quick-stop",
      "Stop at once, without deceleration; open loop: costs position trust", &Stub::QuickStop);

  const auto releasing = fresh();
  auto* release = add(app, invocation, releasing, "release-stop", "End a held stop", &Stub::ReleaseStop);
  release->add_flag("--all", releasing->all, "Release what stop --all holds");
  release->callback([&invocation, releasing] {
    check_axes(*releasing);
    if (releasing->all) return release_all(invocation);
    stop_each(invocation, *releasing, &Stub::ReleaseStop);
  });
}

}  // namespace axisd::axisctl
