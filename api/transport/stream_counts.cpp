#include "api/transport/stream_counts.hpp"

#include <google/protobuf/struct.pb.h>
#include <google/protobuf/util/json_util.h>
#include <grpc/grpc.h>
#include <grpc/support/alloc.h>

#include <algorithm>
#include <charconv>
#include <memory>
#include <optional>
#include <string_view>

namespace axisd::transport {
namespace {

using google::protobuf::Struct;

/// What channelz answers; empty: it does not know what was asked for.
Struct answer(char* json) {
  const std::unique_ptr<char, decltype(&gpr_free)> owned(json, gpr_free);
  Struct parsed;
  if (json == nullptr || !google::protobuf::util::JsonStringToMessage(json, &parsed).ok()) return {};
  return parsed;
}

const Struct& object(const Struct& in, const std::string& name) {
  const auto found = in.fields().find(name);
  return found == in.fields().end() ? Struct::default_instance() : found->second.struct_value();
}

const google::protobuf::ListValue& list(const Struct& in, const std::string& name) {
  const auto found = in.fields().find(name);
  return found == in.fields().end() ? google::protobuf::ListValue::default_instance()
                                    : found->second.list_value();
}

std::string text(const Struct& in, const std::string& name) {
  const auto found = in.fields().find(name);
  return found == in.fields().end() ? std::string() : found->second.string_value();
}

/// 64 bit are strings in JSON. 0: there is none; so does channelz leave out a 0.
std::int64_t number(const Struct& in, const std::string& name) {
  const auto digits = text(in, name);
  std::int64_t value = 0;
  std::from_chars(digits.data(), digits.data() + digits.size(), value);
  return value;
}

/// Nothing: there is no such connection any more.
std::optional<std::int64_t> open_on(std::int64_t id) {
  const auto told = answer(grpc_channelz_get_socket(id));
  const auto& socket = object(told, "socket");
  if (socket.fields().empty()) return std::nullopt;
  const auto& counts = object(socket, "data");
  return number(counts, "streamsStarted") - number(counts, "streamsSucceeded") -
         number(counts, "streamsFailed");
}

}  // namespace

std::map<std::string, std::int64_t> StreamCounts::open(const std::vector<std::string>& peers) {
  if (!std::ranges::all_of(peers, [this](const auto& peer) { return sockets_.contains(peer); })) learn();
  std::map<std::string, std::int64_t> counts;
  for (const auto& peer : peers) {
    const auto known = sockets_.find(peer);
    if (known == sockets_.end()) continue;
    if (const auto count = open_on(known->second)) counts.emplace(peer, *count);
  }
  return counts;
}

void StreamCounts::learn() {
  constexpr std::string_view transport = "chttp2 ";
  sockets_.clear();
  const auto servers = answer(grpc_channelz_get_servers(0));
  for (const auto& server : list(servers, "server").values()) {
    const auto id = number(object(server.struct_value(), "ref"), "serverId");
    for (std::int64_t next = 0;;) {
      const auto page = answer(grpc_channelz_get_server_sockets(id, next, 0));
      const auto& sockets = list(page, "socketRef").values();
      if (sockets.empty()) break;
      for (const auto& each : sockets) {
        const auto name = text(each.struct_value(), "name");
        const auto socket = number(each.struct_value(), "socketId");
        // In the order of their ids: a port that is used again is the newer one's.
        if (name.starts_with(transport)) sockets_.insert_or_assign(name.substr(transport.size()), socket);
        next = socket + 1;
      }
    }
  }
}

}  // namespace axisd::transport
