#include "buses/canopen/sdo_frames.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <random>

#include "buses/canopen/cob.hpp"
#include "buses/canopen/nmt.hpp"
#include "buses/canopen/sdo_abort.hpp"
#include "buses/canopen/sdo_transfer.hpp"
#include "buses/canopen/sync.hpp"

namespace axisd::canopen {
namespace {

using testing::ElementsAre;

std::string request_text(const SdoData& data) { return can::to_string(can::make_frame(0x601, data)); }
SdoReply reply(const SdoData& data) { return parse_sdo_reply(can::make_frame(0x581, data)); }

struct Printed {
  std::string frame;
  Object object;
  std::uint64_t value;
  std::size_t size;
};

/// Every distinct request that the YSS-C manual prints (6.2.2, 6.2.4, 6.2.5 without its two bytes too many).
TEST(SdoFrames, PrintedDownloads) {
  const std::vector<Printed> printed{
      {"601#2B40600000000000", {0x6040, 0}, 0x00, 2}, {"601#2B40600006000000", {0x6040, 0}, 0x06, 2},
      {"601#2B40600007000000", {0x6040, 0}, 0x07, 2}, {"601#2B4060000F000000", {0x6040, 0}, 0x0F, 2},
      {"601#2B0E200005000000", {0x200E, 0}, 5, 2},    {"601#2B83600064000000", {0x6083, 0}, 100, 2},
      {"601#2B84600064000000", {0x6084, 0}, 100, 2},  {"601#2B8160003C000000", {0x6081, 0}, 60, 2},
      {"601#237A600088130000", {0x607A, 0}, 5000, 4}, {"601#2F60600001000000", {0x6060, 0}, 1, 1},
      {"601#2B4060004F000000", {0x6040, 0}, 0x4F, 2}, {"601#2B4060005F000000", {0x6040, 0}, 0x5F, 2},
      {"601#2383600064000000", {0x6083, 0}, 100, 4},  {"601#2384600064000000", {0x6084, 0}, 100, 4},
      {"601#23FF60003C000000", {0x60FF, 0}, 60, 4},   {"601#2F60600003000000", {0x6060, 0}, 3, 1},
  };
  for (const auto& one : printed) {
    const auto data = expedited_download_request(one.object, number_bytes(one.value, one.size));
    EXPECT_EQ(request_text(data), one.frame);
    const auto accepted = reply({0x60, data[1], data[2], data[3]});
    ASSERT_TRUE(std::holds_alternative<DownloadAccepted>(accepted)) << one.frame;
    EXPECT_EQ(std::get<DownloadAccepted>(accepted).object, one.object);
  }
}

TEST(SdoFrames, Requests) {
  EXPECT_EQ(request_text(upload_request({0x6041, 0})), "601#4041600000000000");
  EXPECT_EQ(request_text(expedited_download_request({0x2000, 3}, Bytes{1, 2, 3})), "601#2700200301020300");
  EXPECT_EQ(request_text(expedited_download_request({0x2000, 3}, Bytes{1, 2}, false)),
            "601#2200200301020000");
  EXPECT_EQ(request_text(segmented_download_request({0x1008, 0}, 0x01020304)), "601#2108100004030201");
  EXPECT_EQ(request_text(segmented_download_request({0x1008, 0}, std::nullopt)), "601#2008100000000000");
  EXPECT_EQ(request_text(upload_segment_request(false)), "601#6000000000000000");
  EXPECT_EQ(request_text(upload_segment_request(true)), "601#7000000000000000");
  EXPECT_EQ(request_text(download_segment_request(false, Bytes{1, 2, 3, 4, 5, 6, 7}, false)),
            "601#0001020304050607");
  EXPECT_EQ(request_text(download_segment_request(true, Bytes{8, 9}, true)), "601#1B08090000000000");
  EXPECT_EQ(request_text(abort_frame({0x6041, 0}, 0x05040000)), "601#8041600000000405");
}

TEST(SdoFrames, UploadReplies) {
  const std::vector<std::pair<std::uint8_t, Bytes>> sizes{
      {0x4F, {0x37}}, {0x4B, {0x37, 0x02}}, {0x47, {0x37, 0x02, 0x03}}, {0x43, {0x37, 0x02, 0x03, 0x04}}};
  for (const auto& [command, bytes] : sizes) {
    const auto parsed = reply({command, 0x41, 0x60, 0, 0x37, 0x02, 0x03, 0x04});
    ASSERT_TRUE(std::holds_alternative<ExpeditedUpload>(parsed));
    EXPECT_EQ(std::get<ExpeditedUpload>(parsed).bytes, bytes);
    EXPECT_TRUE(std::get<ExpeditedUpload>(parsed).size_indicated);
  }
  const auto unsized = std::get<ExpeditedUpload>(reply({0x42, 0x41, 0x60, 0, 1, 2, 3, 4}));
  EXPECT_FALSE(unsized.size_indicated);
  EXPECT_THAT(unsized.bytes, ElementsAre(1, 2, 3, 4));
  EXPECT_EQ(std::get<SegmentedUpload>(reply({0x41, 8, 0x10, 0, 0x1A, 0, 0, 0})).total_size, 26U);
  EXPECT_FALSE(std::get<SegmentedUpload>(reply({0x40, 8, 0x10, 0, 0x1A, 0, 0, 0})).total_size);
  const auto segment = std::get<UploadSegment>(reply({0x1B, 'o', 'k', 0, 0, 0, 0, 0}));
  EXPECT_TRUE(segment.toggle && segment.last);
  EXPECT_THAT(segment.bytes, ElementsAre('o', 'k'));
  EXPECT_TRUE(std::get<DownloadSegmentAccepted>(reply({0x30})).toggle);
  EXPECT_EQ(std::get<Aborted>(reply({0x80, 0x41, 0x60, 0, 0, 0, 2, 6})).code, 0x06020000U);
}

TEST(SdoFrames, WhatIsNoReply) {
  EXPECT_TRUE(std::holds_alternative<NotAReply>(reply({0xC0})));  // block upload
  EXPECT_TRUE(
      std::holds_alternative<NotAReply>(parse_sdo_reply(can::make_frame(0x581, Bytes{0x60, 1, 2, 3}))));
  auto remote = can::make_frame(0x581, SdoData{0x60});
  remote.rtr = true;
  EXPECT_TRUE(std::holds_alternative<NotAReply>(parse_sdo_reply(remote)));
}

TEST(SdoFrames, AbortCodesBecomeErrors) {
  const auto error = abort_error({0x607A, 0}, 0x06090031);
  EXPECT_EQ(error.reason, Reason::out_of_range);
  EXPECT_EQ(error.outcome, Outcome::refused);
  EXPECT_EQ(error.where.native_code, 0x06090031U);
  EXPECT_EQ(error.where.object, 0x607A00U);
  EXPECT_THAT(error.message, testing::HasSubstr("the value is too high"));
  EXPECT_FALSE(error.remedy.empty());
  EXPECT_TRUE(is_missing(abort_error({}, 0x06020000)) && is_missing(abort_error({}, 0x06090011)));
  EXPECT_TRUE(is_read_only(abort_error({}, 0x06010002)));
  EXPECT_TRUE(is_wrong_size(abort_error({}, 0x06070012)));
  const auto own = abort_error({0x2000, 0}, 0x12345678);
  EXPECT_EQ(own.reason, Reason::refused);
  EXPECT_THAT(own.message, testing::HasSubstr("12345678h"));
  auto unsent = abort_error({}, 0x06010002);
  unsent.outcome = Outcome::not_sent;
  EXPECT_FALSE(is_read_only(unsent));
}

TEST(SdoTransfer, SegmentedDownloadFrameByFrame) {
  auto transfer = SdoTransfer::download({0x1008, 0}, {1, 2, 3, 4, 5, 6, 7, 8, 9});
  EXPECT_EQ(request_text(transfer.first_frame()), "601#2108100009000000");
  EXPECT_FALSE(transfer.complete_at_server());
  auto step = transfer.on_reply(DownloadAccepted{{0x1008, 0}});
  EXPECT_EQ(request_text(*step.frame), "601#0001020304050607");
  step = transfer.on_reply(DownloadSegmentAccepted{false});
  EXPECT_EQ(request_text(*step.frame), "601#1B08090000000000");
  EXPECT_TRUE(transfer.complete_at_server());
  EXPECT_EQ(transfer.on_reply(DownloadSegmentAccepted{true}).kind, SdoTransfer::Step::Kind::done);
}

TEST(SdoTransfer, SegmentedUploadFrameByFrame) {
  auto transfer = SdoTransfer::upload({0x1008, 0}, 100);
  EXPECT_EQ(request_text(transfer.first_frame()), "601#4008100000000000");
  EXPECT_EQ(request_text(*transfer.on_reply(SegmentedUpload{{0x1008, 0}, 9}).frame), "601#6000000000000000");
  EXPECT_EQ(request_text(*transfer.on_reply(UploadSegment{false, Bytes(7, 'a'), false}).frame),
            "601#7000000000000000");
  EXPECT_EQ(transfer.on_reply(UploadSegment{true, Bytes(2, 'b'), true}).kind, SdoTransfer::Step::Kind::done);
  EXPECT_EQ(std::string(transfer.bytes().begin(), transfer.bytes().end()), "aaaaaaabb");
}

TEST(SdoTransfer, BrokenTransfersAreAborted) {
  const auto opened = [](std::optional<std::uint32_t> size, std::size_t limit = 10) {
    auto transfer = SdoTransfer::upload({0x1008, 0}, limit);
    transfer.first_frame();
    transfer.on_reply(SegmentedUpload{{0x1008, 0}, size});
    return transfer;
  };
  const auto failed = [](SdoTransfer transfer, const SdoReply& last, const std::string& frame) {
    const auto step = transfer.on_reply(last);
    EXPECT_EQ(step.kind, SdoTransfer::Step::Kind::failed);
    ASSERT_TRUE(step.frame);
    EXPECT_EQ(request_text(*step.frame), frame);
    EXPECT_EQ(step.error.outcome, Outcome::not_executed);
  };
  failed(opened({}), UploadSegment{true, {1}, false}, "601#8008100000000305");         // toggle
  failed(opened({}), UploadSegment{false, Bytes(11), false}, "601#8008100005000405");  // limit
  failed(opened(3), UploadSegment{false, Bytes(4), false}, "601#8008100010000706");    // more than announced
  failed(opened(3), UploadSegment{false, Bytes(2), true}, "601#8008100010000706");     // less
  failed(opened({}), DownloadAccepted{{0x1008, 0}}, "601#8008100001000405");           // something else
  auto transfer = SdoTransfer::upload({0x1008, 0}, 10);
  transfer.first_frame();
  failed(transfer, SegmentedUpload{{0x1008, 0}, 11}, "601#8008100005000405");  // announced too long
}

TEST(SdoTransfer, BeforeTheOpeningOnlyAnswersThatNameTheObjectCount) {
  using Kind = SdoTransfer::Step::Kind;
  for (const bool download : {false, true}) {
    auto transfer =
        download ? SdoTransfer::download({0x6040, 0}, {6, 0}) : SdoTransfer::upload({0x6040, 0}, 100);
    transfer.first_frame();
    const std::vector<SdoReply> foreign{
        ExpeditedUpload{{0x6041, 0}, {1}, true}, ExpeditedUpload{{0x6040, 1}, {1}, true},
        SegmentedUpload{{0x6041, 0}, 1},         UploadSegment{false, {1}, true},
        DownloadAccepted{{0x6041, 0}},           DownloadSegmentAccepted{false},
        Aborted{{0x6041, 0}, 0x08000000},        NotAReply{}};
    for (const auto& one : foreign) EXPECT_EQ(transfer.on_reply(one).kind, Kind::ignored);
    if (download)
      EXPECT_EQ(transfer.on_reply(ExpeditedUpload{{0x6040, 0}, {1}, true}).kind, Kind::ignored);
    else
      EXPECT_EQ(transfer.on_reply(DownloadAccepted{{0x6040, 0}}).kind, Kind::ignored);
    EXPECT_EQ(transfer.on_reply(Aborted{{0x6040, 0}, 0x08000022}).error.where.native_code, 0x08000022U);
  }
}

/// Whatever a node sends, a transfer ends or waits; it neither crashes nor grows beyond its limit.
TEST(SdoTransfer, SurvivesAnyFrames) {
  std::mt19937 random(1);
  for (int run = 0; run < 2000; ++run) {
    auto transfer = run % 2 == 0 ? SdoTransfer::upload({0x1008, 0}, 64)
                                 : SdoTransfer::download({0x1008, 0}, Bytes(1 + run % 30));
    transfer.first_frame();
    for (int i = 0; i < 40; ++i) {
      SdoData data{};
      for (auto& byte : data) byte = static_cast<std::uint8_t>(random());
      if (random() % 2 == 0) data = {static_cast<std::uint8_t>(random()), 0x08, 0x10, 0, 9};
      const auto step = transfer.on_reply(reply(data));
      if (step.kind == SdoTransfer::Step::Kind::done || step.kind == SdoTransfer::Step::Kind::failed) break;
      ASSERT_LE(transfer.bytes().size(), 71U);
    }
  }
}

TEST(Cob, PredefinedConnectionSet) {
  EXPECT_EQ(classify(0x000).service, Service::nmt);
  EXPECT_EQ(classify(0x080).service, Service::sync);
  EXPECT_EQ(classify(0x100).service, Service::time);
  EXPECT_EQ(classify(0x085), (CobId{.service = Service::emergency, .node = 5}));
  for (std::uint8_t number = 1; number <= 4; ++number) {
    for (const std::uint8_t node : {1, 127}) {
      EXPECT_EQ(classify(tpdo_id(number, node)), (CobId{Service::tpdo, node, number}));
      EXPECT_EQ(classify(rpdo_id(number, node)), (CobId{Service::rpdo, node, number}));
    }
  }
  EXPECT_EQ(tpdo_id(1, 1), 0x181U);
  EXPECT_EQ(rpdo_id(4, 127), 0x57FU);
  EXPECT_EQ(classify(0x581), (CobId{.service = Service::sdo_reply, .node = 1}));
  EXPECT_EQ(classify(0x67F), (CobId{.service = Service::sdo_request, .node = 127}));
  EXPECT_EQ(classify(0x701), (CobId{.service = Service::heartbeat, .node = 1}));
  for (const std::uint32_t id : {0x101U, 0x17FU, 0x180U, 0x580U, 0x600U, 0x680U, 0x700U, 0x780U, 0x7E5U})
    EXPECT_EQ(classify(id), CobId{}) << id;
}

TEST(Nmt, Frames) {
  // 6.2.2 prints "00: 01 00", to everybody; axisd names the node instead (M25).
  EXPECT_EQ(can::to_string(*nmt_frame(NmtCommand::start, 1)), "000#0101");
  EXPECT_EQ(can::to_string(*nmt_frame(NmtCommand::stop, 5)), "000#0205");
  EXPECT_EQ(can::to_string(*nmt_frame(NmtCommand::enter_pre_operational, 5)), "000#8005");
  EXPECT_EQ(can::to_string(*nmt_frame(NmtCommand::reset_node, 5)), "000#8105");
  EXPECT_EQ(can::to_string(*nmt_frame(NmtCommand::reset_communication, 127)), "000#827F");
  EXPECT_EQ(nmt_frame(NmtCommand::start, 0).error().reason, Reason::invalid_argument);
  EXPECT_FALSE(nmt_frame(NmtCommand::start, 128));
}

TEST(Nmt, Heartbeats) {
  const auto parsed = [](const Bytes& bytes) { return parse_heartbeat(can::make_frame(0x701, bytes)); };
  EXPECT_TRUE(parsed({0x00})->boot_up);
  EXPECT_EQ(parsed({0x04})->state, NmtState::stopped);
  EXPECT_EQ(parsed({0x85})->state, NmtState::operational);
  EXPECT_EQ(parsed({0x7F})->state, NmtState::pre_operational);
  for (const auto& bad : {Bytes{}, Bytes{0x05, 0}, Bytes{0x06}, Bytes{0x01}}) EXPECT_FALSE(parsed(bad));
}

TEST(Sync, Frames) {
  EXPECT_EQ(can::to_string(sync_frame(sync_id, 0)), "080#");
  EXPECT_EQ(can::to_string(sync_frame(sync_id, 7)), "080#07");
}

}  // namespace
}  // namespace axisd::canopen
