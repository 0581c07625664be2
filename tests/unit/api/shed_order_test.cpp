// What gives way where clients have too much in progress, kind by kind; stops never do.
#include <gmock/gmock.h>
#include <google/protobuf/wrappers.pb.h>
#include <grpcpp/support/sync_stream.h>

#include <algorithm>
#include <list>

#include "api/server/admission.hpp"
#include "axisd/v1/command_service.grpc.pb.h"
#include "axisd/v1/event_service.grpc.pb.h"
#include "tests/unit/api/serving.hpp"

namespace axisd::testing {
namespace {

using server::Admission;
using Kind = Admission::Kind;
using grpc::internal::RpcMethod;

constexpr int all = 40;

TEST(ShedOrder, EachKindGivesWayBeforeTheNextOne) {
  int before = 0;
  for (const auto& share : Admission::shed_order) {
    EXPECT_GT(share.percent, before) << share.name;
    before = share.percent;
  }
  EXPECT_EQ(before, 100) << "the last of them has all places";
}

TEST(ShedOrder, AKindIsLetInUntilItsShareIsTaken) {
  for (const auto& share : Admission::shed_order) {
    Admission admission({.calls = 1000, .streams = 1000, .all = all});
    std::vector<Admission::Ticket> taken;
    while (std::cmp_less(taken.size(), all * share.percent / 100)) {
      auto ticket = admission.admit("busy", share.kind);
      ASSERT_TRUE(ticket) << share.name << " " << taken.size();
      taken.push_back(*std::move(ticket));
    }
    const auto refused = admission.admit("busy", share.kind);
    ASSERT_FALSE(refused) << share.name;
    EXPECT_EQ(refused.error().reason, Reason::busy);
    EXPECT_THAT(refused.error().message, ::testing::HasSubstr(share.name));
    taken.pop_back();
    EXPECT_TRUE(admission.admit("busy", share.kind)) << share.name << ": there is a place again";
  }
}

TEST(ShedOrder, WhoeverHasNothingGetsACallThatReadsAndAStream) {
  Admission admission({.calls = 1000, .streams = 1000, .all = all});
  std::vector<Admission::Ticket> taken;
  for (int i = 0; i < all; ++i) taken.push_back(*admission.admit("busy", Kind::motion));
  for (const auto kind : {Kind::reflection, Kind::health_watch})
    EXPECT_FALSE(admission.admit("other", kind)) << "nobody needs these";
  for (const auto kind : {Kind::stream, Kind::read}) {
    auto first = admission.admit("other", kind);
    ASSERT_TRUE(first);
    EXPECT_FALSE(admission.admit("other", kind));
    taken.push_back(*std::move(first));
  }
}

TEST(ShedOrder, WhoeverWaitsForOneMotionMayBeginTheNext) {
  Admission admission({.calls = 1000, .streams = 1000, .all = all});
  std::vector<Admission::Ticket> taken;
  for (int i = 0; i < all; ++i) taken.push_back(*admission.admit("busy", Kind::motion));
  ASSERT_FALSE(admission.admit("busy", Kind::motion));
  // All are taken, and another client moves its axes none the less, each with a call that waits for its end.
  for (int i = 0; i < Admission::own_calls; ++i) {
    auto next = admission.admit("other", Kind::motion);
    ASSERT_TRUE(next) << i;
    taken.push_back(*std::move(next));
  }
  EXPECT_FALSE(admission.admit("other", Kind::motion));
  EXPECT_FALSE(admission.admit("other", Kind::read));
  EXPECT_TRUE(admission.admit("third", Kind::motion));
}

TEST(ShedOrder, TheLimitOfAClientComesFirst) {
  Admission admission({.calls = 2, .streams = 1, .all = all});
  std::vector<Admission::Ticket> taken;
  for (int i = 0; i < 2; ++i) taken.push_back(*admission.admit("a", Kind::motion));
  EXPECT_FALSE(admission.admit("a", Kind::motion));
}

using HealthRequest = google::protobuf::StringValue;
using HealthResponse = google::protobuf::Int32Value;

/// One client, which keeps open whatever it gets.
class FullServer : public Serving {
 protected:
  template <class Reader>
  struct Stream {
    Call context;
    std::unique_ptr<Reader> reader;
  };

  void SetUp() override {
    serve({.reflection = true, .limits = {.calls = 1000, .streams = 1000, .all = all}});
    events_ = v1::EventService::NewStub(channel_);
    commands_ = v1::CommandService::NewStub(channel_);
    machine_.hold();
  }
  void TearDown() override {
    machine_.let_go();
    for (auto& call : calls_) call.TryCancel();
    for (auto& stream : watches_) stream.context.TryCancel();
    for (auto& stream : health_) stream.context.TryCancel();
    for (auto& stream : reflection_) stream.context.TryCancel();
    EXPECT_TRUE(eventually([this] { return ended_.load() == started_; }));
  }

