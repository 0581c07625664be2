// The audit's records as lines, and AuditService through a real connection.
#include <fmt/format.h>
#include <gmock/gmock.h>
#include <spdlog/spdlog.h>

#include <memory>
#include <mutex>
#include <string>
#include <utility>
#include <vector>

#include "api/server/audit_convert.hpp"
#include "axisd/v1/audit_service.grpc.pb.h"
#include "axisd/v1/bus_service.grpc.pb.h"
#include "axisd/v1/system_service.grpc.pb.h"
#include "tests/unit/api/serving.hpp"

namespace axisd::testing {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::SizeIs;
using ::testing::StartsWith;

Command command(CommandState state = CommandState::accepted) {
  Command result{.id = "i-1",
                 .axis = "feeder",
                 .request_id = "r1",
                 .client = "hmi-1",
                 .lease_token = 7,
                 .kind = CommandKind::move_absolute,
                 .asked = {.position = 5},
                 .state = state,
                 .accepted_at = WallTime(std::chrono::seconds(100))};
  if (ended(state)) result.ended_at = WallTime(std::chrono::seconds(101));
  return result;
}

AuditEntry change(CommandState state, WallTime at = WallTime(std::chrono::seconds(100))) {
  return {
      .at = at,
      .uptime = std::chrono::seconds(9),
      .content = Event{.sequence = 1,
                       .at = at,
                       .axis = "feeder",
                       .content = CommandChange{.command = std::make_shared<const Command>(command(state))}}};
}

std::string line_of(const AuditEntry& entry, std::uint64_t number = 1) {
  v1::AuditRecord record;
  server::to_proto(entry, record);
  record.set_number(number);
  record.set_revision("r1");
  return server::audit_line(record);
}

TEST(AuditLines, ARecordSurvivesItsLine) {
  const auto line = line_of(change(CommandState::done));
  EXPECT_THAT(line, HasSubstr(R"("number":"1")"));
  EXPECT_EQ(line.find('\n'), std::string::npos);
  const auto record = server::audit_record(line);
  ASSERT_TRUE(record);
  EXPECT_EQ(record->kind(), v1::AUDIT_KIND_COMMAND);
  EXPECT_EQ(record->client(), "hmi-1");
  EXPECT_EQ(record->axis(), "feeder");
  EXPECT_EQ(record->rpc(), "AxisService.MoveAbsolute");
  EXPECT_EQ(record->request_id(), "r1");
  EXPECT_EQ(record->lease_token(), 7U);
  EXPECT_EQ(record->at().seconds(), 100);
  EXPECT_EQ(record->uptime().seconds(), 9);
  EXPECT_EQ(record->event().command_change().command().asked().position(), 5);
  EXPECT_FALSE(server::audit_record("{\"number\":"));
  EXPECT_TRUE(server::audit_record(R"({"number":"3","of_a_later_version":true})"));
}

TEST(AuditLines, TheCommandThatALineTellsOf) {
  const auto accepted = server::told_command(line_of(change(CommandState::accepted)));
  ASSERT_TRUE(accepted);
  EXPECT_EQ(accepted->id, "i-1");
  EXPECT_FALSE(accepted->ended);
  EXPECT_TRUE(server::told_command(line_of(change(CommandState::aborted)))->ended);
  const auto recovered =
      line_of({.content = RecoveredCommand{.command = command(CommandState::done), .sent = true}});
  EXPECT_EQ(server::told_command(recovered)->id, "i-1");
  EXPECT_TRUE(server::told_command(recovered)->ended);
  auto refused = command();
  refused.id.clear();
  EXPECT_FALSE(server::told_command(line_of({.content = RefusedCommand{.command = refused}})));
  EXPECT_FALSE(server::told_command(line_of({.content = AuditGap{.left_out = 1}})));
}

TEST(AuditLines, WhatWasWritten) {
  const AuditedCall call{
      .phase = AuditedCall::Phase::done,
      .rpc = "DriveService.WriteParameters",
      .client = "hmi-1",
      .axis = "feeder",
      .text = "writes 1 parameters",
      .parameters = {{.name = "filter", .address = 0x118, .asked = 12, .before = 8, .after = 12}}};
  const auto record = server::audit_record(line_of({.content = call}));
  ASSERT_TRUE(record);
  EXPECT_EQ(record->kind(), v1::AUDIT_KIND_CALL);
  ASSERT_EQ(record->call().parameters_size(), 1);
  EXPECT_EQ(record->call().parameters(0).before(), 8);
  EXPECT_EQ(record->call().parameters(0).after(), 12);
}

TEST(AuditLines, WhereItWasAskedForAndWithWhichRole) {
  auto moved = command();
  moved.origin =
      std::make_shared<const CallOrigin>(CallOrigin{.peer = "ipv4:10.0.0.5:51234", .role = Role::operator_});
  const auto record = server::audit_record(line_of({.content = RefusedCommand{.command = moved}}));
  ASSERT_TRUE(record);
  EXPECT_EQ(record->peer(), "ipv4:10.0.0.5:51234");
  EXPECT_EQ(record->role(), "operator");
}

TEST(AuditLines, WhichGroupAndWhichBusItConcerns) {
  const auto refused =
      server::audit_record(line_of({.content = RefusedCommand{.command = command(), .group = "portal"}}));
  ASSERT_TRUE(refused);
  EXPECT_EQ(refused->group(), "portal");
  v1::ListAuditRequest request;
  request.add_axes("portal");
  EXPECT_TRUE(server::AuditFilter(request).passes(*refused));
  const auto called = server::audit_record(
      line_of({.content = AuditedCall{.rpc = "BusService.Transact", .client = "hmi-1", .bus = "line-a"}}));
  ASSERT_TRUE(called);
  EXPECT_EQ(called->bus(), "line-a");
  EXPECT_FALSE(server::AuditFilter(request).passes(*called));
}

TEST(AuditLines, ACallThatItsClientMayNotMake) {
  const auto line = line_of({.content = DeniedCall{.rpc = "AxisService.Enable",
                                                   .client = "anna via web",
                                                   .axis = "feeder",
                                                   .error = {.reason = Reason::access_denied},
                                                   .left_out = 3}});
  EXPECT_FALSE(server::told_command(line));
  const auto record = server::audit_record(line);
  ASSERT_TRUE(record);
  EXPECT_EQ(record->kind(), v1::AUDIT_KIND_REFUSAL);
  EXPECT_EQ(record->client(), "anna via web");
  EXPECT_EQ(record->rpc(), "AxisService.Enable");
  EXPECT_EQ(record->role(), "") << "not known";
  EXPECT_EQ(record->denied().error().reason(), v1::REASON_ACCESS_DENIED);
  EXPECT_EQ(record->denied().left_out(), 3U);
}

TEST(AuditLines, WhoDidWhatToStopAllAndLeases) {
  const auto record = [](EventContent content) {
    return *server::audit_record(line_of({.content = Event{.axis = {}, .content = std::move(content)}}));
  };
  const auto released = record(InhibitChange{.what = InhibitChange::What::released, .by = "hmi-1"});
  EXPECT_EQ(released.kind(), v1::AUDIT_KIND_INHIBIT);
  EXPECT_EQ(released.client(), "hmi-1");
  EXPECT_EQ(released.rpc(), "SystemService.ReleaseStopAll");
  const auto expired =
      record(LeaseChange{.what = LeaseChange::What::expired, .holder = "", .before = "hmi-2"});
  EXPECT_EQ(expired.kind(), v1::AUDIT_KIND_LEASE);
  EXPECT_EQ(expired.client(), "hmi-2");
}

TEST(AuditLines, WhatWasSavedToAnEeprom) {
  const auto record = server::audit_record(
      line_of({.content = Event{.axis = "feeder", .content = EepromWritten{.registers = 3, .total = 40}}}));
  ASSERT_TRUE(record);
  EXPECT_EQ(record->kind(), v1::AUDIT_KIND_EEPROM);
  EXPECT_EQ(record->axis(), "feeder");
  EXPECT_EQ(record->client(), "") << "whoever asked for it has a record of the call";
  EXPECT_EQ(record->event().eeprom_written().registers(), 3U);
  EXPECT_EQ(record->event().eeprom_written().total(), 40U);
}

TEST(AuditLines, WhatHasNoTextKeepsItsNumber) {
  auto nameless = command();
  nameless.client = "\xFF";
  const auto record = server::audit_record(line_of({.content = RefusedCommand{.command = nameless}}, 12));
  ASSERT_TRUE(record);
  EXPECT_EQ(record->number(), 12U);
  EXPECT_EQ(record->kind(), v1::AUDIT_KIND_GAP);
  EXPECT_EQ(record->gap().left_out(), 1U);
}

/// In memory.
class FakeAudit final : public AuditAccess, public AuditSink {
 public:
  void add(AuditEntry entry) override {
    const std::scoped_lock lock(mutex_);
    lines_.push_back(line_of(entry, lines_.size() + 1));
  }
  void look(std::uint64_t after, WallTime /*since*/, Visit visit,
            std::function<void(Result<AuditSeen>)> done) override {
    const std::scoped_lock lock(mutex_);
    AuditSeen seen{
        .cursor = std::min<std::uint64_t>(after, lines_.size()), .newest = lines_.size(), .oldest = 1};
    while (seen.cursor < lines_.size() && visit(lines_[seen.cursor++])) {
    }
    done(seen);
  }
  std::vector<std::string> lines() const {
    const std::scoped_lock lock(mutex_);
    return lines_;
  }

