#include "buses/can/link_report.hpp"

#include <linux/can/netlink.h>
#include <linux/if.h>
#include <linux/if_arp.h>
#include <linux/if_link.h>
#include <linux/rtnetlink.h>
#include <sys/socket.h>

#include <algorithm>
#include <cstring>
#include <utility>

namespace axisd::can {
namespace {

using Bytes = std::span<const std::byte>;

constexpr std::size_t aligned(std::size_t length) { return (length + 3) & ~std::size_t{3}; }

/// A copy of the T at the beginning: netlink aligns to 4 bytes only.
template <class T>
std::optional<T> leading(Bytes bytes) {
  if (bytes.size() < sizeof(T)) return std::nullopt;
  T value;
  std::memcpy(&value, bytes.data(), sizeof(T));
  return value;
}

/// Takes the first attribute off `bytes`.
std::optional<std::pair<unsigned, Bytes>> take_attribute(Bytes& bytes) {
  const auto header = leading<rtattr>(bytes);
  if (!header || header->rta_len < sizeof(rtattr) || header->rta_len > bytes.size()) return std::nullopt;
  const auto payload = bytes.first(header->rta_len).subspan(sizeof(rtattr));
  bytes = bytes.subspan(std::min(aligned(header->rta_len), bytes.size()));
  return std::pair(header->rta_type & static_cast<unsigned>(NLA_TYPE_MASK), payload);
}

Bytes find_attribute(Bytes bytes, unsigned type) {
  while (const auto attribute = take_attribute(bytes))
    if (attribute->first == type) return attribute->second;
  return {};
}

std::optional<Controller> controller_of(std::uint32_t state) {
  switch (state) {
    case CAN_STATE_ERROR_ACTIVE:
    case CAN_STATE_ERROR_WARNING:
      return Controller::active;
    case CAN_STATE_ERROR_PASSIVE:
      return Controller::passive;
    case CAN_STATE_BUS_OFF:
      return Controller::bus_off;
    default:
      return std::nullopt;  // stopped or sleeping: the interface is down
  }
}

std::string text_of(Bytes bytes) {
  const std::string text(reinterpret_cast<const char*>(bytes.data()), bytes.size());
  return text.substr(0, text.find('\0'));
}

std::optional<LinkReport> link_of(Bytes payload, bool gone) {
  const auto link = leading<ifinfomsg>(payload);
  // Bridges report their ports in the same messages, of another family.
  if (!link || link->ifi_family != AF_UNSPEC) return std::nullopt;
  const auto attributes = payload.subspan(aligned(sizeof(ifinfomsg)));
  LinkReport report{.gone = gone,
                    .index = link->ifi_index,
                    .name = text_of(find_attribute(attributes, IFLA_IFNAME)),
                    .is_can = link->ifi_type == ARPHRD_CAN,
                    .up = (link->ifi_flags & unsigned{IFF_UP}) != 0,
                    .echo = (link->ifi_flags & unsigned{IFF_ECHO}) != 0,
                    .bitrate = std::nullopt,
                    .controller = std::nullopt};
  const auto info = find_attribute(attributes, IFLA_LINKINFO);
  if (text_of(find_attribute(info, IFLA_INFO_KIND)) != "can") return report;
  const auto data = find_attribute(info, IFLA_INFO_DATA);
  if (const auto timing = leading<can_bittiming>(find_attribute(data, IFLA_CAN_BITTIMING)))
    report.bitrate = timing->bitrate;
  if (const auto state = leading<std::uint32_t>(find_attribute(data, IFLA_CAN_STATE)))
    report.controller = controller_of(*state);
  return report;
}

}  // namespace

std::vector<LinkReport> parse_link_reports(Bytes datagram) {
  std::vector<LinkReport> reports;
  while (const auto header = leading<nlmsghdr>(datagram)) {
    if (header->nlmsg_len < sizeof(nlmsghdr) || header->nlmsg_len > datagram.size()) break;
    const auto payload = datagram.first(header->nlmsg_len).subspan(sizeof(nlmsghdr));
    if (header->nlmsg_type == RTM_NEWLINK || header->nlmsg_type == RTM_DELLINK) {
      if (auto report = link_of(payload, header->nlmsg_type == RTM_DELLINK))
        reports.push_back(*std::move(report));
    } else if (header->nlmsg_type == NLMSG_ERROR) {
      if (const auto error = leading<nlmsgerr>(payload); error && error->error != 0)
        reports.emplace_back().gone = true;
    }
    datagram = datagram.subspan(std::min(aligned(header->nlmsg_len), datagram.size()));
  }
  return reports;
}

std::vector<std::byte> link_request(const std::string& name) {
  rtattr attribute{};
  attribute.rta_type = IFLA_IFNAME;
  attribute.rta_len = static_cast<unsigned short>(sizeof(rtattr) + name.size() + 1);
  nlmsghdr header{};
  header.nlmsg_len =
      static_cast<std::uint32_t>(sizeof(nlmsghdr) + sizeof(ifinfomsg) + aligned(attribute.rta_len));
  header.nlmsg_type = RTM_GETLINK;
  header.nlmsg_flags = NLM_F_REQUEST;
  std::vector<std::byte> request(header.nlmsg_len);
  auto* at = request.data();
  std::memcpy(at, &header, sizeof(header));
  at += sizeof(header) + sizeof(ifinfomsg);
  std::memcpy(at, &attribute, sizeof(attribute));
  std::memcpy(at + sizeof(attribute), name.c_str(), name.size());
  return request;
}

}  // namespace axisd::can