  /// The client gets a place, and keeps it.
  bool gets(Kind kind) {
    switch (kind) {
      case Kind::reflection:
        return asks_for_reflection();
      case Kind::health_watch:
        return watches_health();
      case Kind::stream:
        return watches_events();
      case Kind::read:
        return calls<v1::GetCommandRequest, v1::GetCommandResponse>(
            [this](auto... rest) { commands_->async()->GetCommand(rest...); });
      case Kind::motion:
        return calls<v1::ResetRequest, v1::ResetResponse>(
            [this](auto... rest) { axes_->async()->Reset(rest...); });
    }
    return false;
  }

  bool asks_for_reflection() {
    using Factory = grpc::internal::ClientReaderWriterFactory<grpc::ByteBuffer, grpc::ByteBuffer>;
    auto& stream = reflection_.emplace_back();
    const auto* path = "/grpc.reflection.v1alpha.ServerReflection/ServerReflectionInfo";
    stream.reader.reset(Factory::Create(channel_.get(), RpcMethod(path, RpcMethod::BIDI_STREAMING, channel_),
                                        &stream.context));
    const grpc::Slice list_services("\x3a\x00", 2);
    (void)stream.reader->Write({&list_services, 1});
    grpc::ByteBuffer said;
    return taken(stream, said);
  }
  bool watches_health() {
    auto& stream = health_.emplace_back();
    stream.reader.reset(grpc::internal::ClientReaderFactory<HealthResponse>::Create(
        channel_.get(), RpcMethod("/grpc.health.v1.Health/Watch", RpcMethod::SERVER_STREAMING, channel_),
        &stream.context, HealthRequest()));
    HealthResponse said;
    return taken(stream, said);
  }
  bool watches_events() {
    auto& stream = watches_.emplace_back();
    stream.reader = events_->WatchEvents(&stream.context, {});
    v1::WatchEventsResponse said;
    return taken(stream, said);
  }
  template <class Reader, class Response>
  bool taken(Stream<Reader>& stream, Response& said) {
    if (stream.reader->Read(&said)) return ++taken_ > 0;
    EXPECT_EQ(stream.reader->Finish().error_code(), grpc::StatusCode::RESOURCE_EXHAUSTED);
    return false;
  }

  /// A call that the machine does not answer yet, unless it is refused.
  template <class Request, class Response, class Begin>
  bool calls(Begin begin) {
    struct Pending {
      Request request;
      Response response;
      std::atomic<bool> ended{false};
      grpc::Status status;
    };
    const auto pending = std::make_shared<Pending>();
    if constexpr (std::is_same_v<Request, v1::ResetRequest>) {
      pending->request.set_axis("feeder");
      pending->request.mutable_options()->set_request_id("r-" + std::to_string(started_));
    } else {
      pending->request.set_id("c-1");
    }
    const auto waiting = machine_.held();
    ++started_;
    begin(&calls_.emplace_back(), &pending->request, &pending->response,
          [this, pending](grpc::Status status) {
            pending->status = std::move(status);
            pending->ended = true;
            ++ended_;
          });
    EXPECT_TRUE(eventually([&] { return pending->ended || machine_.held() > waiting; }));
    if (!pending->ended) return ++taken_ > 0;
    EXPECT_EQ(pending->status.error_code(), grpc::StatusCode::RESOURCE_EXHAUSTED)
        << pending->status.error_message();
    return false;
  }

  std::unique_ptr<v1::EventService::Stub> events_;
  std::unique_ptr<v1::CommandService::Stub> commands_;
  std::list<Call> calls_;
  std::list<Stream<grpc::ClientReader<v1::WatchEventsResponse>>> watches_;
  std::list<Stream<grpc::ClientReader<HealthResponse>>> health_;
  std::list<Stream<grpc::ClientReaderWriter<grpc::ByteBuffer, grpc::ByteBuffer>>> reflection_;
  int taken_ = 0, started_ = 0;
  std::atomic<int> ended_{0};
};

TEST_F(FullServer, GivesWayInTheStatedOrder) {
  for (const auto& share : Admission::shed_order) ASSERT_TRUE(gets(share.kind)) << share.name;
  for (auto full = Admission::shed_order.begin(); full != Admission::shed_order.end(); ++full) {
    while (taken_ < all * full->percent / 100) ASSERT_TRUE(gets(Kind::motion)) << taken_;
    for (auto each = Admission::shed_order.begin(); each != Admission::shed_order.end(); ++each)
      EXPECT_EQ(gets(each->kind), each > full) << each->name << " with " << taken_ << " of " << all;
  }
  ASSERT_EQ(taken_, all);
  // Not one place is left, and a stop goes to the machine none the less.
  const auto submitted = machine_.submitted().size();
  v1::StopRequest request;
  request.set_axis("feeder");
  v1::StopResponse response;
  ++started_;
  axes_->async()->Stop(&calls_.emplace_back(), &request, &response, [this](const grpc::Status& status) {
    EXPECT_TRUE(status.ok()) << status.error_message();
    ++ended_;
  });
  EXPECT_TRUE(eventually([&] { return machine_.submitted().size() > submitted; }));
  machine_.let_go();
  EXPECT_TRUE(eventually([this] { return ended_.load() == started_; }));
  machine_.hold();
  EXPECT_TRUE(gets(Kind::read)) << "what has ended has given back its place";
}

}  // namespace
}  // namespace axisd::testing