 private:
  mutable std::mutex mutex_;
  std::vector<std::string> lines_;
};

class AuditCalls : public Serving {
 protected:
  AuditCalls() { serve({.audit = &audit_, .audit_sink = &audit_}); }
  v1::ListAuditResponse list(const v1::ListAuditRequest& request) {
    Call context;
    v1::ListAuditResponse response;
    const auto status = v1::AuditService::NewStub(channel_)->ListAudit(&context, request, &response);
    EXPECT_TRUE(status.ok()) << status.error_message();
    return response;
  }
  static std::vector<std::uint64_t> numbers(const v1::ListAuditResponse& response) {
    std::vector<std::uint64_t> all;
    for (const auto& record : response.records()) all.push_back(record.number());
    return all;
  }

  FakeAudit audit_;
};

TEST_F(AuditCalls, PagesGoOnWithTheirCursor) {
  for (int i = 0; i < 5; ++i) audit_.add(change(CommandState::accepted));
  v1::ListAuditRequest request;
  request.set_limit(2);
  const auto first = list(request);
  EXPECT_THAT(numbers(first), ElementsAre(1, 2));
  EXPECT_EQ(first.cursor(), 2U);
  EXPECT_EQ(first.newest(), 5U);
  request.set_after_number(first.cursor());
  EXPECT_THAT(numbers(list(request)), ElementsAre(3, 4));
  request.set_after_number(5);
  EXPECT_THAT(numbers(list(request)), SizeIs(0));
}

TEST_F(AuditCalls, WhatIsNotAskedForIsLeftOut) {
  audit_.add(change(CommandState::accepted));
  audit_.add({.at = WallTime(std::chrono::seconds(200)), .content = AuditGap{.left_out = 3}});
  audit_.add(change(CommandState::done, WallTime(std::chrono::seconds(300))));
  v1::ListAuditRequest request;
  request.add_kinds(v1::AUDIT_KIND_GAP);
  EXPECT_THAT(numbers(list(request)), ElementsAre(2));
  EXPECT_EQ(list(request).cursor(), 3U);
  request.clear_kinds();
  request.add_axes("feeder");
  EXPECT_THAT(numbers(list(request)), ElementsAre(1, 3));
  request.clear_axes();
  request.add_clients("hmi-1");
  request.mutable_since()->set_seconds(250);
  EXPECT_THAT(numbers(list(request)), ElementsAre(3));
  request.clear_clients();
  request.add_clients("hmi");
  EXPECT_THAT(numbers(list(request)), SizeIs(0)) << "identities are whole";
}

TEST_F(AuditCalls, AWrittenRegisterIsToldBeforeAndBehind) {
  v1::TransactRequest request;
  request.set_bus("line-a");
  request.set_node(9);
  v1::TransactResponse response;
  const auto transact = [&] {
    Call context;
    return v1::BusService::NewStub(channel_)->Transact(&context, request, &response);
  };
  request.set_read(2);
  ASSERT_TRUE(transact().ok());
  EXPECT_THAT(audit_.lines(), SizeIs(0)) << "reading changes nothing";
  request.mutable_write()->add_values(5);
  ASSERT_TRUE(transact().ok());
  const auto told = list({});
  ASSERT_EQ(told.records_size(), 2);
  EXPECT_EQ(told.records(0).call().phase(), v1::AUDITED_CALL_PHASE_ASKED);
  EXPECT_EQ(told.records(1).call().phase(), v1::AUDITED_CALL_PHASE_DONE);
  EXPECT_EQ(told.records(1).client(), own_name());
  EXPECT_EQ(told.records(1).bus(), "line-a");
  EXPECT_THAT(told.records(1).peer(), StartsWith("unix:"));
  EXPECT_EQ(told.records(1).role(), "") << "there are no roles";
  EXPECT_EQ(told.records(1).rpc(), "BusService.Transact");
  EXPECT_THAT(told.records(1).call().text(), HasSubstr("line-a node 9"));
}

class LogLevel : public AuditCalls {
 protected:
  ~LogLevel() override { spdlog::set_level(before_); }
  grpc::Status set(v1::LogLevel level) {
    Call context;
    v1::SetLogLevelRequest request;
    request.set_level(level);
    response_.Clear();
    return v1::SystemService::NewStub(channel_)->SetLogLevel(&context, request, &response_);
  }

