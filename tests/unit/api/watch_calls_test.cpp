// Statistics, traces and flight records through a real connection.
#include <gmock/gmock.h>

#include "axisd/v1/bus_service.grpc.pb.h"
#include "tests/unit/api/serving.hpp"

namespace axisd::testing {
namespace {

using namespace std::chrono_literals;
using ::testing::ElementsAre;

class WatchCalls : public Serving {
 protected:
  void SetUp() override { serve(); }
  std::unique_ptr<v1::BusService::Stub> stub() { return v1::BusService::NewStub(channel_); }

  static TraceBatch batch(std::uint64_t sequence, std::uint64_t lost = 0) {
    TracedFrame frame{.at = TimePoint(5s),
                      .kind = TracedFrame::Kind::not_sent,
                      .transaction_class = TransactionClass::motion,
                      .node = 3,
                      .why = "superseded"};
    TraceBatch batch{.lost = lost};
    batch.frames.push_back({.sequence = sequence, .wall = WallTime(7s), .frame = frame, .data = {3, 6}});
    return batch;
  }
};

TEST_F(WatchCalls, StatisticsTellEverythingThatWasCounted) {
  Call context;
  v1::GetBusStatisticsRequest request;
  request.set_bus("line-a");
  v1::GetBusStatisticsResponse response;
  ASSERT_TRUE(stub()->GetBusStatistics(&context, request, &response).ok());
  EXPECT_THAT(machine_.watch().log(), ElementsAre("statistics line-a"));
  ASSERT_EQ(response.buses_size(), 2);
  const auto& line = response.buses(0);
  EXPECT_EQ(line.utilisation(), 0.25);
  EXPECT_EQ(line.utilisation_since_start(), 0.125);
  ASSERT_EQ(line.classes_size(), 6);
  const auto& motion = line.classes(1);
  EXPECT_EQ(motion.transaction_class(), v1::TRANSACTION_CLASS_MOTION);
  EXPECT_EQ(motion.sent(), 1U);
  EXPECT_EQ(motion.most_waiting(), 3U);
  EXPECT_EQ(motion.dropped_superseded(), 1U);
  // 2 ms: 0.1 ms * 2^(17/4) is 1.9 ms, and 2^(18/4) is 2.26 ms.
  ASSERT_EQ(motion.queueing().counts_size(), 19);
  EXPECT_EQ(motion.queueing().counts(18), 1U);
  EXPECT_EQ(motion.exchange().longest().nanos(), 5'000'000);
  ASSERT_EQ(line.nodes_size(), 1);
  const auto& node = line.nodes(0);
  EXPECT_EQ(node.name(), "feeder");
  ASSERT_EQ(node.line().exceptions_size(), 1);
  EXPECT_EQ(node.line().exceptions(0).name(), "illegal data address");
  EXPECT_EQ(node.line().longest_turnaround().nanos(), 2'000'000);
  const auto& quarantine = node.line().quarantine();
  EXPECT_TRUE(quarantine.active());
  EXPECT_EQ(quarantine.lasting().seconds(), 7);
  EXPECT_EQ(quarantine.next_probe_in().nanos(), 250'000'000);
  EXPECT_EQ(quarantine.probes(), 4U);
  EXPECT_EQ(quarantine.times(), 2U);
  EXPECT_EQ(line.held_back(), 5U);
  EXPECT_EQ(node.unknown_starts().not_executed(), 2U);
  EXPECT_FALSE(node.has_network());
  const auto& network = response.buses(1);
  ASSERT_EQ(network.classes_size(), 6);
  EXPECT_EQ(network.classes(4).transaction_class(), v1::TRANSACTION_CLASS_PARAMETERS);
  EXPECT_EQ(network.classes(4).exchange().longest().nanos(), 3'000'000);
  ASSERT_EQ(network.nodes_size(), 1);
  EXPECT_EQ(network.nodes(0).network().sdo_timeouts(), 2U);
  EXPECT_EQ(network.nodes(0).network().tpdos(), 40U);
  EXPECT_EQ(network.nodes(0).network().emergencies(), 6U);
}

TEST_F(WatchCalls, StatisticsComeAtThePaceOfTheirReader) {
  Call context;
  v1::WatchBusStatisticsRequest request;
  request.set_bus("line-a");
  request.mutable_period()->set_nanos(250'000'000);
  const auto reader = stub()->WatchBusStatistics(&context, request);
  ASSERT_TRUE(eventually([this] { return machine_.watch().wanted(); }));
  EXPECT_THAT(machine_.watch().log(), ElementsAre("watch_statistics line-a 250"));
  for (std::uint64_t missed = 0; missed < 3; ++missed) {
    machine_.watch().tick(StatisticsTick{.buses = {{.bus = "line-a", .recent_load = 0.5}}, .missed = missed});
    v1::WatchBusStatisticsResponse response;
    ASSERT_TRUE(reader->Read(&response));
    EXPECT_EQ(response.missed(), missed);
    ASSERT_EQ(response.buses_size(), 1);
    EXPECT_EQ(response.buses(0).utilisation(), 0.5);
    ASSERT_TRUE(eventually([this] { return machine_.watch().wanted(); })) << "asks for the next one";
  }
  context.TryCancel();
  reader->Finish();
  EXPECT_TRUE(eventually([this] { return !machine_.watch().wanted(); })) << "it ends with its stream";
}

TEST_F(WatchCalls, StatisticsComeOnceASecondUnlessAskedOtherwiseAndNotTooOften) {
  const auto code = [this](std::optional<int> milliseconds) {
    Call context;
    v1::WatchBusStatisticsRequest request;
    if (milliseconds) {
      request.mutable_period()->set_seconds(*milliseconds / 1000);
      request.mutable_period()->set_nanos(*milliseconds % 1000 * 1'000'000);
    }
    const auto reader = stub()->WatchBusStatistics(&context, request);
    if (!milliseconds) {
      EXPECT_TRUE(eventually([this] { return machine_.watch().wanted(); }));
      context.TryCancel();
    }
    return reader->Finish().error_code();
  };
  for (const int milliseconds : {0, 99, 60'001})
    EXPECT_EQ(code(milliseconds), grpc::StatusCode::OUT_OF_RANGE) << milliseconds;
  EXPECT_EQ(code({}), grpc::StatusCode::CANCELLED);
  EXPECT_THAT(machine_.watch().log(), ElementsAre("watch_statistics  1000"));
}

TEST_F(WatchCalls, ATraceIsWrittenBatchByBatch) {
  Call context;
  v1::TraceBusRequest request;
  request.set_bus("line-a");
  request.set_node(3);
  const auto reader = stub()->TraceBus(&context, request);
  ASSERT_TRUE(eventually([this] { return machine_.watch().wanted(); }));
  EXPECT_THAT(machine_.watch().log(), ElementsAre("trace line-a 3"));
  for (std::uint64_t sequence = 1; sequence <= 3; ++sequence) {
    machine_.watch().frames(batch(sequence, sequence - 1));
    v1::TraceBusResponse response;
    ASSERT_TRUE(reader->Read(&response));
    EXPECT_EQ(response.lost(), sequence - 1);
    ASSERT_EQ(response.frames_size(), 1);
    const auto& frame = response.frames(0);
    EXPECT_EQ(frame.sequence(), sequence);
    EXPECT_EQ(frame.monotonic_ns(), 5'000'000'000);
    EXPECT_EQ(frame.at().seconds(), 7);
    EXPECT_EQ(frame.kind(), v1::TRACE_KIND_NOT_SENT);
    EXPECT_EQ(frame.transaction_class(), v1::TRANSACTION_CLASS_MOTION);
    EXPECT_EQ(frame.why(), "superseded");
    EXPECT_EQ(frame.text(), "5000000000 line-a -- 03 06 not sent: superseded @motion");
    EXPECT_FALSE(frame.has_can());
    ASSERT_TRUE(eventually([this] { return machine_.watch().wanted(); })) << "asks for the next one";
  }
  context.TryCancel();
  reader->Finish();
  EXPECT_TRUE(eventually([this] { return !machine_.watch().wanted(); })) << "the trace ends with its stream";
}

TEST_F(WatchCalls, ATraceOfNothingIsRefused) {
  {
    Call context;
    v1::TraceBusRequest request;
    request.set_bus("line-a");
    request.set_node(0);
    EXPECT_EQ(stub()->TraceBus(&context, request)->Finish().error_code(), grpc::StatusCode::INVALID_ARGUMENT);
  }
  machine_.watch().refuse_with(Error{.reason = Reason::invalid_argument, .message = "there is no bus 'x'"});
  Call context;
  v1::TraceBusRequest request;
  request.set_bus("x");
  const auto status = stub()->TraceBus(&context, request)->Finish();
  EXPECT_EQ(status.error_code(), grpc::StatusCode::INVALID_ARGUMENT);
  EXPECT_EQ(detail_of(status).message(), "there is no bus 'x'");
}

TEST_F(WatchCalls, FlightRecordsAreListedReadAndWritten) {
  {
    Call context;
    v1::ListFlightRecordsResponse response;
    ASSERT_TRUE(stub()->ListFlightRecords(&context, {}, &response).ok());
    ASSERT_EQ(response.records_size(), 1);
    EXPECT_EQ(response.records(0).name(), "line-a-1.wire");
    EXPECT_EQ(response.records(0).reason(), "feeder: ErrorStop");
    EXPECT_EQ(response.records(0).size(), 77U);
    EXPECT_EQ(response.records(0).written_at().seconds(), 3600);
  }
  {
    Call context;
    v1::GetFlightRecordRequest request;
    request.set_name("line-a-1.wire");
    v1::GetFlightRecordResponse response;
    ASSERT_TRUE(stub()->GetFlightRecord(&context, request, &response).ok());
    EXPECT_EQ(response.text(), "# bus: line-a\n");
  }
  Call context;
  v1::WriteFlightRecordRequest request;
  request.set_bus("line-a");
  v1::WriteFlightRecordResponse response;
  ASSERT_TRUE(stub()->WriteFlightRecord(&context, request, &response).ok());
  EXPECT_EQ(response.name(), "line-a-2.wire");
  EXPECT_THAT(machine_.watch().log(), ElementsAre("flight_records", "flight_record line-a-1.wire",
                                                  "write_flight_record line-a " + own_name()));
}

}  // namespace
}  // namespace axisd::testing
