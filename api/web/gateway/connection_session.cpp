// Log-in, log-out, and who is logged in.
#include <fmt/format.h>
#include <google/protobuf/struct.pb.h>
#include <google/protobuf/util/json_util.h>
#include <spdlog/spdlog.h>

#include <charconv>
#include <utility>

#include "api/web/gateway/connection.hpp"
#include "api/web/gateway/http_rules.hpp"
#include "api/web/gateway/passwords.hpp"

namespace axisd::web {

namespace http = boost::beast::http;

namespace {

/// Bytes of the body.
constexpr std::uint64_t most_log_in = 8192;

/// A member of a JSON object that is text; nothing: there is none.
std::optional<std::string> text_of(const google::protobuf::Struct& object, const std::string& name) {
  const auto found = object.fields().find(name);
  if (found == object.fields().end() || !found->second.has_string_value()) return std::nullopt;
  return found->second.string_value();
}

std::int64_t seconds_until(TimePoint when, TimePoint now) {
  return std::chrono::duration_cast<std::chrono::seconds>(when - now).count();
}

/// A member of a JSON object; empty: there is one machine, which has no name here.
std::string machines_json(const Machines& machines) {
  std::string list;
  for (const auto& [name, upstream] : machines)
    if (!name.empty())
      list += fmt::format(R"({}{{"name":{},"trouble":{}}})", list.empty() ? "" : ",", json_text(name),
                          json_text(upstream->trouble()));
  return list.empty() ? list : fmt::format(R"(,"machines":[{}])", list);
}

std::string session_json(const Session& session, TimePoint end, TimePoint now, bool own) {
  return fmt::format(
      R"({{"id":{},"name":{},"role":{},"peer":{},"begun_s":{},"used_s":{},"expires_in_s":{},"own":{}}})",
      session.id, json_text(session.person.name), json_text(session.person.role), json_text(session.peer),
      seconds_until(now, session.begun), seconds_until(now, session.used), seconds_until(end, now), own);
}

}  // namespace

void Connection::serve_session() {
  const auto method = parser_->get().method();
  if (method == http::verb::post) return log_in();
  if (method == http::verb::delete_) return log_out();
  if (method != http::verb::get) return refuse(plain(405, "GET, POST and DELETE are served here"));
  if (!identify(false))
    return answer(json(401, R"({"reason":"no_session","message":"nobody is logged in"})"));
  std::int64_t left = 0;
  for (const auto& session : gateway_.sessions.list())
    if (session.id == known_.session)
      left = seconds_until(gateway_.sessions.end_of(session), gateway_.clock.now());
  answer(json(200, fmt::format(R"({{"name":{},"role":{},"how":"{}","expires_in_s":{}{}}})",
                               json_text(known_.person.name), json_text(known_.person.role),
                               to_string(known_.person.how), left, machines_json(gateway_.machines))));
}

void Connection::log_in() {
  if (!same_origin()) return refuse(plain(403, "another origin"));
  if (!header(http::field::content_type).starts_with("application/json"))
    return refuse(plain(415, "only application/json is taken"));
  if (parser_->chunked() || parser_->content_length().value_or(0) > most_log_in)
    return refuse(plain(413, "a log-in is no longer than 8192 bytes"));
  read_body([this] {
    google::protobuf::Struct object;
    const auto& body = parser_->get().body();
    const bool is_json = google::protobuf::util::JsonStringToMessage(body, &object).ok();
    const auto name = is_json ? text_of(object, "name") : std::nullopt;
    const auto password = is_json ? text_of(object, "password") : std::nullopt;
    parser_->get().body() = {};
    if (!name || !password || name->size() > longest_user_name || password->size() > longest_password)
      return answer(json(400, R"({"reason":"no_log_in","message":"a name and a password are needed"})"));
    ask_authority({.name = *name, .secret = *password});
  });
}

void Connection::ask_authority(const Credentials& credentials) {
  const auto pause = gateway_.pauses.left(peer_, credentials.name, gateway_.clock.now());
  if (pause > Duration::zero())
    return refuse_log_in("too_soon", "too many failed attempts: wait a moment", pause);
  const bool taken = gateway_.authority->ask(
      credentials, [self = shared_from_this(), name = credentials.name](
                       const std::optional<Admitted>& admitted) { self->logged_in(name, admitted); });
  if (!taken) refuse_log_in("busy", "others log in: try again", std::chrono::seconds(1));
}

void Connection::logged_in(const std::string& name, const std::optional<Admitted>& admitted) {
  const auto now = gateway_.clock.now();
  // Whoever has left by now counts all the same.
  if (admitted)
    gateway_.pauses.succeeded(peer_, name);
  else
    gateway_.pauses.failed(peer_, name, now);
  if (phase_ == Phase::closed) return;
  if (!admitted) {
    if (gateway_.may_tell()) spdlog::warn("log-in from {} failed", peer_);
    return refuse_log_in("wrong", "name or password is wrong", gateway_.pauses.left(peer_, name, now));
  }
  const auto& person = admitted->person;
  if (gateway_.may_tell()) spdlog::info("{} ({}) has logged in from {}", person.name, person.role, peer_);
  const auto token = gateway_.sessions.begin(person, peer_, admitted->proof, now);
  ever_known_ = true;
  Answer begun{.status = 204};
  begun.headers.emplace_back("Set-Cookie", fmt::format("{}={}; {}HttpOnly; SameSite=Strict; Path=/",
                                                       Gateway::cookie_name(transport_.encrypted()), token,
                                                       transport_.encrypted() ? "Secure; " : ""));
  answer(begun);
}

void Connection::refuse_log_in(std::string_view reason, std::string_view message, Duration pause) {
  const auto ms = std::chrono::ceil<std::chrono::milliseconds>(pause).count();
  answer(
      json(401, fmt::format(R"({{"reason":"{}","message":"{}","retry_after_ms":{}}})", reason, message, ms)));
}

void Connection::log_out() {
  if (!same_origin()) return refuse(plain(403, "another origin"));
  if (identify(false) && known_.session != 0) gateway_.sessions.end(known_.session);
  Answer ended{.status = 204};
  ended.headers.emplace_back("Set-Cookie", fmt::format("{}=; {}HttpOnly; SameSite=Strict; Path=/; Max-Age=0",
                                                       Gateway::cookie_name(transport_.encrypted()),
                                                       transport_.encrypted() ? "Secure; " : ""));
  answer(ended);
}

void Connection::serve_sessions(std::string_view path) {
  const auto method = parser_->get().method();
  const bool ends = method == http::verb::delete_ && path.starts_with("/sessions/");
  if (!ends && (method != http::verb::get || path != "/sessions"))
    return refuse(plain(405, "GET /sessions and DELETE /sessions/ID are served here"));
  if (ends && !same_origin()) return refuse(plain(403, "another origin"));
  if (!identify(true)) return answer(json(401, R"({"reason":"no_session","message":"nobody is logged in"})"));
  const bool all = known_.person.role == "maintainer" || known_.person.how == How::loopback;
  const auto now = gateway_.clock.now();
  std::string list;
  std::uint64_t doomed = 0;
  if (ends)
    std::from_chars(path.data() + std::string_view("/sessions/").size(), path.data() + path.size(), doomed);
  bool found = false;
  for (const auto& session : gateway_.sessions.list()) {
    const bool own = session.person.name == known_.person.name && known_.person.how == session.person.how;
    if (!all && !own) continue;
    found = found || session.id == doomed;
    list += (list.empty() ? "" : ",") +
            session_json(session, gateway_.sessions.end_of(session), now, session.id == known_.session);
  }
  if (!ends) return answer(json(200, fmt::format("[{}]", list)));
  if (!found) return answer(plain(404, "there is no such session"));
  gateway_.sessions.end(doomed);
  answer({.status = 204});
}

}  // namespace axisd::web
