#include "buses/can/link_report.hpp"

#include <gtest/gtest.h>
#include <linux/can/netlink.h>
#include <linux/if.h>
#include <linux/if_arp.h>
#include <linux/rtnetlink.h>
#include <sys/socket.h>

#include <cstring>
#include <random>

namespace axisd::can {
namespace {

using Bytes = std::vector<std::byte>;

template <class T>
void append(Bytes& to, const T& value) {
  const auto* begin = reinterpret_cast<const std::byte*>(&value);
  to.insert(to.end(), begin, begin + sizeof(T));
}

void append_attribute(Bytes& to, unsigned short type, const Bytes& payload) {
  append(to, rtattr{.rta_len = static_cast<unsigned short>(4 + payload.size()), .rta_type = type});
  to.insert(to.end(), payload.begin(), payload.end());
  while (to.size() % 4 != 0) to.push_back(std::byte{0});
}

Bytes text(const std::string& text) {
  Bytes bytes(text.size() + 1);
  std::memcpy(bytes.data(), text.c_str(), bytes.size());
  return bytes;
}

template <class T>
Bytes bytes_of(const T& value) {
  Bytes bytes;
  append(bytes, value);
  return bytes;
}

Bytes message(unsigned short type, const Bytes& payload) {
  nlmsghdr header{};
  header.nlmsg_len = static_cast<std::uint32_t>(sizeof(header) + payload.size());
  header.nlmsg_type = type;
  Bytes bytes;
  append(bytes, header);
  bytes.insert(bytes.end(), payload.begin(), payload.end());
  return bytes;
}

struct Link {
  unsigned char family = AF_UNSPEC;
  unsigned short hardware = ARPHRD_CAN;
  unsigned flags = 0;
  std::string kind = "can";
  std::uint32_t bitrate = 0;  // 0: none
  std::uint32_t state = CAN_STATE_ERROR_ACTIVE;
};

Bytes link(const Link& link, unsigned short type = RTM_NEWLINK) {
  ifinfomsg head{};
  head.ifi_family = link.family;
  head.ifi_type = link.hardware;
  head.ifi_index = 7;
  head.ifi_flags = link.flags;
  Bytes payload = bytes_of(head);
  append_attribute(payload, IFLA_IFNAME, text("can0"));
  append_attribute(payload, IFLA_MTU, bytes_of(std::uint32_t{16}));
  Bytes data;
  if (link.bitrate != 0)
    append_attribute(data, IFLA_CAN_BITTIMING, bytes_of(can_bittiming{.bitrate = link.bitrate}));
  append_attribute(data, IFLA_CAN_STATE, bytes_of(link.state));
  Bytes info;
  append_attribute(info, IFLA_INFO_KIND, text(link.kind));
  append_attribute(info, IFLA_INFO_DATA | NLA_F_NESTED, data);
  append_attribute(payload, IFLA_LINKINFO | NLA_F_NESTED, info);
  return message(type, payload);
}

TEST(LinkReport, TellsWhatTheInterfaceIs) {
  const auto reports = parse_link_reports(link({.flags = IFF_UP | IFF_ECHO, .bitrate = 500000}));
  ASSERT_EQ(reports.size(), 1U);
  const auto& report = reports.front();
  EXPECT_FALSE(report.gone);
  EXPECT_EQ(report.index, 7);
  EXPECT_EQ(report.name, "can0");
  EXPECT_TRUE(report.is_can);
  EXPECT_TRUE(report.up);
  EXPECT_TRUE(report.echo);
  EXPECT_EQ(report.bitrate, 500000U);
  EXPECT_EQ(report.controller, Controller::active);
}

TEST(LinkReport, TellsTheControllersState) {
  const auto state_of = [](std::uint32_t state) {
    return parse_link_reports(link({.state = state})).front().controller;
  };
  EXPECT_EQ(state_of(CAN_STATE_ERROR_WARNING), Controller::active);
  EXPECT_EQ(state_of(CAN_STATE_ERROR_PASSIVE), Controller::passive);
  EXPECT_EQ(state_of(CAN_STATE_BUS_OFF), Controller::bus_off);
  EXPECT_EQ(state_of(CAN_STATE_STOPPED), std::nullopt);
}

TEST(LinkReport, AVirtualInterfaceHasNoBitRateAndNoController) {
  const auto report = parse_link_reports(link({.kind = "vcan", .bitrate = 1})).front();
  EXPECT_TRUE(report.is_can);
  EXPECT_FALSE(report.up);
  EXPECT_FALSE(report.echo);
  EXPECT_EQ(report.bitrate, std::nullopt);
  EXPECT_EQ(report.controller, std::nullopt);
}

TEST(LinkReport, OtherInterfacesAndBridgesAreToldApart) {
  EXPECT_FALSE(parse_link_reports(link({.hardware = ARPHRD_ETHER, .kind = "veth"})).front().is_can);
  EXPECT_TRUE(parse_link_reports(link({.family = AF_BRIDGE})).empty());
}

TEST(LinkReport, RemovedOrNeverThereIsGone) {
  const auto removed = parse_link_reports(link({}, RTM_DELLINK)).front();
  EXPECT_TRUE(removed.gone);
  EXPECT_EQ(removed.index, 7);
  const auto missing = parse_link_reports(message(NLMSG_ERROR, bytes_of(nlmsgerr{.error = -ENODEV}))).front();
  EXPECT_TRUE(missing.gone);
  EXPECT_EQ(missing.index, 0);
  EXPECT_TRUE(parse_link_reports(message(NLMSG_ERROR, bytes_of(nlmsgerr{}))).empty());  // an acknowledgement
}

TEST(LinkReport, ReadsAllMessagesOfADatagram) {
  auto datagram = link({.flags = IFF_UP});
  const auto second = link({}, RTM_DELLINK);
  datagram.insert(datagram.end(), second.begin(), second.end());
  EXPECT_EQ(parse_link_reports(datagram).size(), 2U);
}

TEST(LinkReport, DamagedBytesDoNoHarm) {
  const auto sound = link({.flags = IFF_UP, .bitrate = 125000});
  for (std::size_t length = 0; length < sound.size(); ++length)
    EXPECT_TRUE(parse_link_reports(std::span(sound).first(length)).empty()) << length;
  std::mt19937 random(7);
  for (int round = 0; round < 20'000; ++round) {
    auto damaged = sound;
    for (int i = 0; i < 4; ++i)
      damaged.at(16 + random() % (damaged.size() - 16)) = static_cast<std::byte>(random());
    EXPECT_LE(parse_link_reports(damaged).size(), 1U);
  }
}

TEST(LinkReport, AsksForTheInterfaceByItsName) {
  const auto request = link_request("can0");
  nlmsghdr header{};
  std::memcpy(&header, request.data(), sizeof(header));
  EXPECT_EQ(header.nlmsg_len, request.size());
  EXPECT_EQ(header.nlmsg_type, RTM_GETLINK);
  auto answered = request;  // the same layout as an answer: the parser finds the name
  header.nlmsg_type = RTM_NEWLINK;
  std::memcpy(answered.data(), &header, sizeof(header));
  EXPECT_EQ(parse_link_reports(answered).front().name, "can0");
}

}  // namespace
}  // namespace axisd::can
