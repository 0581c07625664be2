// What a request may carry: every bound of the contract, looked at before the call begins.
#include "api/server/bounds.hpp"

#include <gmock/gmock.h>
#include <google/protobuf/descriptor.h>
#include <grpcpp/generic/generic_stub.h>

#include <functional>
#include <future>
#include <memory>
#include <string>
#include <vector>

#include "api/server/lane/stop_lane.hpp"
#include "axisd/v1/audit_service.grpc.pb.h"
#include "axisd/v1/bounds.pb.h"
#include "axisd/v1/bus_service.grpc.pb.h"
#include "axisd/v1/command_service.grpc.pb.h"
#include "axisd/v1/drive_service.grpc.pb.h"
#include "axisd/v1/event_service.grpc.pb.h"
#include "axisd/v1/group_service.grpc.pb.h"
#include "axisd/v1/lease_service.grpc.pb.h"
#include "axisd/v1/stop_service.grpc.pb.h"
#include "axisd/v1/stop_service.pb.h"
#include "axisd/v1/system_service.grpc.pb.h"
#include "tests/unit/api/serving.hpp"

namespace axisd::testing {
namespace {

using google::protobuf::FieldDescriptor;
using google::protobuf::Message;
using google::protobuf::MethodDescriptor;
using server::check_bounds;
using ::testing::HasSubstr;
using ::testing::StartsWith;

std::unique_ptr<Message> request_of(const MethodDescriptor& method) {
  return std::unique_ptr<Message>(
      google::protobuf::MessageFactory::generated_factory()->GetPrototype(method.input_type())->New());
}

void add_entry(Message& message, const FieldDescriptor& field) {
  const auto& reflection = *message.GetReflection();
  switch (field.cpp_type()) {
    case FieldDescriptor::CPPTYPE_STRING:
      return reflection.AddString(&message, &field, "");
    case FieldDescriptor::CPPTYPE_UINT32:
      return reflection.AddUInt32(&message, &field, 0);
    case FieldDescriptor::CPPTYPE_ENUM:
      return reflection.AddEnumValue(&message, &field, 0);
    case FieldDescriptor::CPPTYPE_MESSAGE:
      reflection.AddMessage(&message, &field);
      return;
    default:
      FAIL() << field.full_name() << ": another type";
  }
}

/// Fills a request up to each of its bounds in turn, and `over` beyond it.
class Filling {
 public:
  /// With the request, and where it is full.
  using Visit = std::function<void(const Message& request, const std::string& where)>;
  Filling(Message& request, int over, Visit visit)
      : request_(request), over_(over), visit_(std::move(visit)) {
    fill(request, "");
  }

 private:
  void fill(Message& message, const std::string& outer) {
    const auto& type = *message.GetDescriptor();
    for (int i = 0; i < type.field_count(); ++i) {
      const auto& field = *type.field(i);
      const auto& bounds = field.options().GetExtension(v1::bounds);
      if (bounds.max_items() > 0) fill_entries(message, field, static_cast<int>(bounds.max_items()), outer);
      if (bounds.tolerated()) continue;
      if (field.cpp_type() == FieldDescriptor::CPPTYPE_STRING)
        fill_text(message, field, static_cast<int>(bounds.max_bytes()), outer);
      if (field.cpp_type() == FieldDescriptor::CPPTYPE_MESSAGE) go_inside(message, field, outer);
    }
  }
  void fill_entries(Message& message, const FieldDescriptor& field, int most, const std::string& outer) {
    if (!field.is_repeated()) return;  // it goes for what is in a message of another package
    for (int i = 0; i < most + over_; ++i) add_entry(message, field);
    visit_(request_, outer + field.name());
    message.GetReflection()->ClearField(&message, &field);
  }
  void fill_text(Message& message, const FieldDescriptor& field, int most, const std::string& outer) {
    const auto& reflection = *message.GetReflection();
    std::string text(static_cast<std::size_t>(most + over_), 'x');
    if (field.is_repeated())
      reflection.AddString(&message, &field, std::move(text));
    else
      reflection.SetString(&message, &field, std::move(text));
    visit_(request_, outer + field.name() + (field.is_repeated() ? "[0]" : ""));
    reflection.ClearField(&message, &field);
  }
  void go_inside(Message& message, const FieldDescriptor& field, const std::string& outer) {
    const auto& reflection = *message.GetReflection();
    if (field.message_type()->file()->package() != "axisd.v1") return;
    if (field.is_repeated())
      fill(*reflection.AddMessage(&message, &field), outer + field.name() + "[0].");
    else
      fill(*reflection.MutableMessage(&message, &field), outer + field.name() + ".");
    reflection.ClearField(&message, &field);
  }