  const spdlog::level::level_enum before_ = spdlog::get_level();
  v1::SetLogLevelResponse response_;
};

TEST_F(LogLevel, IsToldAndChangedAtOnceWithARecord) {
  spdlog::set_level(spdlog::level::info);
  ASSERT_TRUE(set(v1::LOG_LEVEL_UNSPECIFIED).ok());
  EXPECT_EQ(response_.level(), v1::LOG_LEVEL_INFO);
  EXPECT_EQ(spdlog::get_level(), spdlog::level::info);
  EXPECT_THAT(audit_.lines(), SizeIs(0)) << "asking changes nothing";
  ASSERT_TRUE(set(v1::LOG_LEVEL_DEBUG).ok());
  EXPECT_EQ(response_.level(), v1::LOG_LEVEL_DEBUG);
  EXPECT_EQ(response_.previous(), v1::LOG_LEVEL_INFO);
  EXPECT_EQ(spdlog::get_level(), spdlog::level::debug);
  ASSERT_TRUE(set(v1::LOG_LEVEL_ERROR).ok());
  EXPECT_EQ(response_.previous(), v1::LOG_LEVEL_DEBUG);
  EXPECT_EQ(spdlog::get_level(), spdlog::level::err);
  const auto told = list({});
  ASSERT_EQ(told.records_size(), 2);
  EXPECT_EQ(told.records(0).client(), own_name());
  EXPECT_EQ(told.records(0).rpc(), "SystemService.SetLogLevel");
  EXPECT_EQ(told.records(0).call().text(), "the log has level debug now, and had info");
}

TEST_F(LogLevel, OfALaterVersionIsRefused) {
  const auto before = spdlog::get_level();
  const auto status = set(static_cast<v1::LogLevel>(99));
  EXPECT_EQ(status.error_code(), grpc::StatusCode::INVALID_ARGUMENT);
  EXPECT_EQ(detail_of(status).reason(), v1::REASON_INVALID_ARGUMENT);
  EXPECT_EQ(spdlog::get_level(), before);
  EXPECT_THAT(audit_.lines(), SizeIs(0));
}

TEST_F(AuditCalls, AServerWithoutAnAuditSaysSo) {
  server_.reset();
  serve();
  Call context;
  v1::ListAuditResponse response;
  const auto status = v1::AuditService::NewStub(channel_)->ListAudit(&context, {}, &response);
  EXPECT_FALSE(status.ok());
  EXPECT_EQ(detail_of(status).reason(), v1::REASON_NOT_SUPPORTED);
}

TEST_F(AuditCalls, ALimitHasABound) {
  Call context;
  v1::ListAuditRequest request;
  request.set_limit(501);
  v1::ListAuditResponse response;
  const auto status = v1::AuditService::NewStub(channel_)->ListAudit(&context, request, &response);
  EXPECT_EQ(status.error_code(), grpc::StatusCode::OUT_OF_RANGE);
}

}  // namespace
}  // namespace axisd::testing
