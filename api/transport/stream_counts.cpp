#include "api/transport/stream_counts.hpp"

#include <grpc/grpc.h>
#include <grpc/support/alloc.h>

#include <algorithm>
#include <charconv>
#include <memory>

namespace axisd::transport {
namespace {

/// What channelz answers; empty: it does not know what was asked for.
std::string answer(char* json) {
  const std::unique_ptr<char, decltype(&gpr_free)> owned(json, gpr_free);
  return json == nullptr ? std::string() : std::string(json);
}

/// The text of the next field of that name, which is cut off from `json` with what stands before it.
std::optional<std::string_view> next_text(std::string_view& json, std::string_view name) {
  const auto begin = json.find(name);
  if (begin == std::string_view::npos) return std::nullopt;
  json.remove_prefix(begin + name.size());
  const auto end = json.find('"');
  if (end == std::string_view::npos) return std::nullopt;
  const auto text = json.substr(0, end);
  json.remove_prefix(end + 1);
  return text;
}

/// 64 bit are strings in JSON.
std::optional<std::int64_t> next_number(std::string_view& json, std::string_view name) {
  const auto digits = next_text(json, name);
  std::int64_t value = 0;
  if (!digits || std::from_chars(digits->data(), digits->data() + digits->size(), value).ec != std::errc())
    return std::nullopt;
  return value;
}

/// Channelz leaves out a 0.
std::int64_t number(std::string_view json, std::string_view name) {
  return next_number(json, name).value_or(0);
}

}  // namespace

std::optional<StreamCount> streams_in(std::string_view socket) {
  if (socket.find(R"("socket":)") == std::string_view::npos) return std::nullopt;
  return StreamCount{
      .started = number(socket, R"("streamsStarted":")"),
      .ended = number(socket, R"("streamsSucceeded":")") + number(socket, R"("streamsFailed":")")};
}

std::optional<std::int64_t> sockets_in(std::string_view page, std::int64_t first,
                                       std::map<std::string, std::int64_t>& to) {
  constexpr std::string_view transport = "chttp2 ";
  auto next = first;
  while (const auto name = next_text(page, R"("name":")")) {
    const auto socket = next_number(page, R"("socketId":")");
    if (!socket || *socket < next) return std::nullopt;  // they are told in their order
    // A port that is used again is the newer one's.
    if (name->starts_with(transport))
      to.insert_or_assign(std::string(name->substr(transport.size())), *socket);
    next = *socket + 1;
  }
  return next == first ? std::nullopt : std::optional(next);
}

std::map<std::string, StreamCount> StreamCounts::of(const std::vector<std::string>& peers) {
  if (!std::ranges::all_of(peers, [this](const auto& peer) { return sockets_.contains(peer); })) learn();
  std::map<std::string, StreamCount> counts;
  for (const auto& peer : peers) {
    const auto known = sockets_.find(peer);
    if (known == sockets_.end()) continue;
    if (const auto count = streams_in(answer(grpc_channelz_get_socket(known->second))))
      counts.emplace(peer, *count);
    else
      sockets_.erase(known);  // it is gone; another one may have come from there
  }
  return counts;
}

void StreamCounts::learn() {
  sockets_.clear();
  const auto servers = answer(grpc_channelz_get_servers(0));
  std::string_view rest = servers;
  while (const auto server = next_number(rest, R"("serverId":")"))
    for (std::optional<std::int64_t> next = 0; next;)
      next = sockets_in(answer(grpc_channelz_get_server_sockets(*server, *next, 0)), *next, sockets_);
}

}  // namespace axisd::transport
