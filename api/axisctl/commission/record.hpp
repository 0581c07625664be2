// The record of a commissioning: its verdict, its table, its file.
#pragma once

#include <google/protobuf/timestamp.pb.h>

#include <string>
#include <vector>

#include "api/axisctl/commission/record.pb.h"
#include "api/axisctl/table.hpp"

namespace axisd::axisctl::commission {

/// "passed", "not applicable".
std::string verdict_text(Verdict verdict);

void add_figure(Step& step, const std::string& name, double value, const std::string& unit);

/// Sets verdict and summary: passed if every step passed or does not apply. Pure.
void conclude(Record& record);

/// A line per step: verdict, figures, reason. Pure.
Table record_table(const Record& record);

/// commission-MACHINE-AXIS-20260102T030405Z.json. Pure.
std::string default_file(const std::string& machine, const std::string& axis,
                         const google::protobuf::Timestamp& began_at);

/// JSON with the names of the message, for people or in one line. What is not set is left out. Pure.
std::string record_text(const Record& record, bool one_line);

/// The file that the record is kept in. It is whole at any time: a write replaces it, or leaves it as it was.
class RecordFile {
 public:
  /// Throws Failure (usage) if it exists already, or cannot be written.
  explicit RecordFile(std::string path);
  /// Throws Failure if it cannot be written.
  void write(const Record& record) const;
  [[nodiscard]] const std::string& path() const { return path_; }

 private:
  std::string path_;
};

}  // namespace axisd::axisctl::commission
