#include "api/axisctl/trace_format.hpp"

#include <gtest/gtest.h>

namespace axisd::axisctl {
namespace {

std::string hex(const std::string& bytes) {
  std::string text;
  constexpr auto digits = "0123456789ABCDEF";
  for (const char c : bytes) {
    const auto byte = static_cast<unsigned char>(c);
    text += digits[byte >> 4U];
    text += digits[byte & 0xFU];
  }
  return text;
}

v1::TracedFrame sdo() {
  v1::TracedFrame frame;
  frame.set_kind(v1::TRACE_KIND_SENT);
  frame.mutable_at()->set_seconds(1'436'509'053);
  frame.mutable_at()->set_nanos(850'870'999);
  frame.mutable_can()->set_id(0x605);
  frame.mutable_can()->set_length(8);
  frame.set_data(std::string("\x40\x41\x60\x00\x00\x00\x00\x00", 8));
  return frame;
}

TEST(TraceFormat, CandumpLinesAreThoseOfCandumpL) {
  auto frame = sdo();
  EXPECT_EQ(candump_line(frame, "can0"), "(1436509053.850870) can0 605#4041600000000000");
  frame.clear_data();
  frame.mutable_can()->set_length(0);
  EXPECT_EQ(candump_line(frame, "can0"), "(1436509053.850870) can0 605#");
  frame.mutable_can()->set_extended(true);
  frame.mutable_can()->set_remote(true);
  frame.mutable_can()->set_length(4);
  EXPECT_EQ(candump_line(frame, "can0"), "(1436509053.850870) can0 00000605#R4");
}

TEST(TraceFormat, PcapFilesHaveTheirLinkType) {
  EXPECT_EQ(hex(pcap_header(false)),
            "4D3CB2A1"
            "0200"
            "0400"
            "00000000"
            "00000000"
            "00000400"
            "93000000");
  EXPECT_EQ(hex(pcap_header(true)),
            "4D3CB2A1"
            "0200"
            "0400"
            "00000000"
            "00000000"
            "00000400"
            "E3000000");
}

TEST(TraceFormat, PcapPacketsHoldTheFrameOfTheWire) {
  v1::TracedFrame request;
  request.mutable_at()->set_seconds(1);
  request.mutable_at()->set_nanos(2);
  request.set_data(std::string("\x01\x03\x00\x00\x00\x01\x84\x0A", 8));
  EXPECT_EQ(hex(pcap_packet(request)),
            "01000000"
            "02000000"
            "08000000"
            "08000000"
            "010300000001840A");
  auto frame = sdo();
  frame.mutable_at()->set_seconds(1);
  frame.mutable_at()->set_nanos(2);
  EXPECT_EQ(hex(pcap_packet(frame)),
            "01000000"
            "02000000"
            "10000000"
            "10000000"
            "00000605"
            "08000000"
            "4041600000000000");
  frame.mutable_can()->set_extended(true);
  frame.mutable_can()->set_remote(true);
  frame.clear_data();
  EXPECT_EQ(hex(pcap_packet(frame)),
            "01000000"
            "02000000"
            "08000000"
            "08000000"
            "C0000605"
            "08000000");
}

TEST(TraceFormat, OnlyWhatWasOnTheWireIsThere) {
  v1::TracedFrame frame;
  for (const auto kind : {v1::TRACE_KIND_SENT, v1::TRACE_KIND_RECEIVED}) {
    frame.set_kind(kind);
    EXPECT_TRUE(on_wire(frame));
  }
  for (const auto kind : {v1::TRACE_KIND_NOT_SENT, v1::TRACE_KIND_FAILED, v1::TRACE_KIND_LINK}) {
    frame.set_kind(kind);
    EXPECT_FALSE(on_wire(frame));
  }
}

}  // namespace
}  // namespace axisd::axisctl
