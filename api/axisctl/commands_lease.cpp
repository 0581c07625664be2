// lease acquire|renew|release|list|hold: who may command which axis.
#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <chrono>
#include <exception>
#include <memory>

#include "api/axisctl/child_process.hpp"
#include "api/axisctl/duration.hpp"
#include "api/axisctl/format.hpp"
#include "api/axisctl/invocation.hpp"
#include "api/axisctl/machine_names.hpp"
#include "api/axisctl/quantity.hpp"
#include "api/axisctl/table.hpp"
#include "api/axisctl/terminal.hpp"
#include "axisd/v1/lease_service.grpc.pb.h"

namespace axisd::axisctl {
namespace {

using std::chrono::milliseconds;
using Stub = v1::LeaseService::Stub;

constexpr const char* examples = R"(
Examples:
  axisctl lease hold feeder,turntable -- ./index.sh     renewed while the program runs, then released
  export AXISD_LEASE=$(axisctl lease acquire feeder --ttl 30s --label 'panel 2')
  axisctl move feeder 120mm --wait && axisctl lease release "$AXISD_LEASE"
  axisctl lease acquire feeder --take                   from whoever has it; the events say so)";

struct Arguments {
  std::vector<std::string> axes, command;
  std::string list;  ///< of axes, in one word
  std::string ttl, label;
  bool take = false;
};

std::string holder_of(const v1::Lease& lease) {
  return lease.label().empty() ? lease.client() : fmt::format("{} ({})", lease.client(), lease.label());
}

v1::AcquireLeaseResponse acquire(Invocation& invocation, const Arguments& arguments) {
  v1::AcquireLeaseRequest request;
  for (const auto& axis : arguments.axes) request.add_axes(axis);
  if (!arguments.ttl.empty()) set(*request.mutable_ttl(), parse_duration(arguments.ttl, "--ttl"));
  request.set_label(arguments.label);
  request.set_take(arguments.take);
  request.set_request_id(random_uuid());
  auto response = invocation.client().call(&Stub::AcquireLease, request, std::string_view());
  for (const auto& lost : response.taken())
    fmt::print(stderr, "taken from {}: {}\n", holder_of(lost), fmt::join(lost.axes(), ", "));
  return response;
}

/// As commands take it. In a cell the machine is in front, as it is of the axes: each machine counts its own.
std::string token_text(const v1::AcquireLeaseResponse& response) {
  const auto axis = response.lease().axes().empty() ? std::string() : response.lease().axes(0);
  const auto machine = machine_in(axis);
  return fmt::format("{}{}{}", machine, machine.empty() ? "" : "/", response.lease_token());
}

v1::RenewLeaseResponse renew(Invocation& invocation, std::uint64_t token, std::chrono::nanoseconds limit) {
  v1::RenewLeaseRequest request;
  request.set_lease_token(token);
  return invocation.client().call_within(limit, &Stub::RenewLease, request, std::string_view(), Lane::stop);
}

v1::ReleaseLeaseResponse release(Invocation& invocation, std::uint64_t token) {
  v1::ReleaseLeaseRequest request;
  request.set_lease_token(token);
  return invocation.client().call(&Stub::ReleaseLease, request, std::string_view());
}

std::chrono::nanoseconds ttl_of(const v1::Lease& lease) {
  return std::chrono::seconds(lease.ttl().seconds()) + std::chrono::nanoseconds(lease.ttl().nanos());
}

void list(Invocation& invocation) {
  const auto response =
      invocation.client().call(&Stub::ListLeases, v1::ListLeasesRequest(), std::string_view());
  if (invocation.json) return print_line(json(response));
  if (response.leases().empty()) return print_line("no leases");
  Table table({"AXES", "HOLDER", "REMAINING", "TTL"}, {2, 3});
  for (const auto& lease : response.leases())
    table.add({fmt::format("{}", fmt::join(lease.axes(), ", ")), holder_of(lease),
               duration_text(seconds(lease.remaining())), duration_text(seconds(lease.ttl()))});
  table.print(use_colour());
}

/// Renews until the program has ended or the lease is lost, which is told and does not end the program: what
/// it commands from then on is refused. Its exit status.
int hold_while(Invocation& invocation, ChildProcess& child, std::uint64_t token, std::chrono::nanoseconds ttl,
               bool& lost) {
  // Three renewals per time to live: one may be late by as much again; where the call fails it is repeated
  // soon. A signal brings one forward, no more.
  const auto pause = std::max(std::chrono::floor<milliseconds>(ttl / 3), milliseconds(1));
  const auto short_pause = std::max(pause / 10, milliseconds(1));
  bool told = false;
  for (auto wait = pause;;) {
    if (const auto status = child.wait_for(wait)) return *status;
    wait = pause;
    if (lost) continue;
    try {
      renew(invocation, token, 2 * ttl / 3);
      told = false;
    } catch (const Failure& failure) {
      lost = failure.code() == ExitCode::refused;
      wait = short_pause;
      if (lost || !told)
        complain(failure.saying(fmt::format("lease {}: {}", lost ? "lost" : "not renewed", failure.what())),
                 invocation.json);
      told = true;
    }
  }
}

void hold(Invocation& invocation, const Arguments& arguments) {
  ChildProcess child;  // before the client, whose threads shall not take its signals
  const auto response = acquire(invocation, arguments);
  const auto token = response.lease_token();
  bool lost = false;
  int status = 0;
  try {
    const auto& connection = invocation.connection;
    child.start(arguments.command, {{"AXISD_LEASE", token_text(response)},
                                    {"AXISD_SERVER", connection.server},
                                    {"AXISD_STOP_SERVER", connection.stop_server},
                                    {"AXISD_CELL", connection.cell},
                                    {"AXISD_MACHINE", connection.machine},
                                    {"AXISD_TLS_CA", connection.tls_ca},
                                    {"AXISD_TLS_CERT", connection.tls_certificate},
                                    {"AXISD_TLS_KEY", connection.tls_key},
                                    {"AXISD_AS", connection.speaks_for}});
    status = hold_while(invocation, child, token, ttl_of(response.lease()), lost);
  } catch (...) {
    // Should the release fail, too, the lease ends by itself; what came first is to be told.
    const auto first = std::current_exception();
    try {
      release(invocation, token);
    } catch (const Failure&) {
      std::rethrow_exception(first);
    }
    throw;
  }
  if (!lost) release(invocation, token);
  invocation.status = lost && status == 0 ? ExitCode::refused : static_cast<ExitCode>(status);
}

void add_acquiring(CLI::App& command, Arguments& arguments) {
  command
      .add_option("--ttl", arguments.ttl, "Ends so long after the last renewal: 2s (default: the daemon's)")
      ->type_name("TIME");
  command.add_option("--label", arguments.label, "What others read about the holder")->type_name("TEXT");
  command.add_flag("--take", arguments.take,
                   "Also from others, whose leases end; their axes stop as configured");
}

void add_by_token(CLI::App& group, Invocation& invocation, const char* name, const char* help,
                  void (*action)(Invocation&, std::uint64_t)) {
  auto* command = group.add_subcommand(name, help);
  const auto token = std::make_shared<std::uint64_t>(0);
  command->add_option("TOKEN", *token, "As acquire printed it")
      ->envname("AXISD_LEASE")
      ->required()
      ->check(CLI::Validator(
          [](const std::string& word) {
            const auto number = without_machine(word);
            const bool digits = !number.empty() && number.find_first_not_of("0123456789") == number.npos;
            return digits ? std::string() : fmt::format("'{}' is no token; a token is a number", word);
          },
          ""));
  command->callback([&invocation, token, action] { action(invocation, *token); });
}

void renew_once(Invocation& invocation, std::uint64_t token) {
  const auto response = renew(invocation, token, std::chrono::seconds(10));
  print_line(invocation.json
                 ? json(response)
                 : fmt::format("{}: leased for another {}", fmt::join(response.lease().axes(), ", "),
                               duration_text(seconds(response.lease().remaining()))));
}

void release_once(Invocation& invocation, std::uint64_t token) {
  const auto response = release(invocation, token);
  print_line(invocation.json ? json(response) : "released");
}

}  // namespace

