// Streams, slow readers and shutdown through a real connection.
#include <gmock/gmock.h>
#include <grpcpp/generic/generic_stub.h>

#include <thread>

#include "axisd/v1/command_service.grpc.pb.h"
#include "tests/unit/api/serving.hpp"

namespace axisd::testing {
namespace {

using namespace std::chrono_literals;

/// An open WatchAxes stream.
struct Watch {
  Watch(v1::AxisService::Stub& stub, std::chrono::milliseconds period,
        const std::vector<std::string>& axes = {}, const std::vector<std::string>& fields = {}) {
    v1::WatchAxesRequest request;
    for (const auto& field : fields) request.mutable_fields()->add_paths(field);
    for (const auto& axis : axes) request.add_axes(axis);
    request.mutable_period()->set_seconds(period.count() / 1000);
    request.mutable_period()->set_nanos(static_cast<int>(period.count() % 1000 * 1'000'000));
    reader = stub.WatchAxes(&context, request);
  }
  bool read() { return reader->Read(&batch); }

  Call context;
  std::unique_ptr<grpc::ClientReader<v1::WatchAxesResponse>> reader;
  v1::WatchAxesResponse batch;
};

class Streams : public Serving {
 protected:
  void get_axis() {
    Call context;
    v1::GetAxisRequest request;
    request.set_axis("feeder");
    v1::GetAxisResponse response;
    EXPECT_TRUE(axes_->GetAxis(&context, request, &response).ok());
  }
  void stop_axis() {
    Call context;
    v1::StopRequest request;
    request.set_axis("feeder");
    v1::StopResponse response;
    EXPECT_TRUE(axes_->Stop(&context, request, &response).ok());
  }
  /// Axis states so large that a few batches fill every buffer between server and reader.
  void publish_large(double position) {
    AxisSnapshot snapshot{.name = "feeder", .unit = "mm"};
    snapshot.position = position;
    snapshot.alarm_name = std::string(200'000, 'x');
    machine_.publish(std::move(snapshot));
  }
  /// Opens a stream, reads nothing, and returns when nothing more can be written to it. A second stream is
  /// the metronome: of its ticks, the stalled one leaves half without a batch of its own.
  std::unique_ptr<Watch> stalled_watch() {
    auto watch = std::make_unique<Watch>(*axes_, 10ms, std::vector<std::string>{"feeder"});
    Watch metronome(*axes_, 10ms, {"turntable"});
    constexpr std::uint64_t ticks = 40;
    EXPECT_TRUE(eventually([&] {
      const auto before = server_->batches_serialised();
      for (std::uint64_t i = 0; i < ticks; ++i) EXPECT_TRUE(metronome.read());
      return server_->batches_serialised() - before < ticks + ticks / 2;
    }));
    metronome.context.TryCancel();
    return watch;
  }
};

TEST_F(Streams, FirstBatchComesAtOnceAndShowsWhatWasPublishedBefore) {
  serve();
  Watch first(*axes_, 60s);
  ASSERT_TRUE(first.read());
  EXPECT_EQ(first.batch.instance_id(), "i-1");
  EXPECT_EQ(first.batch.tick(), 1U);
  EXPECT_EQ(first.batch.dropped(), 0U);
  ASSERT_EQ(first.batch.axes_size(), 2);
  EXPECT_EQ(first.batch.axes(0).axis(), "feeder");
  AxisSnapshot snapshot{.name = "feeder"};
  snapshot.position = 12;
  machine_.publish(snapshot);
  Watch second(*axes_, 60s);
  ASSERT_TRUE(second.read());
  EXPECT_EQ(second.batch.axes(0).position(), 12);
}

TEST_F(Streams, TicksCountOnAndAgesAreFresh) {
  serve();
  AxisSnapshot snapshot{.name = "feeder"};
  snapshot.sampled.set({}, machine_.now(), {});
  machine_.publish(snapshot);
  Watch watch(*axes_, 10ms, {"feeder"});
  ASSERT_TRUE(watch.read());
  EXPECT_EQ(watch.batch.axes(0).age().seconds(), 0);
  machine_.set_now(machine_.now() + 5s);
  for (std::uint64_t tick = 2; watch.batch.axes(0).age().seconds() != 5; ++tick) {
    ASSERT_TRUE(watch.read());  // the age grows although nothing was published
    EXPECT_EQ(watch.batch.tick(), tick);
  }
}

TEST_F(Streams, RefusesUnknownAxesAndPeriods) {
  serve();
  Watch unknown(*axes_, 100ms, {"nobody"});
  EXPECT_FALSE(unknown.read());
  EXPECT_EQ(detail_of(unknown.reader->Finish()).reason(), v1::REASON_UNKNOWN_AXIS);
  Watch fast(*axes_, 1ms);
  EXPECT_FALSE(fast.read());
  EXPECT_EQ(detail_of(fast.reader->Finish()).reason(), v1::REASON_OUT_OF_RANGE);
}

TEST_F(Streams, OnlyTheFieldsAskedForAreSent) {
  serve();
  AxisSnapshot snapshot{.name = "feeder", .unit = "mm"};
  snapshot.position = 12;
  snapshot.velocity = 3;
  snapshot.fault = Error{.reason = Reason::alarm, .message = "overcurrent"};
  machine_.publish(snapshot);
  Watch watch(*axes_, 60s, {"feeder"}, {"velocity", "fault.message", "velocity"});
  ASSERT_TRUE(watch.read());
  EXPECT_EQ(watch.batch.instance_id(), "i-1");
  EXPECT_EQ(watch.batch.tick(), 1U);
  v1::AxisState expected;
  expected.set_axis("feeder");
  expected.set_velocity(3);
  expected.mutable_fault()->set_message("overcurrent");
  EXPECT_EQ(watch.batch.axes(0).SerializeAsString(), expected.SerializeAsString());
}

TEST_F(Streams, UnknownFieldsAreRefusedWithTheKnownOnes) {
  serve();
  for (const auto* path : {"speed", "", "fault.nothing", "inputs.name", "position.x"}) {
    Watch watch(*axes_, 100ms, {}, {"position", path});
    EXPECT_FALSE(watch.read());
    const auto status = watch.reader->Finish();
    EXPECT_EQ(status.error_code(), grpc::StatusCode::INVALID_ARGUMENT) << path;
    EXPECT_THAT(detail_of(status).message(), ::testing::HasSubstr(std::string("\"") + path + "\""));
    EXPECT_THAT(detail_of(status).remedy(), ::testing::HasSubstr("known are axis, unit, state, link,"));
    EXPECT_THAT(detail_of(status).remedy(), ::testing::HasSubstr("lease_holder"));
  }
}

TEST_F(Streams, StreamsOfTheSameFieldsShareTheirBatches) {
  serve();
  constexpr int streams = 8, batches = 20;
  std::vector<std::unique_ptr<Watch>> watches;
  for (int i = 0; i < streams; ++i) {
    // Named in whatever order, and with the one that is always there.
    watches.push_back(
        std::make_unique<Watch>(*axes_, 50ms, std::vector<std::string>{},
                                i % 2 == 0 ? std::vector<std::string>{"position", "velocity"}
                                           : std::vector<std::string>{"velocity", "axis", "position"}));
    ASSERT_TRUE(watches.back()->read());
  }
  const auto before = server_->batches_serialised();
  for (int batch = 0; batch < batches; ++batch)
    for (const auto& watch : watches) ASSERT_TRUE(watch->read());
  EXPECT_LT(server_->batches_serialised() - before, streams * batches / 2)
      << "as of EqualStreamsShareTheirBatches";
}

TEST_F(Streams, EqualStreamsShareTheirBatches) {
  serve();
  constexpr int streams = 8, batches = 20;
  std::vector<std::unique_ptr<Watch>> watches;
  for (int i = 0; i < streams; ++i) {
    // Named in whatever order, or all: the same axes.
    watches.push_back(std::make_unique<Watch>(
        *axes_, 50ms,
        i % 2 == 0 ? std::vector<std::string>{"turntable", "feeder"} : std::vector<std::string>{}));
    ASSERT_TRUE(watches.back()->read());
  }
  const auto before = server_->batches_serialised();
  for (int batch = 0; batch < batches; ++batch)
    for (auto& watch : watches) ASSERT_TRUE(watch->read());
  // One per tick, plus catching up on a loaded machine; never one per stream and tick.
  EXPECT_LT(server_->batches_serialised() - before, streams * batches / 2);
}

TEST_F(Streams, SlowReaderIsOwedOneBatchAndDelaysNobody) {
  serve({.stalled_reader_limit = 1h});
  publish_large(1);
  const auto watch = stalled_watch();
  publish_large(42);
  get_axis();
  stop_axis();
  Watch other(*axes_, 10ms, {"turntable"});
  for (int i = 0; i < 5; ++i) ASSERT_TRUE(other.read());
  other.context.TryCancel();

  // What was on its way comes first, then the newest value: nothing was queued up meanwhile.
  std::uint64_t old = 0;
  while (watch->read() && watch->batch.axes(0).position() != 42) ++old;
  EXPECT_GE(watch->batch.dropped(), 10U);
  EXPECT_EQ(watch->batch.tick(), old + 1);
}

TEST_F(Streams, OwnStreamsNeverLockOutAStop) {
  serve();
  std::vector<std::unique_ptr<Watch>> watches;
  for (int i = 0; i < 64; ++i) {
    watches.push_back(std::make_unique<Watch>(*axes_, 60s));
    ASSERT_TRUE(watches.back()->read()) << i;
  }
  Watch beyond(*axes_, 60s);
  EXPECT_FALSE(beyond.read());
  EXPECT_EQ(detail_of(beyond.reader->Finish()).reason(), v1::REASON_BUSY);
  stop_axis();  // on the same connection
}

TEST_F(Streams, ReaderThatNeverReadsIsCancelled) {
  serve({.limits = {.calls = 8, .streams = 1}, .stalled_reader_limit = 3s});
  publish_large(1);
  Watch stalled(*axes_, 10ms, {"feeder"});
  stalled.reader->WaitForInitialMetadata();  // it has the place, not the next one
  // The place of the stream becomes free when it has been cancelled.
  Watch refused(*axes_, 10ms);
  EXPECT_FALSE(refused.read());
  EXPECT_EQ(detail_of(refused.reader->Finish()).reason(), v1::REASON_BUSY);
  EXPECT_TRUE(eventually([this] { return Watch(*axes_, 10ms, {"turntable"}).read(); }));
  while (stalled.read()) {
  }
  EXPECT_EQ(stalled.reader->Finish().error_code(), grpc::StatusCode::CANCELLED);
}

TEST_F(Streams, CancelledStreamsGiveTheirPlaceBack) {
  serve({.limits = {.calls = 8, .streams = 1}});
  for (int i = 0; i < 20; ++i) {
    ASSERT_TRUE(eventually([this] {
      Watch watch(*axes_, 10ms);
      const bool admitted = watch.read();
      watch.context.TryCancel();
      watch.reader->Finish();
      return admitted;
    }));
  }
}

TEST_F(Streams, CommandIsFollowedToItsEnd) {
  serve();
  const auto commands = v1::CommandService::NewStub(channel_);
  Call context;
  v1::WatchCommandRequest request;
  request.set_id("c-1");
  const auto reader = commands->WatchCommand(&context, request);
  v1::WatchCommandResponse response;
  ASSERT_TRUE(reader->Read(&response));
  EXPECT_EQ(response.command().state(), v1::COMMAND_STATE_ACTIVE);
  machine_.change({.id = "c-1", .state = CommandState::done});
  ASSERT_TRUE(reader->Read(&response));
  EXPECT_EQ(response.command().state(), v1::COMMAND_STATE_DONE);
  EXPECT_FALSE(reader->Read(&response));
  EXPECT_TRUE(reader->Finish().ok());
  EXPECT_TRUE(eventually([this] { return machine_.watchers() == 0; }));
}

TEST_F(Streams, WatchingAnUnknownCommandIsAnError) {
  serve();
  machine_.refuse_with(Error{.reason = Reason::unknown_command});
  const auto commands = v1::CommandService::NewStub(channel_);
  Call context;
  v1::WatchCommandRequest request;
  request.set_id("c-7");
  const auto reader = commands->WatchCommand(&context, request);
  v1::WatchCommandResponse response;
  EXPECT_FALSE(reader->Read(&response));
  EXPECT_EQ(detail_of(reader->Finish()).reason(), v1::REASON_UNKNOWN_COMMAND);
}

TEST_F(Streams, LeavingClientEndsItsSubscription) {
  serve();
  const auto commands = v1::CommandService::NewStub(channel_);
  Call context;
  v1::WatchCommandRequest request;
  request.set_id("c-1");
  const auto reader = commands->WatchCommand(&context, request);
  v1::WatchCommandResponse response;
  ASSERT_TRUE(reader->Read(&response));
  EXPECT_EQ(machine_.watchers(), 1U);
  context.TryCancel();
  reader->Finish();
  EXPECT_TRUE(eventually([this] { return machine_.watchers() == 0; }));
}

TEST_F(Streams, ShutdownEndsStreamsAndWaitingCallsAtOnce) {
  serve();
  Watch first(*axes_, 10ms), second(*axes_, 60s);
  ASSERT_TRUE(first.read());
  ASSERT_TRUE(second.read());
  const auto commands = v1::CommandService::NewStub(channel_);
  Call context;
  v1::WatchCommandRequest request;
  request.set_id("c-1");
  const auto reader = commands->WatchCommand(&context, request);
  v1::WatchCommandResponse response;
  ASSERT_TRUE(reader->Read(&response));
  machine_.hold();
  grpc::Status home_status;
  std::thread home([&] {
    Call home_context;
    v1::HomeRequest home_request;
    home_request.set_axis("feeder");
    home_request.mutable_options()->set_request_id("r-1");
    v1::HomeResponse home_response;
    home_status = axes_->Home(&home_context, home_request, &home_response);
  });
  ASSERT_TRUE(eventually([this] { return machine_.held() == 1; }));

  std::thread readers([&] {
    while (first.read()) {
    }
    while (second.read()) {
    }
    while (reader->Read(&response)) {
    }
  });
  const auto began = monotonic_now();
  server_->shutdown(patience);
  EXPECT_LT(monotonic_now() - began, patience / 2);  // the deadline is for what cannot be ended
  readers.join();
  home.join();
  for (const auto& status :
       {first.reader->Finish(), second.reader->Finish(), reader->Finish(), home_status}) {
    EXPECT_EQ(status.error_code(), grpc::StatusCode::UNAVAILABLE);
    EXPECT_EQ(detail_of(status).message(), "axisd is shutting down");
  }
}

TEST_F(Streams, ShutdownDoesNotWaitForAReaderThatDoesNotRead) {
  serve({.stalled_reader_limit = 1h});
  publish_large(1);
  const auto watch = stalled_watch();
  const auto began = monotonic_now();
  server_->shutdown(patience);
  EXPECT_LT(monotonic_now() - began, patience / 2);
  watch->context.TryCancel();
}

TEST_F(Streams, ShutdownDoesNotWaitForHealthWatchers) {
  serve();
  grpc::GenericStub stub(channel_);
  grpc::CompletionQueue queue;
  Call context;
  const auto call = stub.PrepareCall(&context, "/grpc.health.v1.Health/Watch", &queue);
  void* tag = nullptr;
  bool ok = false;
  const grpc::Slice empty;
  grpc::ByteBuffer out(&empty, 1), in;
  call->StartCall(nullptr);
  ASSERT_TRUE(queue.Next(&tag, &ok) && ok);
  call->WriteLast(out, {}, nullptr);
  ASSERT_TRUE(queue.Next(&tag, &ok) && ok);
  call->Read(&in, nullptr);
  ASSERT_TRUE(queue.Next(&tag, &ok) && ok);
  const auto began = monotonic_now();
  server_->shutdown(patience);
  EXPECT_LT(monotonic_now() - began, patience / 2);
  context.TryCancel();
  grpc::Status status;
  call->Finish(&status, nullptr);
  ASSERT_TRUE(queue.Next(&tag, &ok));
}

}  // namespace
}  // namespace axisd::testing
