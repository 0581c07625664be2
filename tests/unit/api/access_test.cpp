// Who may make which call: every call of the contract against every role, and the doors that ask.
#include "api/server/access.hpp"

#include <gmock/gmock.h>

#include <future>
#include <memory>
#include <mutex>
#include <string>
#include <variant>
#include <vector>

#include "api/server/lane/stop_calls.hpp"
#include "api/server/lane/stop_lane.hpp"
#include "axisd/v1/access.pb.h"
#include "axisd/v1/bus_service.grpc.pb.h"
#include "axisd/v1/group_service.grpc.pb.h"
#include "axisd/v1/lease_service.pb.h"
#include "axisd/v1/stop_service.grpc.pb.h"
#include "axisd/v1/system_service.grpc.pb.h"
#include "tests/unit/api/serving.hpp"

namespace axisd::testing {
namespace {

using google::protobuf::FieldDescriptor;
using google::protobuf::Message;
using google::protobuf::MethodDescriptor;
using server::AccessControl;
using server::admitted;
using server::Caller;
using server::demand_of;
using server::Peer;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::MatchesRegex;
using ::testing::StartsWith;

const Peer anna{.name = "anna"};

std::unique_ptr<Message> request_of(const MethodDescriptor& call) {
  return std::unique_ptr<Message>(
      google::protobuf::MessageFactory::generated_factory()->GetPrototype(call.input_type())->New());
}

/// Names the axis wherever the request can. False: it cannot.
bool name_axis(Message& request, const std::string& axis) {
  bool named = false;
  for (const auto* name : {"axis", "axes", "group"}) {
    const auto* field = request.GetDescriptor()->FindFieldByName(name);
    if (field == nullptr) continue;
    named = true;
    if (field->is_repeated())
      request.GetReflection()->AddString(&request, field, axis);
    else
      request.GetReflection()->SetString(&request, field, axis);
  }
  return named;
}

Role role_in_contract(const MethodDescriptor& call) {
  return static_cast<Role>(int{call.options().GetExtension(v1::access).role()} - 1);
}

/// Not even what needs no role: whoever it is, it is not known to be that any more.
TEST(Access, NothingIsTakenFromAPeerWhoseCertificateIsNotGood) {
  const Peer gone{.name = "anna",
                  .refusal = Error{.reason = Reason::unauthenticated, .message = "revoked", .remedy = "ask"}};
  const AccessSettings access{.roles = {{"anna", Role::maintainer}}};
  for (const auto* call : served_calls())
    for (const auto* table : {static_cast<const AccessSettings*>(nullptr), &access}) {
      const auto result = admitted(table, gone, {}, *request_of(*call), {});
      ASSERT_FALSE(result) << call->full_name();
      EXPECT_EQ(result.error().reason, Reason::unauthenticated);
    }
}

TEST(Access, EveryCallSaysWhoMayMakeIt) {
  for (const auto* call : served_calls())
    EXPECT_NE(call->options().GetExtension(v1::access).role(), v1::ROLE_UNSPECIFIED) << call->full_name();
}

TEST(Access, TheStopLaneAsksForWhatTheMainAddressAsksFor) {
  const auto lane = calls_of(v1::StopService::service_full_name());
  ASSERT_FALSE(lane.empty());
  for (const auto* call : lane) {
    const auto demand = demand_of(*request_of(*call));
    EXPECT_EQ(demand.call, call->name());
    EXPECT_EQ(demand.role, role_in_contract(*call)) << call->name();
    EXPECT_EQ(demand.anywhere, call->options().GetExtension(v1::access).anywhere()) << call->name();
  }
}

TEST(Access, ToStopNeedsNoRole) {
  const AccessSettings nobody;
  for (const auto* call : served_calls()) {
    const auto& name = call->name();
    const bool stops = name == "StopAll" || name == "Stop" || name == "Halt" || name == "QuickStop" ||
                       name == "GroupStop" || name == "GroupHalt";
    if (stops) {
      EXPECT_TRUE(admitted(&nobody, anna, {.user = "mallory"}, *request_of(*call), {})) << name;
    }
  }
}

enum class Scope : std::uint8_t { machine, this_axis, another_axis };

AccessSettings with(Role role, Scope scope) {
  if (scope == Scope::machine) return {.roles = {{"anna", role}}};
  return {.axes = {{scope == Scope::this_axis ? "feeder" : "lifter", {{"anna", role}}}}};
}

/// Every call, by every role, given on the machine, on the axis that is named, and on another one.
TEST(Access, EachCallIsPermittedToItsRoleAndThoseAbove) {
  int looked_at = 0;
  for (const auto* call : served_calls()) {
    const auto request = request_of(*call);
    const bool named = name_axis(*request, "feeder");
    const auto needed = role_in_contract(*call);
    const bool anywhere = call->options().GetExtension(v1::access).anywhere();
    for (const auto role : {Role::none, Role::viewer, Role::operator_, Role::maintainer})
      for (const auto scope : {Scope::machine, Scope::this_axis, Scope::another_axis}) {
        const bool applies = scope == Scope::machine || (named ? scope == Scope::this_axis : anywhere);
        const bool expected = needed == Role::none || (applies && role >= needed);
        const auto access = with(role, scope);
        const auto result = admitted(&access, anna, {}, *request, {});
        EXPECT_EQ(result.has_value(), expected)
            << call->full_name() << " as " << to_string(role) << ", scope " << static_cast<int>(scope);
        if (!result) {
          EXPECT_EQ(result.error().reason, Reason::access_denied);
          EXPECT_THAT(result.error().message,
                      HasSubstr(std::string("the role ") + std::string(to_string(needed))));
        }
        ++looked_at;
      }
  }
  EXPECT_GT(looked_at, 500);
}

TEST(Access, WhoReleasesTheHoldsOfOthersIsAMaintainer) {
  v1::ReleaseStopRequest request;
  request.set_axis("feeder");
  EXPECT_EQ(demand_of(request).role, Role::none);
  request.set_everybody(true);
  EXPECT_EQ(demand_of(request).role, Role::maintainer);
  v1::GroupReleaseStopRequest group;
  group.set_everybody(true);
  EXPECT_EQ(demand_of(group).role, Role::maintainer);
}

TEST(Access, EveryAxisThatIsNamedCounts) {
  const AccessSettings access{.roles = {{"anna", Role::operator_}},
                              .axes = {{"lifter", {{"anna", Role::viewer}}}}};
  v1::MoveGroupRequest request;
  request.add_targets()->set_axis("feeder");
  EXPECT_TRUE(admitted(&access, anna, {}, request, {}));
  request.add_targets()->set_axis("lifter");
  const auto refused = admitted(&access, anna, {}, request, {});
  ASSERT_FALSE(refused);
  EXPECT_EQ(refused.error().message, "MoveGroup needs the role operator on lifter; anna has viewer");
  EXPECT_THAT(refused.error().remedy, HasSubstr("give anna that role under access:"));
  v1::AcquireLeaseRequest lease;
  lease.add_axes("gantry");
  const std::vector<GroupSettings> groups{{.name = "gantry", .axes = {"feeder", "lifter"}}};
  EXPECT_FALSE(admitted(&access, anna, {}, lease, groups));
}

TEST(Access, AGroupStandsForItsAxes) {
  const std::vector<GroupSettings> groups{{.name = "gantry", .axes = {"feeder", "lifter"}},
                                          {.name = "both", .axes = {"lifter", "pusher"}}};
  const auto access = server::expanded({.axes = {{"gantry", {{"anna", Role::operator_}}},
                                                 {"both", {{"anna", Role::viewer}}},
                                                 {"feeder", {{"anna", Role::maintainer}}}}},
                                       groups);
  const Caller caller{.name = "anna", .identity = "anna"};
  EXPECT_EQ(server::role_of(&access, caller, "feeder"), Role::maintainer)
      << "what is said of the axis itself";
  EXPECT_EQ(server::role_of(&access, caller, "lifter"), Role::viewer) << "the least of its groups";
  EXPECT_EQ(server::role_of(&access, caller, "pusher"), Role::viewer);
  EXPECT_FALSE(access.axes.contains("gantry"));
}

TEST(Access, WithoutItEverybodyMayDoEverything) {
  v1::ReloadConfigRequest request;
  EXPECT_TRUE(admitted(nullptr, anna, {}, request, {}));
  const auto refused = admitted(nullptr, anna, {.user = "bert"}, request, {});
  ASSERT_FALSE(refused) << "nobody is a delegate";
  EXPECT_EQ(refused.error().reason, Reason::access_denied);
  EXPECT_EQ(server::role_of(nullptr, {.name = "anna"}, "feeder"), Role::maintainer);
}

TEST(Access, ADelegateSpeaksForOthersAndGivesNoMoreThanItHas) {
  const AccessSettings access{.delegates = {{"web", Role::operator_}}};
  const Peer web{.name = "web"};
  const auto speak = [&](server::Claim claim) { return server::caller_of(&access, web, claim); };
  const auto shift = speak({.user = "shift-a"});
  ASSERT_TRUE(shift);
  EXPECT_EQ(shift->name, "shift-a via web");
  EXPECT_EQ(shift->lent, Role::operator_);
  EXPECT_EQ(speak({.user = "shift-a", .role = "viewer"})->lent, Role::viewer);
  EXPECT_EQ(speak({.user = "shift-a", .role = "maintainer"})->lent, Role::operator_);
  for (const auto& wrong : std::vector<server::Claim>{{.user = "shift-a", .role = "king"},
                                                      {.role = "viewer"},
                                                      {.user = ""},
                                                      {.user = "a via b"},
                                                      {.user = std::string(65, 'a')},
                                                      {.user = "a\nb"}})
    EXPECT_EQ(speak(wrong).error().reason, Reason::invalid_argument);
  EXPECT_EQ(server::caller_of(&access, anna, {.user = "shift-a"}).error().reason, Reason::access_denied);
  v1::EnableRequest enable;
  enable.set_axis("feeder");
  EXPECT_TRUE(admitted(&access, web, {.user = "shift-a"}, enable, {}));
  EXPECT_EQ(admitted(&access, web, {.user = "shift-a", .role = "viewer"}, enable, {}).error().remedy,
            "ask with axisd-role: operator");
  EXPECT_EQ(admitted(&access, web, {.user = "shift-a", .role = "maintainer"}, v1::ReloadConfigRequest(), {})
                .error()
                .remedy,
            "give web that role under access: delegates in the configuration")
      << "it has asked for it already";
  EXPECT_FALSE(admitted(&access, web, {}, enable, {})) << "for itself it has none";
  EXPECT_EQ(admitted(&access, anna, {.user = "shift-a"}, v1::StopRequest(), {})->name, "anna")
      << "a stop is taken as one's own";
}

/// What the audit is told of calls that are denied.
class Told final : public AuditSink {
 public:
  void add(AuditEntry entry) override {
    const std::lock_guard lock(mutex_);
    if (const auto* denied = std::get_if<DeniedCall>(&entry.content)) denied_.push_back(*denied);
  }
  std::vector<DeniedCall> denied() const {
    const std::lock_guard lock(mutex_);
    return denied_;
  }