void add_lease_commands(CLI::App& app, Invocation& invocation) {
  auto* group =
      app.add_subcommand("lease", "The exclusive right to command axes: acquire, renew, release, hold");
  group->require_subcommand(1);
  group->footer(examples);

  const auto acquiring = std::make_shared<Arguments>();
  auto* acquire_command = group->add_subcommand(
      "acquire", "Lease axes, all or none, and print the token; renew it before its time is over");
  acquire_command
      ->add_option("AXIS", acquiring->axes,
                   "Names of one or more axes, or of groups, with spaces or commas between")
      ->delimiter(',')
      ->required();
  add_acquiring(*acquire_command, *acquiring);
  acquire_command->callback([&invocation, acquiring] {
    const auto response = acquire(invocation, *acquiring);
    print_line(invocation.json ? json(response) : token_text(response));
  });

  add_by_token(*group, invocation, "renew", "Its time begins anew", renew_once);
  add_by_token(*group, invocation, "release", "End a lease; axes that move stop as configured", release_once);
  group->add_subcommand("list", "Who leases what")->callback([&invocation] { list(invocation); });

  const auto holding = std::make_shared<Arguments>();
  auto* hold_command = group->add_subcommand(
      "hold",
      "Lease axes while a program runs, with its token in AXISD_LEASE; status: the program's, or 4 if the "
      "lease was lost");
  // One word: a list would swallow the program's words.
  hold_command->add_option("AXIS", holding->list, "Names of axes, or of groups, with commas between")
      ->required();
  hold_command->add_option("COMMAND", holding->command, "The program and its arguments, after --")
      ->required();
  add_acquiring(*hold_command, *holding);
  hold_command->callback([&invocation, holding] {
    holding->axes = CLI::detail::split(holding->list, ',');
    hold(invocation, *holding);
  });
}

}  // namespace axisd::axisctl
