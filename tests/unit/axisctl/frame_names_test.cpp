#include "api/axisctl/frame_names.hpp"

#include <gtest/gtest.h>

#include <initializer_list>

namespace axisd::axisctl {
namespace {

v1::ListParametersResponse catalogue() {
  v1::ListParametersResponse all;
  const auto add = [&](std::uint32_t address, const char* name, v1::ParameterType type) {
    auto& parameter = *all.add_parameters();
    parameter.set_address(address);
    parameter.set_name(name);
    parameter.set_type(type);
  };
  add(0x000B, "position_low", v1::PARAMETER_TYPE_UINT16);
  add(0x000C, "speed", v1::PARAMETER_TYPE_INT16);
  add(0x604000, "controlword", v1::PARAMETER_TYPE_UINT16);
  add(0x60FF00, "target_velocity", v1::PARAMETER_TYPE_INT32);
  return all;
}

class FrameNamesTest : public testing::Test {
 protected:
  FrameNamesTest() { names_.add(1, catalogue()); }

  std::string rtu(v1::TraceKind kind, std::initializer_list<unsigned> bytes) {
    v1::TracedFrame frame;
    frame.set_kind(kind);
    for (const auto byte : bytes) frame.mutable_data()->push_back(static_cast<char>(byte));
    if (bytes.size() > 0) {
      frame.set_node(*bytes.begin());
      frame.mutable_data()->append(2, '\0');  // the CRC was judged by others
    } else {
      frame.set_node(1);
    }
    return names_.text(frame);
  }
  std::string sent(std::initializer_list<unsigned> bytes) { return rtu(v1::TRACE_KIND_SENT, bytes); }
  std::string received(std::initializer_list<unsigned> bytes) { return rtu(v1::TRACE_KIND_RECEIVED, bytes); }
  std::string can(std::uint32_t id, std::initializer_list<unsigned> bytes) {
    v1::TracedFrame frame;
    frame.set_kind(v1::TRACE_KIND_RECEIVED);
    frame.mutable_can()->set_id(id);
    for (const auto byte : bytes) frame.mutable_data()->push_back(static_cast<char>(byte));
    return names_.text(frame);
  }

  FrameNames names_;
};

TEST_F(FrameNamesTest, RegistersAreNamedInRequestAndReply) {
  EXPECT_EQ(sent({1, 3, 0x00, 0x0B, 0x00, 0x02}), "read position_low to speed");
  EXPECT_EQ(received({1, 3, 4, 0x03, 0xE8, 0xFF, 0xC4}), "position_low=1000 speed=-60");
  EXPECT_EQ(sent({1, 3, 0x00, 0x0C, 0x00, 0x01}), "read speed");
  EXPECT_EQ(sent({1, 6, 0x00, 0x0C, 0x00, 0x05}), "write speed=5");
  EXPECT_EQ(received({1, 6, 0x00, 0x0C, 0x00, 0x05}), "written");
  EXPECT_EQ(sent({1, 16, 0x00, 0x0B, 0x00, 0x02, 4, 0, 7, 0, 8}), "write position_low=7 speed=8");
  EXPECT_EQ(received({1, 0x83, 2}), "refused: exception 2, illegal register");
}

TEST_F(FrameNamesTest, WhatHasNoNameIsAnAddress) {
  EXPECT_EQ(sent({1, 3, 0x00, 0x30, 0x00, 0x01}), "read 0x0030");
  EXPECT_EQ(sent({2, 3, 0x00, 0x0C, 0x00, 0x01}), "read 0x000C") << "no axis of this node is known";
  EXPECT_EQ(sent({1, 0x2B, 1, 2, 3, 4}), "");
  EXPECT_EQ(can(0x601, {0x40, 0x41, 0x60, 0, 0, 0, 0, 0}), "read 6041h:00");
}

TEST_F(FrameNamesTest, AReplyBelongsToTheRequestBeforeIt) {
  EXPECT_EQ(received({1, 3, 2, 0, 1}), "") << "nothing was asked for";
  sent({1, 3, 0x00, 0x0C, 0x00, 0x01});
  EXPECT_EQ(rtu(v1::TRACE_KIND_FAILED, {}), "");
  EXPECT_EQ(received({1, 3, 2, 0, 1}), "") << "it is late";
  sent({1, 3, 0x00, 0x0C, 0x00, 0x01});
  EXPECT_EQ(rtu(v1::TRACE_KIND_NOT_SENT, {1, 3, 0x00, 0x0B, 0x00, 0x01}), "read position_low");
  EXPECT_EQ(received({1, 3, 2, 0, 1}), "speed=1");
  EXPECT_EQ(received({1}), "");
}

TEST_F(FrameNamesTest, ObjectsAreNamed) {
  EXPECT_EQ(can(0x601, {0x2B, 0x40, 0x60, 0, 0x0F, 0, 0, 0}), "write controlword=15");
  EXPECT_EQ(can(0x581, {0x60, 0x40, 0x60, 0, 0, 0, 0, 0}), "written controlword");
  EXPECT_EQ(can(0x601, {0x40, 0xFF, 0x60, 0, 0, 0, 0, 0}), "read target_velocity");
  EXPECT_EQ(can(0x581, {0x43, 0xFF, 0x60, 0, 0xFE, 0xFF, 0xFF, 0xFF}), "target_velocity=-2");
  EXPECT_EQ(can(0x581, {0x41, 0xFF, 0x60, 0, 9, 0, 0, 0}), "target_velocity, in segments");
  EXPECT_EQ(can(0x581, {0x80, 0x40, 0x60, 0, 0x02, 0, 0x01, 0x06}), "abort controlword: 0x06010002");
  EXPECT_EQ(can(0x601, {0x40, 0xFF}), "");
}

TEST_F(FrameNamesTest, OtherServicesOfCanopen) {
  EXPECT_EQ(can(0x000, {1, 5}), "NMT start, node 5");
  EXPECT_EQ(can(0x080, {}), "SYNC");
  EXPECT_EQ(can(0x081, {0x30, 0x81, 0, 0, 0, 0, 0, 0}), "EMCY 0x8130");
  EXPECT_EQ(can(0x181, {0, 0}), "TPDO1");
  EXPECT_EQ(can(0x201, {0, 0}), "RPDO1");
  EXPECT_EQ(can(0x481, {0, 0}), "TPDO4");
  EXPECT_EQ(can(0x501, {0, 0}), "RPDO4");
  EXPECT_EQ(can(0x701, {5}), "heartbeat, operational");
  EXPECT_EQ(can(0x7E5, {0}), "");
}

}  // namespace
}  // namespace axisd::axisctl
