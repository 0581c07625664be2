// drive segments: the drive's own table of positions and velocities.
#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <fstream>
#include <iterator>
#include <memory>

#include "api/axisctl/drive_commands.hpp"
#include "api/axisctl/format.hpp"
#include "api/axisctl/lease_option.hpp"
#include "api/axisctl/segment_text.hpp"
#include "api/axisctl/terminal.hpp"
#include "axisd/v1/drive_service.grpc.pb.h"

namespace axisd::axisctl {
namespace {

using Stub = v1::DriveService::Stub;

struct Arguments {
  std::string axis, file;
  std::vector<std::string> positions, velocities;
  std::uint64_t lease_token = 0;
  bool absolute = false, clear = false;

  [[nodiscard]] bool listed() const { return absolute || !positions.empty() || !velocities.empty(); }
};

std::string contents_of(const std::string& path) {
  std::ifstream file(path, std::ios::binary);
  std::string text{std::istreambuf_iterator<char>(file), {}};
  if (!file) throw Failure(ExitCode::usage, fmt::format("--set: cannot read '{}'", path));
  return text;
}

v1::SegmentTable table_of(const Arguments& arguments, std::string_view unit) {
  if (!arguments.file.empty()) return parse_segment_json(contents_of(arguments.file), arguments.file);
  v1::SegmentTable table;
  table.set_absolute(arguments.absolute);
  for (const auto& text : arguments.positions) *table.add_positions() = parse_position_segment(text, unit);
  for (const auto& text : arguments.velocities) *table.add_velocities() = parse_velocity_segment(text, unit);
  return table;
}

void show(const Invocation& invocation, const v1::SegmentTable& table, std::string_view unit) {
  if (invocation.json) return print_line(json(table));
  if (table.positions().empty() && table.velocities().empty()) return print_line("no segments");
  segment_table(table, unit).print(use_colour());
}

void segments(Invocation& invocation, const Arguments& arguments) {
  if (int{arguments.clear} + int{!arguments.file.empty()} + int{arguments.listed()} > 1)
    throw Failure(ExitCode::usage, "give one of --set, --clear, or segments with --position and --velocity");
  const auto unit = invocation.state(arguments.axis).unit();
  if (!arguments.clear && arguments.file.empty() && !arguments.listed()) {
    v1::ReadSegmentsRequest request;
    request.set_axis(arguments.axis);
    return show(invocation, invocation.client().call(&Stub::ReadSegments, request, arguments.axis).segments(),
                unit);
  }
  v1::WriteSegmentsRequest request;
  request.set_axis(arguments.axis);
  request.set_lease_token(arguments.lease_token);
  *request.mutable_segments() = table_of(arguments, unit);
  show(invocation, invocation.client().call(&Stub::WriteSegments, request, arguments.axis).segments(), unit);
}

}  // namespace

void add_segment_command(CLI::App& drive, Invocation& invocation) {
  auto* command = drive.add_subcommand(
      "segments", "Show the drive's table of positions and velocities, or replace it as a whole");
  const auto arguments = std::make_shared<Arguments>();
  command->add_option("AXIS", arguments->axis, "Name of the axis")->required();
  // One word each time, or the option would swallow the next one's words.
  command->add_option("--position", arguments->positions, "Distance or position to go to; may be repeated")
      ->type_name("NUMBER:TARGET:VELOCITY[:TIME]")
      ->allow_extra_args(false);
  command->add_option("--velocity", arguments->velocities, "Multi-speed; may be repeated")
      ->type_name("NUMBER:VELOCITY[:TIME]")
      ->allow_extra_args(false);
  command->add_flag("--absolute", arguments->absolute, "Targets are positions, not distances");
  command->add_option("--set", arguments->file, "The table from a file, as --json prints it")
      ->type_name("FILE");
  command->add_flag("--clear", arguments->clear, "Empty the table");
  add_lease(*command, arguments->lease_token);
  command->footer(R"(
Examples:
  axisctl drive segments feeder
  axisctl drive segments feeder --position 1:50mm:20mm/s:100ms --position 2:-50mm:20mm/s --velocity 1:5mm/s
  axisctl --json drive segments feeder > table.json; axisctl drive segments feeder --set table.json)");
  command->callback([&invocation, arguments] { segments(invocation, *arguments); });
}

}  // namespace axisd::axisctl
