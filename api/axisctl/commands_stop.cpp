// halt, stop, quick-stop, release-stop. None of them asks anything of the daemon before the stop itself.
#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <cstdio>
#include <memory>
#include <optional>
#include <utility>
#include <vector>

#include "api/axisctl/across.hpp"
#include "api/axisctl/cell_commands.hpp"
#include "api/axisctl/format.hpp"
#include "api/axisctl/hold_view.hpp"
#include "api/axisctl/invocation.hpp"
#include "api/axisctl/motion_arguments.hpp"
#include "api/axisctl/progress.hpp"
#include "api/axisctl/repetition.hpp"
#include "api/axisctl/stop_results.hpp"
#include "api/axisctl/terminal.hpp"
#include "axisd/v1/axis_service.grpc.pb.h"
#include "axisd/v1/group_service.pb.h"
#include "axisd/v1/system_service.grpc.pb.h"

namespace axisd::axisctl {
namespace {

using Stub = v1::AxisService::Stub;

struct StopArguments : MotionArguments {
  bool all = false, keep = false;
  ReleaseArguments release;
};

/// Either axes or --all.
void check_axes(const StopArguments& arguments) {
  if (arguments.all == arguments.axes.empty()) return;
  throw Failure(ExitCode::usage,
                arguments.all ? "name axes or use --all, not both" : "name an axis, or use --all");
}

/// What became of the stop of one axis; neither: it has not been answered yet.
struct AxisAnswer {
  std::optional<v1::Command> command;
  std::optional<Failure> refusal;
};

/// A silent machine's failure names the axis already.
std::string with_lead(const std::string& axis, const Failure& failure) {
  const std::string text = failure.what();
  return text.starts_with(axis + ": ") ? text : fmt::format("{}: {}", axis, text);
}

/// Each axis of a machine in turn, whatever becomes of the others: no stop may be missing because of another
/// one's trouble. Those that did not reach the daemon are repeated, all together.
template <class Request, class Response>
void ask_some(const Client& client, const std::vector<Request>& requests,
              grpc::Status (Stub::*method)(grpc::ClientContext*, const Request&, Response*),
              const std::vector<std::size_t>& indices, std::vector<AxisAnswer>& answers) {
  for (Repetition repetition(client.timeout());;) {
    std::optional<Failure> lost;
    for (const auto i : indices) {
      auto& answer = answers[i];
      if (answer.command || (answer.refusal && answer.refusal->code() != ExitCode::unreachable)) continue;
      try {
        answer.command =
            client.call_within(repetition.left(), method, requests[i], requests[i].axis(), Lane::stop)
                .command();
      } catch (const Failure& failure) {
        answer.refusal = failure;
        if (failure.code() == ExitCode::unreachable) lost = failure;
      }
    }
    if (!lost) return;
    if (repetition.again(client, *lost)) continue;
    for (const auto i : indices)
      if (auto& answer = answers[i]; !answer.command && answer.refusal->code() == ExitCode::unreachable)
        answer.refusal =
            repetition.in_vain(answer.refusal->saying(with_lead(requests[i].axis(), *answer.refusal)));
    return;
  }
}

template <class Request, class Response>
std::vector<AxisAnswer> ask_each(const Client& client, const std::vector<std::string>& axes,
                                 const std::vector<Request>& requests,
                                 grpc::Status (Stub::*method)(grpc::ClientContext*, const Request&,
                                                              Response*)) {
  std::vector<AxisAnswer> answers(requests.size());
  for_each_machine(axes, [&](const std::vector<std::size_t>& indices) {
    ask_some(client, requests, method, indices, answers);
  });
  return answers;
}

template <class Request, class Response>
void stop_each(Invocation& invocation, const StopArguments& arguments,
               grpc::Status (Stub::*method)(grpc::ClientContext*, const Request&, Response*)) {
  std::vector<Request> requests;
  for (const auto& axis : arguments.axes) {
    auto& request = requests.emplace_back();
    request.set_axis(axis);
    *request.mutable_options() = command_options(arguments);
    if constexpr (requires { request.set_hold(true); }) {
      request.set_hold(arguments.keep);
      // Without a name of its own it is released without one, and its repetitions are one hold.
      if (arguments.keep) request.mutable_options()->set_request_id(arguments.request_id);
    }
  }
  std::vector<v1::Command> commands;
  ExitCode worst = ExitCode::ok;
  for (auto& answer : ask_each(invocation.client(), arguments.axes, requests, method)) {
    if (answer.command) {
      commands.push_back(*std::move(answer.command));
    } else {
      complain(*answer.refusal, invocation.json);
      worst = answer.refusal->code();
    }
  }
  invocation.status = report(invocation, commands, arguments.wait,
                             {.unit = {}, .start = {}, .several = arguments.axes.size() > 1});
  if (arguments.keep && !invocation.json)
    for (const auto& command : commands)
      print_line(fmt::format("{}: held until 'axisctl release-stop {}{}'", command.axis(), command.axis(),
                             arguments.request_id.empty() ? "" : " --request-id " + arguments.request_id));
  if (worst != ExitCode::ok) invocation.status = worst;
}

void stop_all(Invocation& invocation, bool wait) {
  if (invocation.of_whole_cell()) return stop_cell(invocation, wait);
  v1::StopAllRequest request;
  request.set_wait_until(wait ? v1::WAIT_UNTIL_DONE : v1::WAIT_UNTIL_ACCEPTED);
  const auto call = &v1::SystemService::Stub::StopAll;
  // Confirming standstill takes as long as the slowest axis decelerates.
  const auto response =
      repeat_stop(invocation.client(), call, request, "", invocation.client().timeout(), wait);
  if (invocation.json) print_line(json(response));
  print_results(invocation, response, Results::all);
  if (!invocation.json) print_line("all motion is refused until 'axisctl release-stop --all'");
  complain_of_latch(invocation, response);
}

template <class Request, class Response>
CLI::App* add(CLI::App& app, Invocation& invocation, const std::shared_ptr<StopArguments>& arguments,
              const std::string& name, const std::string& help,
              grpc::Status (Stub::*method)(grpc::ClientContext*, const Request&, Response*)) {
  auto* command = app.add_subcommand(name, help);
  add_several_axes(*command, *arguments);
  add_wait(*command, *arguments);
  if constexpr (requires(Request request) { request.set_hold(true); }) {
    command->add_flag("--hold", arguments->keep,
                      "Stay in Stopping until release-stop, also over a restart of the daemon");
    add_hold_id(*command, arguments->request_id);
  }
  command->get_option("AXIS")->required();  // of those with --all it is not: they check it
  command->callback([&invocation, arguments, method] { stop_each(invocation, *arguments, method); });
  return command;
}

void release_all(Invocation& invocation) {
  if (invocation.of_whole_cell()) return release_cell(invocation);
  const auto response = invocation.client().call(&v1::SystemService::Stub::ReleaseStopAll,
                                                 v1::ReleaseStopAllRequest(), std::string_view());
  print_line(invocation.json ? json(response) : "released; every axis needs a new command to move");
}

/// Each axis once, whatever becomes of the others. Never repeated: it may be somebody else's stop by then. As
/// JSON what became of several is one object, that of group release-stop.
void release_each(Invocation& invocation, const StopArguments& arguments) {
  const bool as_list = invocation.json && arguments.axes.size() > 1;
  v1::GroupReleaseStopResponse released;
  for (const auto& axis : arguments.axes) {
    v1::ReleaseStopRequest request;
    request.set_axis(axis);
    arguments.release.fill(request);
    try {
      const auto response = invocation.client().call(&Stub::ReleaseStop, request, axis, Lane::stop);
      auto& result = *released.add_results();
      result.set_name(axis);
      *result.mutable_holds() = response.holds();
      if (!as_list) print_line(invocation.json ? json(response) : released_line(axis, response.holds()));
    } catch (const Failure& failure) {
      complain(failure, invocation.json);
      invocation.status = failure.code();
    }
  }
  if (as_list) print_line(json(released));
}

void add_release(CLI::App& app, Invocation& invocation) {
  const auto arguments = std::make_shared<StopArguments>();
  auto* command = app.add_subcommand(
      "release-stop", "End a held stop: by default that of 'axisctl stop --hold' without --request-id");
  add_several_axes(*command, *arguments);
  arguments->release.add_to(*command);
  command->add_flag("--all", arguments->all, "Release what stop --all holds");
  command->callback([&invocation, arguments] {
    check_axes(*arguments);
    if (arguments->all) return release_all(invocation);
    release_each(invocation, *arguments);
  });
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
  stop->get_option("AXIS")->required(false);
  stop->add_flag(
      "--all", stopping->all,
      "Stop every axis, with --cell of every machine, and refuse all motion until release-stop --all");
  stop->callback([&invocation, stopping] {
    check_axes(*stopping);
    if (stopping->all) return stop_all(invocation, stopping->wait);
    stop_each(invocation, *stopping, &Stub::Stop);
  });

  add(app, invocation, fresh(), "quick-stop",
      "Stop as hard as the drive does, mostly without deceleration; open loop: costs position trust",
      &Stub::QuickStop);

  add_release(app, invocation);
}

}  // namespace axisd::axisctl