  Message& request_;
  const int over_;
  const Visit visit_;
};

TEST(Bounds, EachOfEachRequestHolds) {
  int seen = 0;
  for (const auto* method : served_calls()) {
    SCOPED_TRACE(method->full_name());
    const auto request = request_of(*method);
    Filling(*request, 0, [](const Message& full, const std::string& where) {
      const auto within = check_bounds(full);
      EXPECT_TRUE(within) << where << ": " << to_string(within.error());
    });
    Filling(*request, 1, [&](const Message& beyond, const std::string& where) {
      ++seen;
      const auto within = check_bounds(beyond);
      ASSERT_FALSE(within) << where;
      EXPECT_EQ(within.error().reason, Reason::invalid_argument);
      EXPECT_THAT(within.error().message, StartsWith(where + " has "));
      EXPECT_FALSE(within.error().remedy.empty());
    });
  }
  EXPECT_GT(seen, 90);
}

TEST(Bounds, TheRefusalSaysWhatWasSentAndWhatIsPermitted) {
  v1::WatchAxesRequest watch;
  for (int i = 0; i < 1025; ++i) watch.add_axes("feeder");
  auto refused = check_bounds(watch);
  EXPECT_EQ(refused.error().message, "axes has 1025 entries; 1024 are permitted");
  EXPECT_EQ(refused.error().remedy, "give at most 1024 in one call");
  v1::MoveGroupRequest move;
  move.add_targets()->set_axis("feeder");
  move.add_targets()->set_axis(std::string(300, 'x'));
  refused = check_bounds(move);
  EXPECT_EQ(refused.error().message, "targets[1].axis has 300 bytes; 64 are permitted");
}

TEST(Bounds, ATypeOfAnotherPackageHasThoseOfItsField) {
  v1::WatchAxesRequest watch;
  watch.mutable_fields()->add_paths("position");
  EXPECT_TRUE(check_bounds(watch));
  watch.mutable_fields()->add_paths(std::string(129, 'x'));
  EXPECT_EQ(check_bounds(watch).error().message, "fields.paths[1] has 129 bytes; 128 are permitted");
  watch.mutable_fields()->clear_paths();
  for (int i = 0; i < 257; ++i) watch.mutable_fields()->add_paths("position");
  EXPECT_EQ(check_bounds(watch).error().message, "fields.paths has 257 entries; 256 are permitted");
}

/// A stop is refused for the name of its axis, and for more names than a machine has; else for nothing.
TEST(Bounds, NoStopIsRefusedForWhatItCanDoWithout) {
  const std::string longer(10'000, 'x');
  const auto expect_taken = [&]<class Request>(Request request) {
    request.set_axis("feeder");
    request.mutable_options()->set_request_id(longer);
    EXPECT_TRUE(check_bounds(request)) << Request::descriptor()->name();
  };
  expect_taken(v1::HaltRequest());
  expect_taken(v1::StopRequest());
  expect_taken(v1::QuickStopRequest());
  expect_taken(v1::DisableRequest());
  v1::GroupStopRequest stop;
  stop.set_group(longer);
  stop.add_axes(longer);
  stop.set_request_id(longer);
  EXPECT_TRUE(check_bounds(stop));
  for (int i = 0; i < 1024; ++i) stop.add_axes("feeder");
  EXPECT_THAT(check_bounds(stop).error().message, HasSubstr("1024 are permitted"));
}

TEST(Bounds, WhatIsNoRequestHasNone) {
  v1::AxisState state;
  state.set_axis(std::string(10'000, 'x'));
  EXPECT_TRUE(check_bounds(state));
}

class BoundedCalls : public Serving {
 protected:
  /// Calls a method with what is too much for it in each place, and expects the refusal.
  static void expect_refusals(const MethodDescriptor& method, const std::shared_ptr<grpc::Channel>& channel) {
    SCOPED_TRACE(method.full_name());
    const auto request = request_of(method);
    Filling(*request, 1, [&](const Message& beyond, const std::string& where) {
      const grpc::Slice slice(beyond.SerializeAsString());
      const grpc::ByteBuffer sent(&slice, 1);
      grpc::ByteBuffer received;
      Call context;
      std::promise<grpc::Status> done;
      grpc::GenericStub(channel).UnaryCall(
          &context, "/" + method.service()->full_name() + "/" + method.name(), grpc::StubOptions(), &sent,
          &received, [&](grpc::Status status) { done.set_value(std::move(status)); });
      const auto status = done.get_future().get();
      ASSERT_EQ(status.error_code(), grpc::StatusCode::INVALID_ARGUMENT) << where << status.error_message();
      EXPECT_THAT(status.error_message(), HasSubstr(where + " has "));
      EXPECT_EQ(detail_of(status).reason(), v1::REASON_INVALID_ARGUMENT);
      EXPECT_THAT(detail_of(status).message(), StartsWith(where + " has "));
    });
  }
};

TEST_F(BoundedCalls, EveryCallRefusesWhatIsTooMuch) {
  serve();
  for (const auto* method : served_calls()) expect_refusals(*method, channel_);
}

TEST_F(BoundedCalls, SoDoesTheStopLane) {
  // The service has no messages of its own, so that nothing else would link its description.
  [[maybe_unused]] const void* volatile linked = &descriptor_table_axisd_2fv1_2fstop_5fservice_2eproto;
  server::StopLane lane(machine_, {.listen = "127.0.0.1:0"});
  const auto port = lane.listen();
  ASSERT_TRUE(port) << to_string(port.error());
  lane.serve();
  const auto channel = connect("127.0.0.1:" + std::to_string(*port));
  for (const auto* method : calls_of(v1::StopService::service_full_name())) expect_refusals(*method, channel);
}

}  // namespace
}  // namespace axisd::testing
