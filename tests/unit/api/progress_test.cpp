// Streams of long work and of events through a real connection.
#include <gmock/gmock.h>

#include <utility>
#include <vector>

#include "axisd/v1/bus_service.grpc.pb.h"
#include "axisd/v1/drive_service.grpc.pb.h"
#include "axisd/v1/event_service.grpc.pb.h"
#include "tests/unit/api/serving.hpp"

namespace axisd::testing {
namespace {

using namespace std::chrono_literals;
using ::testing::ElementsAre;

class ProgressStreams : public Serving {
 protected:
  void SetUp() override {
    drives_request_.set_axis("feeder");
    drives_request_.set_node(7);
    drives_request_.set_confirm("feeder");
    scan_request_.set_bus("line-a");
  }
  std::unique_ptr<grpc::ClientReader<v1::ScanResponse>> scan(Call& context) {
    return v1::BusService::NewStub(channel_)->Scan(&context, scan_request_);
  }
  std::unique_ptr<grpc::ClientReader<v1::ReaddressResponse>> readdress(Call& context) {
    return v1::DriveService::NewStub(channel_)->Readdress(&context, drives_request_);
  }
  void wait_for_scan() {
    ASSERT_TRUE(eventually([this] { return machine_.nodes().working(); }));
  }

  v1::ReaddressRequest drives_request_;
  v1::ScanRequest scan_request_;
};

TEST_F(ProgressStreams, ScanTellsItsProgressAndEnds) {
  serve();
  Call context;
  const auto reader = scan(context);
  wait_for_scan();
  EXPECT_THAT(machine_.nodes().log(), ElementsAre("scan line-a 1-127 bauds  formats 0"));
  machine_.nodes().progress(ScanProgress{.probed = 3,
                                         .total = 127,
                                         .found = {{.node = 3,
                                                    .baud = 115200,
                                                    .model = "ykd2405pr",
                                                    .pulses_per_revolution = 10000,
                                                    .configured_as = "feeder"}}});
  v1::ScanResponse response;
  ASSERT_TRUE(reader->Read(&response));
  EXPECT_EQ(response.probed(), 3U);
  ASSERT_EQ(response.found_size(), 1);
  EXPECT_EQ(response.found(0).format(), "8N1");
  EXPECT_EQ(response.found(0).configured_as(), "feeder");
  machine_.nodes().progress(ScanProgress{.probed = 127, .total = 127, .finished = true});
  ASSERT_TRUE(reader->Read(&response));
  EXPECT_EQ(response.probed(), 127U);
  EXPECT_FALSE(reader->Read(&response));
  EXPECT_TRUE(reader->Finish().ok());
  EXPECT_TRUE(eventually([this] { return !machine_.nodes().working(); }));
}

TEST_F(ProgressStreams, NothingFoundIsLostToASlowReader) {
  serve();
  Call context;
  const auto reader = scan(context);
  wait_for_scan();
  constexpr int nodes = 100;
  for (int node = 1; node <= nodes; ++node)
    machine_.nodes().progress(ScanProgress{.probed = node,
                                           .total = nodes,
                                           .found = {{.node = static_cast<std::uint8_t>(node)}},
                                           .finished = node == nodes});
  std::uint32_t expected = 1;
  v1::ScanResponse response, last;
  while (reader->Read(&response)) {
    for (const auto& found : response.found()) EXPECT_EQ(found.node(), expected++);
    last = response;
  }
  EXPECT_EQ(expected, nodes + 1U);
  EXPECT_EQ(last.probed(), static_cast<std::uint32_t>(nodes));
  EXPECT_TRUE(reader->Finish().ok());
}

TEST_F(ProgressStreams, LeavingEndsTheScan) {
  serve();
  Call context;
  const auto reader = scan(context);
  wait_for_scan();
  context.TryCancel();
  EXPECT_EQ(reader->Finish().error_code(), grpc::StatusCode::CANCELLED);
  EXPECT_TRUE(eventually([this] { return !machine_.nodes().working(); }));
  // Late progress finds nobody.
  machine_.nodes().progress(ScanProgress{.probed = 1, .total = 2});
}

TEST_F(ProgressStreams, FailuresAndBadRequestsEndWithDetails) {
  serve();
  Call context;
  const auto reader = scan(context);
  wait_for_scan();
  machine_.nodes().progress(fail(Reason::bus_down, "gone"));
  v1::ScanResponse response;
  EXPECT_FALSE(reader->Read(&response));
  EXPECT_EQ(detail_of(reader->Finish()).reason(), v1::REASON_BUS_DOWN);
  scan_request_.set_first_node(300);
  Call second;
  const auto refused = scan(second);
  EXPECT_FALSE(refused->Read(&response));
  EXPECT_EQ(refused->Finish().error_code(), grpc::StatusCode::OUT_OF_RANGE);
  EXPECT_EQ(machine_.nodes().log().size(), 1U);
}

TEST_F(ProgressStreams, ReaddressEndsWithWhatWasAskedFor) {
  serve();
  v1::ReaddressResponse response;
  {
    Call context;
    const auto reader = readdress(context);
    ASSERT_TRUE(eventually([this] { return machine_.drives().working(); }));
    machine_.drives().progress(SerialProgress{.text = "switch it off and on"});
    ASSERT_TRUE(reader->Read(&response));
    EXPECT_EQ(response.phase(), v1::SERIAL_PHASE_WRITTEN);
    EXPECT_FALSE(reader->Read(&response));
    EXPECT_TRUE(reader->Finish().ok());
  }
  ASSERT_TRUE(eventually([this] { return !machine_.drives().working(); }));
  drives_request_.mutable_verify()->set_seconds(60);
  Call context;
  const auto reader = readdress(context);
  ASSERT_TRUE(eventually([this] { return machine_.drives().working(); }));
  for (const auto phase :
       {SerialProgress::Phase::written, SerialProgress::Phase::waiting, SerialProgress::Phase::verified})
    machine_.drives().progress(SerialProgress{.phase = phase, .text = "text"});
  while (reader->Read(&response)) {
  }
  EXPECT_EQ(response.phase(), v1::SERIAL_PHASE_VERIFIED);
  EXPECT_TRUE(reader->Finish().ok());
  EXPECT_THAT(machine_.drives().log(),
              ElementsAre("change_serial feeder by " + own_name() + " node 7 baud 0 verify 0",
                          "change_serial feeder by " + own_name() + " node 7 baud 0 verify 60"));
}

TEST_F(ProgressStreams, ShutdownEndsThem) {
  serve();
  Call context;
  const auto reader = scan(context);
  wait_for_scan();
  server_->shutdown(patience);
  v1::ScanResponse response;
  EXPECT_FALSE(reader->Read(&response));
  const auto status = reader->Finish();
  EXPECT_EQ(status.error_code(), grpc::StatusCode::UNAVAILABLE);
  EXPECT_EQ(detail_of(status).message(), "axisd is shutting down");
  EXPECT_TRUE(eventually([this] { return !machine_.nodes().working(); }));
}

/// An open WatchEvents stream.
struct EventWatch {
  EventWatch(const std::shared_ptr<grpc::Channel>& channel, const v1::WatchEventsRequest& request)
      : reader(v1::EventService::NewStub(channel)->WatchEvents(&context, request)) {}
  bool read() { return reader->Read(&batch); }
  [[nodiscard]] std::vector<std::uint64_t> sequences() const {
    std::vector<std::uint64_t> all;
    for (const auto& event : batch.events()) all.push_back(event.sequence());
    return all;
  }

