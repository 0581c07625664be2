// commission: an axis is checked with the operator, and the record kept.
#include <fmt/format.h>
#include <unistd.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <cstdlib>
#include <memory>

#include "api/axisctl/commission/procedure.hpp"
#include "api/axisctl/commission/record.hpp"
#include "api/axisctl/duration.hpp"
#include "api/axisctl/format.hpp"
#include "api/axisctl/interrupt.hpp"
#include "api/axisctl/invocation.hpp"
#include "api/axisctl/machine_names.hpp"
#include "api/axisctl/quantity.hpp"
#include "api/axisctl/terminal.hpp"

namespace axisd::axisctl {
namespace {

using commission::AxisAccess;
using commission::Procedure;
using commission::Record;
using commission::RecordFile;

constexpr const char* explanation_and_examples = R"(
Needs a terminal and somebody at the machine. In order: what is talked to; each switch actuated by hand, without power;
power on; a short move in each direction, the first at a tenth of the highest velocity and timed, and with that whether
the drive starts in one frame, if drive.start_in_one_frame is true; each limit switch ends a motion; a stop; homing;
soft limits; power off. Nothing moves before "yes" to that very move, which says how far and how fast; Enter stops it,
and so does Ctrl-C, at any time. Nothing faster than the first move is done before its time was seen to be that which
was told. What is skipped is asked for a reason. A step that failed may be tried again.

The axis is leased meanwhile, so that nobody else moves it. The record is JSON, and written after each step.
Status 0: every step passed or does not apply; 1: a step failed, was skipped or not done; 130: Ctrl-C.

Examples:
  axisctl commission feeder
  axisctl commission feeder --velocity 2mm/s --distance 5mm --record feeder.json)";

struct Arguments {
  std::string axis, velocity, distance, record, person;
  std::string patience = "1min";
};

std::string account() {
  const char* user = std::getenv("USER");
  return user == nullptr ? fmt::format("user {}", ::getuid()) : user;
}

commission::Wishes wishes_of(const Arguments& arguments, const std::string& unit) {
  commission::Wishes wishes;
  if (!arguments.velocity.empty())
    wishes.velocity = parse_value(arguments.velocity, unit + "/s", "--velocity");
  if (!arguments.distance.empty()) wishes.distance = parse_value(arguments.distance, unit, "--distance");
  wishes.patience =
      std::chrono::ceil<std::chrono::milliseconds>(parse_duration(arguments.patience, "--patience"));
  return wishes;
}

/// Leaves nothing behind that moves or is held: a stop that is confirmed, and the lease given back. The power
/// stage stays as it is, because a load may hang on it.
std::string come_to_rest(AxisAccess& axis) {
  if (!axis.ours()) return "nothing was commanded";
  try {
    const auto stop = axis.stop(false);
    axis.end_hold();
    const auto state = axis.state();
    axis.release_lease();
    return fmt::format(
        "{}, power stage {}",
        stop.state() == v1::COMMAND_STATE_DONE ? "standstill is confirmed" : "standstill is NOT confirmed",
        state.enabled() ? fmt::format("still on (axisctl disable {})", axis.name()) : "off");
  } catch (const Failure& failure) {
    axis.release_lease();
    return fmt::format("it could NOT be stopped: {}", failure.what());
  }
}

/// Of a line that names the axis anyhow.
std::string without_lead(std::string text, const std::string& axis) {
  if (const auto lead = axis + ": "; text.starts_with(lead)) text.erase(0, lead.size());
  return text;
}

/// Every step, as far as it comes. The record says how it ended.
void carry_out(Invocation& invocation, const Arguments& arguments, Record& record, const RecordFile& file,
               int output) {
  AxisAccess axis(invocation, arguments.axis);
  const Interrupt interrupt([&] { axis.stop_at_once(); });
  commission::TerminalOperator person(interrupt, output);
  const auto wishes = wishes_of(arguments, record.unit());
  try {
    Procedure(axis, person, record, wishes, [&] { file.write(record); }).run();
    axis.release_lease();
  } catch (const commission::Ended& end) {
    record.set_ended_early(end.what());
    if (end.by_signal()) invocation.status = ExitCode::interrupted;
  } catch (const Failure& failure) {
    record.set_ended_early(interrupt.requested() ? "interrupted"
                                                 : without_lead(failure.what(), arguments.axis));
    invocation.status = interrupt.requested() ? ExitCode::interrupted : failure.code();
  }
  if (record.ended_early().empty()) return;
  record.set_ended_early(fmt::format("{}; {}", record.ended_early(), come_to_rest(axis)));
}

void commission_axis(Invocation& invocation, const Arguments& arguments) {
  const auto state = invocation.state(arguments.axis);
  AxisAccess axis(invocation, arguments.axis);
  Record record;
  record.set_machine(axis.info().machine());
  record.set_axis(arguments.axis);
  record.set_unit(state.unit());
  record.set_operator_(arguments.person.empty() ? account() : arguments.person);
  record.set_axisctl_version(AXISD_VERSION);
  *record.mutable_began_at() = now();
  (void)wishes_of(arguments, state.unit());  // before there is a file
  const RecordFile file(arguments.record.empty()
                            ? commission::default_file(record.machine(),
                                                       std::string(without_machine(arguments.axis)),
                                                       record.began_at())
                            : arguments.record);
  carry_out(invocation, arguments, record, file, invocation.json ? STDERR_FILENO : STDOUT_FILENO);
  *record.mutable_ended_at() = now();
  commission::conclude(record);
  file.write(record);
  if (invocation.json) {
    print_line(commission::record_text(record, true));
  } else {
    print("\n");
    commission::record_table(record).print(use_colour());
    print_line(fmt::format("\nRecord: {}", file.path()));
  }
  if (record.verdict() == commission::VERDICT_PASSED) return;
  const auto code = invocation.status == ExitCode::ok ? ExitCode::ended_otherwise : invocation.status;
  throw Failure(code, fmt::format("{}: {}", arguments.axis, record.summary()));
}

}  // namespace

void add_commission_command(CLI::App& app, Invocation& invocation) {
  auto* command = app.add_subcommand(
      "commission",
      "Check an axis with somebody at the machine: switches, directions, limits, stop; keep a record");
  const auto arguments = std::make_shared<Arguments>();
  command->add_option("AXIS", arguments->axis, "Name of the axis")->required();
  command
      ->add_option(
          "--velocity", arguments->velocity,
          "Of all moves but homing: 5mm/s (default: a twentieth of the highest; the first: a tenth at most)")
      ->type_name("VALUE");
  command
      ->add_option(
          "--distance", arguments->distance,
          "Of the jogs: 10mm (default: two seconds at that velocity, at most a twentieth of the range)")
      ->type_name("VALUE");
  command->add_option("--patience", arguments->patience, "How long to wait for a hand at a switch")
      ->type_name("TIME")
      ->capture_default_str();
  command
      ->add_option(
          "--record", arguments->record,
          "The record; a file that exists is not replaced (default: commission-MACHINE-AXIS-TIME.json)")
      ->type_name("FILE");
  command->add_option("--operator", arguments->person, "Who commissions it (default: the account's name)")
      ->type_name("NAME");
  command->footer(explanation_and_examples);
  command->callback([&invocation, arguments] { commission_axis(invocation, *arguments); });
}

}  // namespace axisd::axisctl
