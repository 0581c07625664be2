#include "api/axisctl/error.hpp"

#include <gmock/gmock.h>
#include <google/protobuf/struct.pb.h>
#include <google/protobuf/util/json_util.h>

namespace axisd::axisctl {
namespace {

using testing::HasSubstr;
using testing::Not;

v1::ErrorDetail soft_limit() {
  v1::ErrorDetail detail;
  detail.set_reason(v1::REASON_SOFT_LIMIT);
  detail.set_message("position 500 mm is beyond the soft limit");
  detail.set_remedy("choose a target inside");
  detail.mutable_permitted()->set_maximum(400);
  detail.mutable_permitted()->set_unit("mm");
  return detail;
}

grpc::Status status_with(const v1::ErrorDetail& detail, grpc::StatusCode code, const std::string& type) {
  v1::StatusDetails details;
  auto& packed = *details.add_details();
  packed.set_type_url(type);
  packed.set_value(detail.SerializeAsString());
  return {code, "text", details.SerializeAsString()};
}

TEST(ErrorText, DetailIsOneLineWithRangeAndRemedy) {
  EXPECT_EQ(describe(soft_limit()),
            "position 500 mm is beyond the soft limit (permitted 0 to 400 mm); choose a target inside");
  auto told = soft_limit();
  told.set_message("500 mm is not permitted");
  EXPECT_THAT(describe(told), Not(HasSubstr("(permitted")));
}

TEST(ErrorText, TheSubjectIsNamedOnce) {
  auto detail = soft_limit();
  detail.set_message("feeder: too far");
  detail.clear_permitted();
  detail.set_bus("line-a");
  EXPECT_EQ(describe(detail, "feeder"), "line-a: too far; choose a target inside");
  EXPECT_EQ(describe(detail), "line-a: feeder: too far; choose a target inside");
}

TEST(ErrorText, AddressLeads) {
  v1::ErrorDetail detail;
  detail.set_reason(v1::REASON_REFUSED);
  detail.set_bus("line-a");
  detail.set_node(3);
  detail.set_object(0x27);
  EXPECT_EQ(describe(detail), "line-a node 3 register 0x0027: refused");
  detail.set_bus("can0");
  detail.set_object(0x604100);
  EXPECT_EQ(describe(detail), "can0 node 3 object 6041h:00: refused");
  detail.clear_bus();
  detail.clear_node();
  EXPECT_EQ(describe(detail), "object 6041h:00: refused");
}

TEST(ErrorText, DetailComesFromTheTrailer) {
  const auto status =
      status_with(soft_limit(), grpc::StatusCode::OUT_OF_RANGE, "type.googleapis.com/axisd.v1.ErrorDetail");
  const auto failure = failure_of(status, "feeder", "localhost:7443", false);
  EXPECT_EQ(failure.code(), ExitCode::refused);
  EXPECT_STREQ(
      failure.what(),
      "feeder: position 500 mm is beyond the soft limit (permitted 0 to 400 mm); choose a target inside");
}

TEST(ErrorText, ForeignOrBrokenDetailsFallBackToTheMessage) {
  const auto foreign =
      status_with(soft_limit(), grpc::StatusCode::INTERNAL, "type.googleapis.com/google.rpc.DebugInfo");
  EXPECT_FALSE(detail_of(foreign));
  EXPECT_STREQ(failure_of(foreign, "feeder", "x", false).what(), "feeder: text");
  EXPECT_FALSE(detail_of(grpc::Status(grpc::StatusCode::INTERNAL, "text", "\xff\xff")));
}

TEST(ErrorText, AnOfflineDriveIsARefusalAndASilentDaemonIsNot) {
  v1::ErrorDetail offline;
  offline.set_reason(v1::REASON_OFFLINE);
  const auto by_daemon = status_with(offline, grpc::StatusCode::UNAVAILABLE, "x/axisd.v1.ErrorDetail");
  EXPECT_EQ(failure_of(by_daemon, "feeder", "x", false).code(), ExitCode::refused);

  const grpc::Status refused(
      grpc::StatusCode::UNAVAILABLE,
      "failed to connect to all addresses; last error: UNKNOWN: ipv4:127.0.0.1:1: Failed to "
      "connect to remote host: Connection refused");
  const auto failure = failure_of(refused, "", "localhost:1", false);
  EXPECT_EQ(failure.code(), ExitCode::unreachable);
  EXPECT_STREQ(
      failure.what(),
      "cannot reach axisd at localhost:1: ipv4:127.0.0.1:1: Failed to connect to remote host: Connection "
      "refused; is the daemon running there? --server HOST:PORT or AXISD_SERVER names another one");
  EXPECT_EQ(failure_of({grpc::StatusCode::DEADLINE_EXCEEDED, "Deadline Exceeded"}, "", "x", false).code(),
            ExitCode::unreachable);
  EXPECT_EQ(failure_of({grpc::StatusCode::PERMISSION_DENIED, "no"}, "", "x", false).code(),
            ExitCode::refused);
}

google::protobuf::Map<std::string, google::protobuf::Value> fields_of(const Failure& failure) {
  google::protobuf::Struct line;
  EXPECT_TRUE(google::protobuf::util::JsonStringToMessage(error_json(failure), &line).ok());
  return line.fields().at("error").struct_value().fields();
}

TEST(ErrorJson, ARefusalHasAllThatTheDaemonSaid) {
  const auto status =
      status_with(soft_limit(), grpc::StatusCode::OUT_OF_RANGE, "type.googleapis.com/axisd.v1.ErrorDetail");
  const auto refused = failure_of(status, "feeder", "localhost:7443", false);
  const auto error = fields_of(refused.saying("moves.txt:3: as above"));
  EXPECT_EQ(error.at("reason").string_value(), "REASON_SOFT_LIMIT");
  EXPECT_EQ(error.at("message").string_value(), "position 500 mm is beyond the soft limit");
  EXPECT_EQ(error.at("remedy").string_value(), "choose a target inside");
  EXPECT_EQ(error.at("permitted").struct_value().fields().at("maximum").number_value(), 400);
  EXPECT_EQ(error.at("exit_status").number_value(), 4);
  EXPECT_EQ(error.at("text").string_value(), "moves.txt:3: as above");
}

TEST(ErrorJson, FailuresOfTheProgramItselfHaveReasonAndRemedy) {
  const auto usage = fields_of({ExitCode::usage, "there is no command 'mov'; did you mean 'move'?"});
  EXPECT_EQ(usage.at("reason").string_value(), "USAGE");
  EXPECT_EQ(usage.at("message").string_value(), "there is no command 'mov'");
  EXPECT_EQ(usage.at("remedy").string_value(), "did you mean 'move'?");
  EXPECT_FALSE(usage.contains("outcome"));
  const auto lost = fields_of({ExitCode::unreachable, "lost axisd"});
  EXPECT_EQ(lost.at("reason").string_value(), "UNREACHABLE");
  EXPECT_EQ(lost.at("remedy").string_value(), "");
  EXPECT_EQ(lost.at("outcome").string_value(), "OUTCOME_UNKNOWN");
  EXPECT_EQ(fields_of({ExitCode::unreachable, "no connection", true}).at("outcome").string_value(),
            "OUTCOME_NOT_SENT");
}

TEST(Failures, OfAMachineOfACellNameItOnce) {
  auto detail = soft_limit();
  detail.clear_permitted();
  detail.set_message("feeder: too far");
  EXPECT_EQ(describe(detail, "press-2/feeder"), "too far; choose a target inside");
  detail.set_message("press-2: no answer");
  EXPECT_EQ(describe(detail, "press-2/feeder"), "no answer; choose a target inside");
}

TEST(Failures, ASilentMachineIsUnreachableAndADriveIsNot) {
  v1::ErrorDetail detail;
  detail.set_reason(v1::REASON_OFFLINE);
  detail.set_message("press-2 does not answer");
  detail.set_outcome(v1::OUTCOME_NOT_SENT);
  const auto of = [&](Asked asked) {
    return failure_of(
        status_with(detail, grpc::StatusCode::UNAVAILABLE, "type.googleapis.com/axisd.v1.ErrorDetail"),
        "press-2/feeder", "press-1:7445", false, asked);
  };
  EXPECT_EQ(of(Asked::entrance).code(), ExitCode::unreachable);
  EXPECT_TRUE(of(Asked::entrance).nothing_sent());
  EXPECT_EQ(of(Asked::daemon).code(), ExitCode::refused);
  detail.set_outcome(v1::OUTCOME_UNKNOWN);
  EXPECT_FALSE(of(Asked::entrance).nothing_sent());
  detail.set_bus("line-a");
  detail.set_node(9);
  EXPECT_EQ(of(Asked::entrance).code(), ExitCode::refused);
}

TEST(Failures, ADaemonIsNoEntrance) {
  const grpc::Status status(grpc::StatusCode::UNIMPLEMENTED, "");
  EXPECT_THAT(failure_of(status, "", "press-1:7443", false, Asked::entrance).what(),
              HasSubstr("press-1:7443 is no entrance of a cell, "));
  EXPECT_THAT(failure_of(status, "", "press-1:7443", false).what(),
              HasSubstr("does not offer this function"));
}

TEST(Failures, AdviceIsThatOfAxisctl) {
  auto detail = soft_limit();
  detail.clear_permitted();
  detail.set_remedy("then axisctl reset feeder");
  EXPECT_THAT(describe(detail, "press-2/feeder"), HasSubstr("; then axisctl reset press-2/feeder"));
  detail.set_message("options.not_after passed 0.1 s before the request arrived");
  EXPECT_THAT(describe(detail), HasSubstr("what --valid-for gives was over 0.1 s before"));
}

TEST(Failures, AnEntranceThatIsNotThereHasARemedyOfItsOwn) {
  const grpc::Status status(grpc::StatusCode::UNAVAILABLE,
                            "failed to connect to all addresses; last error: Connection refused");
  const Failure failure = failure_of(status, "", "press-1:7445", false, Asked::entrance);
  EXPECT_THAT(failure.what(), HasSubstr("cannot reach axisd-cell at press-1:7445"));
  EXPECT_THAT(failure.what(), HasSubstr("--cell HOST:PORT"));
  EXPECT_TRUE(failure.nothing_sent());
}

}  // namespace
}  // namespace axisd::axisctl
