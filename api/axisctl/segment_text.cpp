#include "api/axisctl/segment_text.hpp"

#include <fmt/format.h>
#include <google/protobuf/util/json_util.h>

#include <map>
#include <vector>

#include "api/axisctl/duration.hpp"
#include "api/axisctl/error.hpp"
#include "api/axisctl/format.hpp"
#include "api/axisctl/quantity.hpp"

namespace axisd::axisctl {
namespace {

/// The parts between colons; the last one, a time, may be missing.
std::vector<std::string_view> parts_of(std::string_view text, std::size_t most, std::string_view form) {
  std::vector<std::string_view> parts;
  for (std::string_view rest = text;;) {
    const auto colon = rest.find(':');
    parts.push_back(rest.substr(0, colon));
    if (colon == std::string_view::npos) break;
    rest.remove_prefix(colon + 1);
  }
  if (parts.size() != most && parts.size() + 1 != most)
    throw Failure(ExitCode::usage, fmt::format("'{}' is not {}", text, form));
  return parts;
}

template <class Row>
void read_number_and_time(const std::vector<std::string_view>& parts, std::size_t time, Row& row) {
  const auto number = parse_integer(parts[0], "number");
  if (number < 1 || number > 16)
    throw Failure(ExitCode::usage, fmt::format("number: {} is no segment; permitted: 1 to 16", number));
  row.set_number(static_cast<std::uint32_t>(number));
  if (parts.size() > time) set(*row.mutable_acceleration_time(), parse_duration(parts[time], "time"));
}

template <class Row>
std::string time_of(const Row& row) {
  return row.has_acceleration_time() ? duration_text(seconds(row.acceleration_time())) : "";
}

}  // namespace

v1::PositionSegment parse_position_segment(std::string_view text, std::string_view unit) {
  const auto parts = parts_of(text, 4, "NUMBER:TARGET:VELOCITY[:TIME]");
  if (parts.size() < 3) throw Failure(ExitCode::usage, fmt::format("'{}' lacks its velocity", text));
  v1::PositionSegment row;
  read_number_and_time(parts, 3, row);
  row.set_target(parse_value(parts[1], unit, "target"));
  row.set_velocity(parse_value(parts[2], fmt::format("{}/s", unit), "velocity"));
  return row;
}

v1::VelocitySegment parse_velocity_segment(std::string_view text, std::string_view unit) {
  const auto parts = parts_of(text, 3, "NUMBER:VELOCITY[:TIME]");
  v1::VelocitySegment row;
  read_number_and_time(parts, 2, row);
  row.set_velocity(parse_value(parts[1], fmt::format("{}/s", unit), "velocity"));
  return row;
}

v1::SegmentTable parse_segment_json(const std::string& text, std::string_view what) {
  v1::SegmentTable table;
  const auto status = google::protobuf::util::JsonStringToMessage(text, &table);
  if (status.ok()) return table;
  // Its further lines show the place with a mark below; an error here is one line.
  const std::string message(status.message().data(), status.message().size());
  throw Failure(ExitCode::usage,
                fmt::format("{}: not a segment table in JSON: {}; 'axisctl --json drive segments "
                            "AXIS' prints one",
                            what, message.substr(0, message.find('\n'))));
}

Table segment_table(const v1::SegmentTable& segments, std::string_view unit) {
  std::map<std::uint32_t, std::pair<const v1::PositionSegment*, const v1::VelocitySegment*>> rows;
  for (const auto& row : segments.positions()) rows[row.number()].first = &row;
  for (const auto& row : segments.velocities()) rows[row.number()].second = &row;
  Table table(
      {"NUMBER", segments.absolute() ? "POSITION" : "DISTANCE", "VELOCITY", "MULTI-SPEED", "ACCELERATION"},
      {0, 1, 2, 3, 4});
  const auto speed = fmt::format("{}/s", unit);
  for (const auto& [number, row] : rows) {
    const auto& [position, velocity] = row;
    table.add({std::to_string(number), position != nullptr ? with_unit(position->target(), unit) : "",
               position != nullptr ? with_unit(position->velocity(), speed) : "",
               velocity != nullptr ? with_unit(velocity->velocity(), speed) : "",
               position != nullptr ? time_of(*position) : time_of(*velocity)});
  }
  return table;
}

}  // namespace axisd::axisctl