  Call context;
  std::unique_ptr<grpc::ClientReader<v1::WatchEventsResponse>> reader;
  v1::WatchEventsResponse batch;
};

class Events : public Serving {
 protected:
  void edge(const std::string& axis, bool active = true) {
    machine_.event_log().add(axis, TerminalEdge{.terminal = "X0",
                                                .function = "home",
                                                .active = active,
                                                .after = WallTime(1s),
                                                .before = WallTime(1s + 20ms)});
  }
  v1::WatchEventsRequest all_;
  Events() { all_.set_after_sequence(0); }
};

TEST_F(Events, OnlyNewOnesWithoutACursor) {
  serve();
  edge("feeder");
  EventWatch watch(channel_, {});
  ASSERT_TRUE(watch.read());  // at once: it has begun
  EXPECT_EQ(watch.batch.instance_id(), "i-1");
  EXPECT_EQ(watch.batch.cursor(), 1U);
  EXPECT_EQ(watch.batch.newest(), 1U);
  EXPECT_THAT(watch.sequences(), ElementsAre());
  edge("feeder", false);
  ASSERT_TRUE(watch.read());
  ASSERT_THAT(watch.sequences(), ElementsAre(2));
  const auto& event = watch.batch.events(0);
  EXPECT_EQ(event.axis(), "feeder");
  EXPECT_EQ(event.terminal_edge().terminal() + event.terminal_edge().function(), "X0home");
  EXPECT_FALSE(event.terminal_edge().active());
  EXPECT_EQ(event.terminal_edge().before().nanos(), 20'000'000);
  EXPECT_EQ(event.at().seconds(), 2);
}

TEST_F(Events, ACursorGoesOnWhereItStopped) {
  serve();
  for (int i = 0; i < 5; ++i) edge("feeder");
  v1::WatchEventsRequest request;
  request.set_instance_id("i-1");
  request.set_after_sequence(3);
  EventWatch same(channel_, request);
  ASSERT_TRUE(same.read());
  EXPECT_THAT(same.sequences(), ElementsAre(4, 5));
  request.set_instance_id("another run");
  EventWatch other(channel_, request);
  ASSERT_TRUE(other.read());
  EXPECT_THAT(other.sequences(), ElementsAre(1, 2, 3, 4, 5));
  EventWatch kept(channel_, all_);
  ASSERT_TRUE(kept.read());
  EXPECT_EQ(kept.batch.events_size(), 5);
  request.set_instance_id("i-1");
  request.set_after_sequence(6);
  EventWatch ahead(channel_, request);
  EXPECT_FALSE(ahead.read());
  EXPECT_EQ(ahead.reader->Finish().error_code(), grpc::StatusCode::INVALID_ARGUMENT);
}

TEST_F(Events, LostOnesAreCounted) {
  serve();
  machine_.event_log().keep(2);
  for (int i = 0; i < 5; ++i) edge("feeder");
  EventWatch watch(channel_, all_);
  ASSERT_TRUE(watch.read());
  EXPECT_EQ(watch.batch.lost(), 3U);
  EXPECT_THAT(watch.sequences(), ElementsAre(4, 5));
}

TEST_F(Events, FiltersByAxisAndKindAndStillMovesTheCursor) {
  serve();
  edge("feeder");
  machine_.event_log().add("turntable", LinkChange{.to = LinkState::online, .detail = ""});
  machine_.event_log().add("feeder", StateChange{.from = AxisState::standstill,
                                                 .to = AxisState::discrete_motion,
                                                 .cause = MotionCause::terminal});
  machine_.event_log().add("turntable", ConfigurationDrift{.text = "X1"});
  auto request = all_;
  request.add_axes("feeder");
  request.add_kinds(v1::EVENT_KIND_STATE_CHANGE);
  request.add_kinds(v1::EVENT_KIND_CONFIGURATION_DRIFT);
  EventWatch watch(channel_, request);
  ASSERT_TRUE(watch.read());
  EXPECT_THAT(watch.sequences(), ElementsAre(3));
  EXPECT_EQ(watch.batch.cursor(), 4U);
  EXPECT_EQ(watch.batch.events(0).state_change().cause(), v1::MOTION_CAUSE_TERMINAL);
  EventWatch everything(channel_, all_);
  ASSERT_TRUE(everything.read());
  EXPECT_EQ(everything.batch.events(1).link_change().to(), v1::LINK_STATE_ONLINE);
  EXPECT_EQ(everything.batch.events(3).configuration_drift().text(), "X1");

  request.add_kinds(v1::EVENT_KIND_UNSPECIFIED);
  EventWatch kind(channel_, request);
  EXPECT_FALSE(kind.read());
  EXPECT_EQ(kind.reader->Finish().error_code(), grpc::StatusCode::INVALID_ARGUMENT);
  request.clear_kinds();
  request.add_axes("nobody");
  EventWatch axis(channel_, request);
  EXPECT_FALSE(axis.read());
  EXPECT_EQ(axis.reader->Finish().error_code(), grpc::StatusCode::NOT_FOUND);
}

TEST_F(Events, CertificatesAreTold) {
  serve();
  machine_.event_log().add("", CertificateNotice{.what = CertificateNotice::What::expires_soon,
                                                 .path = "/etc/server.crt",
                                                 .expires = WallTime(std::chrono::seconds(1'800'000'000)),
                                                 .text = "renew it"});
  machine_.event_log().add("", CertificateNotice{.what = CertificateNotice::What::not_replaced});
  EventWatch watch(channel_, all_);
  ASSERT_TRUE(watch.read());
  const auto& soon = watch.batch.events(0).certificate_notice();
  EXPECT_EQ(soon.kind(), v1::CERTIFICATE_NOTICE_KIND_EXPIRES_SOON);
  EXPECT_EQ(soon.path(), "/etc/server.crt");
  EXPECT_EQ(soon.expires().seconds(), 1'800'000'000);
  EXPECT_EQ(soon.text(), "renew it");
  EXPECT_EQ(watch.batch.events(1).certificate_notice().kind(), v1::CERTIFICATE_NOTICE_KIND_NOT_REPLACED);
  EXPECT_FALSE(watch.batch.events(1).certificate_notice().has_expires());
}

TEST_F(Events, ManyComeInOrderAndInBoundedMessages) {
  serve();
  constexpr std::uint64_t half = 400;
  for (std::uint64_t i = 0; i < half; ++i) edge("feeder");
  EventWatch watch(channel_, all_);
  std::uint64_t seen = 0;
  bool more = false;
  while (seen < 2 * half && watch.read()) {
    EXPECT_LE(watch.batch.events_size(), 256);
    EXPECT_EQ(watch.batch.lost(), 0U);
    for (const auto sequence : watch.sequences()) EXPECT_EQ(sequence, ++seen);
    if (seen >= half && !std::exchange(more, true))
      for (std::uint64_t i = 0; i < half; ++i) edge("feeder");
  }
  EXPECT_EQ(seen, 2 * half);
}

TEST_F(Events, AReaderThatDoesNotReadIsCancelled) {
  serve({.limits = {.calls = 8, .streams = 1}, .stalled_reader_limit = 300ms});
  EventWatch stalled(channel_, all_);
  ASSERT_TRUE(stalled.read());
  // Large events fill every buffer between server and reader; the place of the stream becomes free when it
  // has been cancelled.
  EXPECT_TRUE(eventually([&] {
    machine_.event_log().add("feeder", ConfigurationDrift{.text = std::string(200'000, 'x')});
    return EventWatch(channel_, {}).read();
  }));
  while (stalled.read()) {
  }
  EXPECT_EQ(stalled.reader->Finish().error_code(), grpc::StatusCode::CANCELLED);
}

TEST_F(Events, ShutdownEndsThem) {
  serve();
  EventWatch watch(channel_, {});
  ASSERT_TRUE(watch.read());
  server_->shutdown(patience);
  EXPECT_FALSE(watch.read());
  EXPECT_EQ(watch.reader->Finish().error_code(), grpc::StatusCode::UNAVAILABLE);
  edge("feeder");  // the notification outlives the server
}

}  // namespace
}  // namespace axisd::testing
