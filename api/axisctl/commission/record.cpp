#include "api/axisctl/commission/record.hpp"

#include <fcntl.h>
#include <fmt/format.h>
#include <google/protobuf/util/json_util.h>
#include <google/protobuf/util/time_util.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <filesystem>
#include <system_error>

#include "api/axisctl/error.hpp"
#include "api/axisctl/format.hpp"
#include "api/program/whole_file.hpp"

namespace axisd::axisctl::commission {
namespace {

using google::protobuf::util::TimeUtil;

Colour colour_of(Verdict verdict) {
  switch (verdict) {
    case VERDICT_PASSED:
      return Colour::green;
    case VERDICT_FAILED:
      return Colour::red;
    case VERDICT_NOT_APPLICABLE:
      return Colour::dim;
    default:
      return Colour::yellow;
  }
}

std::string figures_of(const Step& step) {
  std::string text;
  for (const auto& figure : step.figures()) {
    auto name = figure.name();
    std::ranges::replace(name, '_', ' ');
    text += fmt::format(
        "{}{} {}", text.empty() ? "" : ", ", name,
        figure.unit() == "s" ? duration_text(figure.value()) : with_unit(figure.value(), figure.unit()));
  }
  return text;
}

/// Names of the steps with this verdict.
std::string steps_with(const Record& record, Verdict verdict) {
  std::string text;
  for (const auto& step : record.steps())
    if (step.verdict() == verdict) text += (text.empty() ? "" : ", ") + step.name();
  return text;
}

Failure cannot_write(const std::string& path, int error) {
  return {ExitCode::usage,
          fmt::format("--record: cannot write '{}': {}", path, std::generic_category().message(error))};
}

}  // namespace

std::string verdict_text(Verdict verdict) {
  return verdict == VERDICT_UNSPECIFIED ? "open" : lower_word(Verdict_Name(verdict), "VERDICT_");
}

void add_figure(Step& step, const std::string& name, double value, const std::string& unit) {
  auto& figure = *step.add_figures();
  figure.set_name(name);
  figure.set_value(value);
  figure.set_unit(unit);
}

void conclude(Record& record) {
  std::string summary;
  for (const auto verdict : {VERDICT_FAILED, VERDICT_SKIPPED, VERDICT_NOT_DONE, VERDICT_UNSPECIFIED})
    if (const auto names = steps_with(record, verdict); !names.empty())
      summary += fmt::format("{}{}: {}", summary.empty() ? "" : "; ",
                             verdict == VERDICT_UNSPECIFIED ? "not reached" : verdict_text(verdict), names);
  const auto any = [&](Verdict verdict) {
    return std::ranges::any_of(record.steps(), [&](const Step& step) { return step.verdict() == verdict; });
  };
  record.set_verdict(summary.empty() && record.ended_early().empty() && record.steps_size() > 0
                         ? VERDICT_PASSED
                     : any(VERDICT_FAILED)  ? VERDICT_FAILED
                     : any(VERDICT_SKIPPED) ? VERDICT_SKIPPED
                                            : VERDICT_NOT_DONE);
  if (!record.ended_early().empty())
    summary = fmt::format("{}{}{}", record.ended_early(), summary.empty() ? "" : "; ", summary);
  record.set_summary(summary.empty() ? "every step passed or does not apply" : summary);
}

Table record_table(const Record& record) {
  Table table({"STEP", "VERDICT", "RESULT"});
  for (const auto& step : record.steps()) {
    std::vector<std::string> results;
    if (!step.reason().empty()) results.push_back(step.reason());
    if (!step.remedy().empty()) results.push_back("-> " + step.remedy());
    if (auto figures = figures_of(step); !figures.empty()) results.push_back(std::move(figures));
    if (results.empty()) results.emplace_back();
    table.add({step.name(), Cell(verdict_text(step.verdict()), colour_of(step.verdict())), results.front()});
    for (std::size_t i = 1; i < results.size(); ++i) table.add({"", "", results[i]});
  }
  return table;
}

std::string default_file(const std::string& machine, const std::string& axis,
                         const google::protobuf::Timestamp& began_at) {
  auto time = TimeUtil::ToString(TimeUtil::SecondsToTimestamp(began_at.seconds()));
  std::erase_if(time, [](char c) { return c == '-' || c == ':'; });
  auto name = fmt::format("commission-{}-{}-{}.json", machine, axis, time);
  std::ranges::replace(name, '/', '_');
  return name;
}

std::string record_text(const Record& record, bool one_line) {
  google::protobuf::util::JsonPrintOptions options;
  options.add_whitespace = !one_line;
  options.preserve_proto_field_names = true;
  std::string text;
  if (const auto status = google::protobuf::util::MessageToJsonString(record, &text, options); !status.ok())
    throw Failure(ExitCode::ended_otherwise, fmt::format("the record is no JSON: {}", status.ToString()));
  return text;
}

RecordFile::RecordFile(std::string path) : path_(std::move(path)) {
  // A record is evidence: an earlier one is not replaced. Made at once, because afterwards it is too late.
  const int file = ::open(path_.c_str(), O_WRONLY | O_CREAT | O_EXCL | O_CLOEXEC, 0644);
  if (file < 0) throw cannot_write(path_, errno);
  ::close(file);
}

void RecordFile::write(const Record& record) const {
  if (const int error = program::write_whole_file(path_, record_text(record, false), 0644); error != 0)
    throw cannot_write(path_, error);
}

}  // namespace axisd::axisctl::commission