 private:
  mutable std::mutex mutex_;
  std::vector<DeniedCall> denied_;
};

class AccessCalls : public Serving {
 protected:
  void serve_with(AccessSettings settings) {
    control_ = std::make_shared<AccessControl>(std::move(settings));
    server::ServerOptions options;
    options.access = control_;
    options.audit_sink = &told_;
    serve(std::move(options));
  }
  grpc::Status enable(std::vector<std::pair<std::string, std::string>> metadata = {}) {
    Call context;
    for (const auto& [key, value] : metadata) context.AddMetadata(key, value);
    v1::EnableRequest request;
    request.set_axis("feeder");
    request.mutable_options()->set_request_id("r-" + std::to_string(++requests_));
    v1::EnableResponse response;
    auto status = axes_->Enable(&context, request, &response);
    client_ = response.command().client();
    return status;
  }
  grpc::Status get() {
    Call context;
    v1::GetAxisRequest request;
    request.set_axis("feeder");
    v1::GetAxisResponse response;
    return axes_->GetAxis(&context, request, &response);
  }
  grpc::Status stop() {
    Call context;
    v1::StopRequest request;
    request.set_axis("feeder");
    v1::StopResponse response;
    return axes_->Stop(&context, request, &response);
  }
  v1::GetInfoResponse info() {
    Call context;
    v1::GetInfoResponse response;
    EXPECT_TRUE(
        v1::SystemService::NewStub(channel_)->GetInfo(&context, v1::GetInfoRequest(), &response).ok());
    return response;
  }
  Told told_;
  std::shared_ptr<AccessControl> control_;
  int requests_ = 0;
  std::string client_;
};

TEST_F(AccessCalls, AUnixSocketsUserHasItsRole) {
  serve_with({.roles = {{own_name(), Role::viewer}}, .axes = {{"lifter", {{own_name(), Role::operator_}}}}});
  EXPECT_TRUE(get().ok());
  const auto refused = enable();
  EXPECT_EQ(refused.error_code(), grpc::StatusCode::PERMISSION_DENIED);
  EXPECT_EQ(detail_of(refused).reason(), v1::REASON_ACCESS_DENIED);
  EXPECT_EQ(detail_of(refused).message(),
            "Enable needs the role operator on feeder; " + own_name() + " has viewer");
  EXPECT_TRUE(stop().ok());
  const auto who = info();
  EXPECT_EQ(who.client(), own_name());
  EXPECT_EQ(who.identity(), own_name());
  EXPECT_EQ(who.role(), v1::ROLE_VIEWER);
  ASSERT_EQ(who.axis_roles_size(), 1);
  EXPECT_EQ(who.axis_roles(0).axis(), "lifter");
  EXPECT_EQ(who.axis_roles(0).role(), v1::ROLE_OPERATOR);
}

TEST_F(AccessCalls, WhoIsNotNamedCanStopAndNothingElse) {
  serve_with({});
  EXPECT_EQ(get().error_code(), grpc::StatusCode::PERMISSION_DENIED);
  EXPECT_EQ(enable().error_code(), grpc::StatusCode::PERMISSION_DENIED);
  Call context;
  const auto watch = axes_->WatchAxes(&context, v1::WatchAxesRequest());
  v1::WatchAxesResponse tick;
  EXPECT_FALSE(watch->Read(&tick));
  EXPECT_EQ(watch->Finish().error_code(), grpc::StatusCode::PERMISSION_DENIED);
  EXPECT_TRUE(stop().ok());
  EXPECT_EQ(info().role(), v1::ROLE_NONE);
  control_->replace(AccessSettings{.roles = {{own_name(), Role::operator_}}});
  EXPECT_TRUE(enable().ok()) << "on the connection that was there";
}

TEST_F(AccessCalls, WhomADelegateSpeaksForIsTheClient) {
  serve_with({.delegates = {{own_name(), Role::operator_}}});
  EXPECT_TRUE(enable({{"axisd-user", "shift-a"}}).ok());
  EXPECT_EQ(client_, "shift-a via " + own_name());
  EXPECT_EQ(enable({{"axisd-user", "guest"}, {"axisd-role", "viewer"}}).error_code(),
            grpc::StatusCode::PERMISSION_DENIED);
  EXPECT_EQ(enable().error_code(), grpc::StatusCode::PERMISSION_DENIED);
}

TEST_F(AccessCalls, WithoutSettingsNobodySpeaksForOthers) {
  serve();
  EXPECT_TRUE(enable().ok());
  EXPECT_EQ(enable({{"axisd-user", "shift-a"}}).error_code(), grpc::StatusCode::PERMISSION_DENIED);
  EXPECT_EQ(info().role(), v1::ROLE_MAINTAINER);
}

TEST_F(AccessCalls, WhatIsDeniedIsToldWithWhoAndFromWhere) {
  serve_with({.roles = {{own_name(), Role::viewer}}, .delegates = {{own_name(), Role::viewer}}});
  EXPECT_FALSE(enable().ok());
  EXPECT_FALSE(enable({{"axisd-user", "shift-a"}}).ok());
  EXPECT_TRUE(get().ok());
  const auto denied = told_.denied();
  ASSERT_EQ(denied.size(), 2U);
  EXPECT_EQ(denied[0].rpc, "AxisService.Enable");
  EXPECT_EQ(denied[0].client, own_name());
  EXPECT_EQ(denied[0].axis, "feeder");
  EXPECT_EQ(denied[0].error.reason, Reason::access_denied);
  ASSERT_TRUE(denied[0].origin);
  EXPECT_EQ(denied[0].origin->role, Role::viewer);
  EXPECT_THAT(denied[0].origin->peer, StartsWith("unix:"));
  EXPECT_EQ(denied[1].client, "shift-a via " + own_name());
  for (int i = 0; i < 100; ++i) (void)enable({{"axisd-user", "p" + std::to_string(i)}});
  EXPECT_EQ(told_.denied().size(), audit_ration::refusals.most) << "of one identity in a minute";
}

TEST_F(AccessCalls, WhatIsDeniedNamesItsGroupOrBus) {
  serve_with({.roles = {{own_name(), Role::viewer}}});
  Call c1, c2;
  v1::MoveGroupRequest move;
  move.set_group("portal");
  v1::MoveGroupResponse moved;
  EXPECT_FALSE(v1::GroupService::NewStub(channel_)->MoveGroup(&c1, move, &moved).ok());
  v1::TransactRequest write;
  write.set_bus("line-a");
  write.mutable_write()->add_values(5);
  v1::TransactResponse written;
  EXPECT_FALSE(v1::BusService::NewStub(channel_)->Transact(&c2, write, &written).ok());
  const auto denied = told_.denied();
  ASSERT_EQ(denied.size(), 2U);
  EXPECT_EQ(denied[0].group, "portal");
  EXPECT_EQ(denied[0].axis, "");
  EXPECT_EQ(denied[1].bus, "line-a");
}

TEST_F(AccessCalls, WhatIsAcceptedSaysWithWhichRole) {
  serve_with({.roles = {{own_name(), Role::viewer}}, .axes = {{"feeder", {{own_name(), Role::operator_}}}}});
  EXPECT_TRUE(enable().ok());
  EXPECT_TRUE(stop().ok());
  const auto submitted = machine_.submitted();
  ASSERT_EQ(submitted.size(), 2U);
  for (const auto& each : submitted) {
    ASSERT_TRUE(each.options.origin);
    EXPECT_EQ(each.options.origin->role, Role::operator_) << "on what it names";
  }
}

class AccessLane : public ::testing::Test {
 protected:
  /// The code of the answer.
  int call(const std::string& name, const Message& request, server::Claim claim = {}) {
    std::promise<int> code;
    server::lane::StopCalls calls(machine_, std::make_shared<AccessControl>(settings_), &told_);
    calls.start({.stream = 1,
                 .path = "/axisd.v1.StopService/" + name,
                 .message = request.SerializeAsString(),
                 .claim = std::move(claim)},
                anna, [&](server::lane::StopCalls::Make make) { code.set_value(make().code); });
    return code.get_future().get();
  }
  FakeMachine machine_;
  AccessSettings settings_;
  Told told_;
};

TEST_F(AccessLane, AsksTheSameTable) {
  v1::StopRequest stop;
  stop.set_axis("feeder");
  v1::DisableRequest disable;
  disable.set_axis("feeder");
  EXPECT_EQ(call("Stop", stop), grpc::StatusCode::OK);
  EXPECT_EQ(call("Stop", stop, {.user = "shift-a"}), grpc::StatusCode::OK);
  EXPECT_EQ(call("Disable", disable), grpc::StatusCode::PERMISSION_DENIED);
  EXPECT_EQ(call("RenewLease", v1::RenewLeaseRequest()), grpc::StatusCode::PERMISSION_DENIED);
  settings_.axes["feeder"]["anna"] = Role::operator_;
  EXPECT_EQ(call("Disable", disable), grpc::StatusCode::OK);
  EXPECT_EQ(call("RenewLease", v1::RenewLeaseRequest()), grpc::StatusCode::OK) << "the lease is its own";
  EXPECT_EQ(call("Disable", disable, {.user = "shift-a"}), grpc::StatusCode::PERMISSION_DENIED);
  settings_.delegates["anna"] = Role::operator_;
  EXPECT_EQ(call("Disable", disable, {.user = "shift-a"}), grpc::StatusCode::OK);
  const auto options = machine_.submitted().back().options;
  EXPECT_EQ(options.client, "shift-a via anna");
  ASSERT_TRUE(options.origin);
  EXPECT_EQ(options.origin->role, Role::operator_);
  std::vector<std::string> denied;
  for (const auto& each : told_.denied()) denied.push_back(each.rpc);
  EXPECT_THAT(denied, ElementsAre("AxisService.Disable", "LeaseService.RenewLease", "AxisService.Disable"));
}

TEST_F(AccessLane, ReadsTheMetadata) {
  settings_.delegates["local:localhost"] = Role::operator_;
  server::StopLane lane(machine_,
                        {.listen = "127.0.0.1:0", .access = std::make_shared<AccessControl>(settings_)});
  const auto port = lane.listen();
  ASSERT_TRUE(port) << to_string(port.error());
  lane.serve();
  Call context;
  context.AddMetadata("axisd-user", "shift-a");
  v1::DisableRequest request;
  request.set_axis("feeder");
  v1::DisableResponse response;
  const auto stub = v1::StopService::NewStub(connect("127.0.0.1:" + std::to_string(*port)));
  const auto status = stub->Disable(&context, request, &response);
  EXPECT_TRUE(status.ok()) << status.error_message();
  EXPECT_EQ(response.command().client(), "shift-a via local:localhost");
  ASSERT_EQ(machine_.submitted().size(), 1U);
  const auto options = machine_.submitted().front().options;
  ASSERT_TRUE(options.origin);
  EXPECT_THAT(options.origin->peer, MatchesRegex("ipv4:127[.]0[.]0[.]1:[0-9]+"));
}

}  // namespace
}  // namespace axisd::testing
