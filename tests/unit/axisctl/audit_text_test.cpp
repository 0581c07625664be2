#include "api/axisctl/audit_text.hpp"

#include <gmock/gmock.h>

#include <string>

#include "api/axisctl/axis_report.hpp"
#include "api/axisctl/error.hpp"

namespace axisd::axisctl {
namespace {

using testing::Contains;
using testing::EndsWith;
using testing::HasSubstr;

v1::AuditRecord record() {
  v1::AuditRecord result;
  result.set_number(12);
  result.set_axis("feeder");
  result.set_client("hmi-1");
  result.mutable_at()->set_seconds(1'700'000'000);
  result.mutable_at()->set_nanos(123'999'999);
  return result;
}

const std::string lead = "2023-11-14T22:13:20.123Z  12  feeder  hmi-1  ";

TEST(AuditText, ARefusalWithItsCause) {
  auto refused = record();
  auto& command = *refused.mutable_refused()->mutable_command();
  command.set_axis("feeder");
  command.set_kind(v1::COMMAND_KIND_MOVE_ABSOLUTE);
  command.mutable_asked()->set_position(300);
  command.mutable_cause()->set_message("not enabled");
  EXPECT_EQ(audit_line(refused), lead + "refused: MoveAbsolute 300: not enabled");
  refused.mutable_refused()->set_left_out(3);
  EXPECT_THAT(audit_line(refused), EndsWith("(3 more before it have no record)"));
}

TEST(AuditText, ACallThatItsClientMayNotMake) {
  auto denied = record();
  denied.mutable_denied()->mutable_error()->set_message("Enable needs the role operator on feeder");
  denied.mutable_denied()->set_left_out(2);
  EXPECT_EQ(audit_line(denied),
            lead + "refused: Enable needs the role operator on feeder (2 more before it have no record)");
}

TEST(AuditText, AParameterWithWhatItWas) {
  auto written = record();
  auto& call = *written.mutable_call();
  call.set_phase(v1::AUDITED_CALL_PHASE_DONE);
  call.set_text("writes 2 parameters");
  auto& known = *call.add_parameters();
  known.set_name("filter");
  known.set_asked(12);
  known.set_before(8);
  known.set_after(12);
  auto& other = *call.add_parameters();
  other.set_address(0x0110);
  other.set_asked(-5);
  EXPECT_EQ(audit_line(written), lead + "done: writes 2 parameters: filter 8 -> 12, 0x0110 = -5");
}

TEST(AuditText, WhatItConcerns) {
  auto refused = record();
  refused.mutable_refused()->mutable_command()->set_axis("feeder");
  refused.set_group("portal");
  EXPECT_THAT(audit_line(refused), HasSubstr("  12  group portal  hmi-1  refused: "));
  auto written = record();
  written.clear_axis();
  written.set_bus("line-a");
  written.mutable_call()->set_text("writes 1 to registers from 3 of line-a node 7");
  EXPECT_THAT(audit_line(written), HasSubstr("  12  bus line-a  hmi-1  "));
  written.clear_bus();
  EXPECT_THAT(audit_line(written), HasSubstr("  12  -  hmi-1  "));
}

TEST(AuditText, TheDaemonAndWhatIsMissing) {
  auto run = record();
  run.clear_axis();
  run.clear_client();
  run.mutable_run()->set_kind(v1::DAEMON_RUN_KIND_BEGAN);
  run.mutable_run()->set_version("1.0");
  run.mutable_run()->set_start_count(7);
  EXPECT_THAT(audit_line(run), EndsWith("  12  -  -  axisd 1.0 began (start 7)"));
  run.mutable_gap()->set_left_out(9);
  EXPECT_THAT(audit_line(run), HasSubstr("9 records are missing"));
  run.set_client("hmi-1");
  EXPECT_THAT(audit_line(run), HasSubstr("hmi-1  9 more stops before have no record"));
}

TEST(AuditText, KindsByName) {
  EXPECT_EQ(parse_audit_kind("stop-hold"), v1::AUDIT_KIND_STOP_HOLD);
  EXPECT_THAT(audit_kinds(), Contains("refusal"));
  EXPECT_THROW((void)parse_audit_kind("noise"), Failure);
}

v1::AuditRecord ended(v1::CommandKind kind, v1::CommandState state = v1::COMMAND_STATE_DONE) {
  auto result = record();
  auto& command = *result.mutable_event()->mutable_command_change()->mutable_command();
  command.set_kind(kind);
  command.set_state(state);
  return result;
}

v1::AuditRecord moved(v1::CommandKind kind, double value, v1::CommandState state = v1::COMMAND_STATE_DONE) {
  auto result = ended(kind, state);
  auto& asked = *result.mutable_event()->mutable_command_change()->mutable_command()->mutable_asked();
  if (kind == v1::COMMAND_KIND_MOVE_RELATIVE)
    asked.set_distance(value);
  else
    asked.set_position(value);
  return result;
}

TEST(AuditText, WhoGaveACommandStandsInFrontAlone) {
  auto done = moved(v1::COMMAND_KIND_MOVE_ABSOLUTE, 10);
  done.mutable_event()->mutable_command_change()->mutable_command()->set_client("hmi-1");
  EXPECT_THAT(audit_line(done), testing::AllOf(HasSubstr("  hmi-1  "), testing::Not(HasSubstr("by hmi-1"))));
}

TEST(AxisReport, CountsWhatTheAuditTells) {
  AxisReport report;
  report.add(moved(v1::COMMAND_KIND_MOVE_ABSOLUTE, 10));  // from where is not known
  report.add(moved(v1::COMMAND_KIND_MOVE_ABSOLUTE, 30));
  report.add(moved(v1::COMMAND_KIND_MOVE_RELATIVE, -5));
  report.add(moved(v1::COMMAND_KIND_MOVE_ABSOLUTE, 20));
  report.add(moved(v1::COMMAND_KIND_MOVE_ABSOLUTE, 90, v1::COMMAND_STATE_ACCEPTED));  // not ended
  report.add(moved(v1::COMMAND_KIND_MOVE_ABSOLUTE, 90, v1::COMMAND_STATE_UNKNOWN));
  report.add(ended(v1::COMMAND_KIND_STOP));
  report.add(moved(v1::COMMAND_KIND_SET_POSITION, 0));
  report.add(moved(v1::COMMAND_KIND_MOVE_ABSOLUTE, 1));
  auto fault = record();
  fault.mutable_event()->mutable_axis_fault()->mutable_cause()->set_reason(v1::REASON_ALARM);
  report.add(fault);
  auto refused = record();
  refused.mutable_refused()->set_left_out(2);
  report.add(refused);
  for (const auto registers : {3, 1}) {
    auto saved = record();
    saved.mutable_event()->mutable_eeprom_written()->set_registers(registers);
    report.add(saved);
  }
  EXPECT_THAT(report.lines("mm"),
              testing::ElementsAre(
                  "motions:          6: 5 done, 1 unknown",
                  "distance:         31 mm from start to target, without 2 motions of which it is not known",
                  "stops:            1", "faults:           1: 1 alarm", "refused:          3",
                  "unknown outcomes: 1", "EEPROM writes:    4 registers"));
  EXPECT_EQ(report.values().fields().at("distance").number_value(), 31);
}

TEST(AxisReport, MeasuresTheWayThatWasGranted) {
  AxisReport report;
  report.add(ended(v1::COMMAND_KIND_HOME));
  for (const auto& [position, way] : {std::pair{100.0, 100.0}, {350.0, -110.0}, {10.0, 20.0}}) {
    auto move = moved(v1::COMMAND_KIND_MOVE_ABSOLUTE, position);
    move.mutable_event()->mutable_command_change()->mutable_command()->mutable_granted()->set_distance(way);
    report.add(move);
  }
  EXPECT_EQ(report.values().fields().at("distance").number_value(), 230);
  EXPECT_EQ(report.values().fields().at("distance_not_known").number_value(), 1) << "that of homing";
}

}  // namespace
}  // namespace axisd::axisctl
